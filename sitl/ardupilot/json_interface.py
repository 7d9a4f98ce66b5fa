"""ArduPilot's JSON interface: its motor outputs as binary packets in, one line of JSON with the state out.

As `SIM_JSON.cpp` and `SIM_JSON.h` of ArduPilot 4.7 read and write them. Its parser finds keys by their text
and does not skip spaces after a colon, so the line must be compact. It reads the last line that follows
another line's end, so a line begins with its own.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from framerunner.geometry.vectors import Quaternion, Vec3

FIRST_PORT = 9002  # of ArduPilot's instance 0
PORTS_AN_INSTANCE = 10
_FRAMES = {  # by their magic number, the first field: rate in Hz, number, pulse widths in microseconds
    18458: struct.Struct("<HHI16H"),
    29569: struct.Struct("<HHI32H"),
}
_VECTOR, _QUATERNION = "[%.9g,%.9g,%.9g]", "[%.9g,%.9g,%.9g,%.9g]"
_LINE = (
    f'\n{{"timestamp":%.6f,"imu":{{"gyro":{_VECTOR},"accel_body":{_VECTOR}}},"position":{_VECTOR},'
    f'"quaternion":{_QUATERNION},"velocity":{_VECTOR}%s}}\n'
)
_MAGIC = struct.Struct("<H")


@dataclass(frozen=True, slots=True)
class ServoFrame:
    """ArduPilot's outputs for one step of the simulation."""

    rate_hz: int  # at which it would like to be stepped
    number: int  # counts answered frames; repeated while the answer is missing, 0 at its start
    pulses_us: tuple[int, ...]  # 16 or 32 channels


def decode_frame(packet: bytes) -> ServoFrame | None:
    """The frame in a packet; None if it is not one."""
    if len(packet) < _MAGIC.size:
        return None
    layout = _FRAMES.get(_MAGIC.unpack_from(packet)[0])
    if layout is None or len(packet) != layout.size:
        return None
    _, rate_hz, number, *pulses = layout.unpack(packet)
    return ServoFrame(rate_hz, number, tuple(pulses))


def encode_state(
    time_us: int,
    *,
    angular_rate_frd_rad_s: Vec3,
    specific_force_frd_m_s2: Vec3,
    position_ned_m: Vec3,
    velocity_ned_m_s: Vec3,
    attitude: Quaternion,
    range_m: float | None = None,
) -> bytes:
    """The line for a state.

    Args:
        time_us: simulated time; ArduPilot advances its clock by the difference to the last line.
        angular_rate_frd_rad_s: of the gyroscope.
        specific_force_frd_m_s2: of the accelerometer.
        position_ned_m: from the home position given to ArduPilot.
        velocity_ned_m_s: over ground.
        attitude: body FRD to NED.
        range_m: of a range finder that looks down, below zero if it measures none; None: there is none.
    """
    line = _LINE % (
        *(time_us * 1e-6, *angular_rate_frd_rad_s, *specific_force_frd_m_s2),
        *(*position_ned_m, *attitude, *velocity_ned_m_s),
        "" if range_m is None else f',"rng_1":{range_m:.4f}',
    )
    return line.encode("ascii")
