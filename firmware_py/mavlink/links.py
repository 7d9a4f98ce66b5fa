"""Links: what is sent on each unasked, and what one link has seen and is owed.

The rates are PX4 v1.17's: its onboard link (UDP 14540) and its ground station link (UDP 14550).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from firmware_py.mavlink.dialect import mavlink
from firmware_py.mavlink.framing import Packet, PacketReader
from firmware_py.mavlink.schedule import Schedule

_DATAGRAM_BYTES = 1400  # packets are joined up to this, below the usual MTU


@dataclass(frozen=True, slots=True)
class LinkProfile:
    """A kind of link.

    Attributes:
        name: by which `MavlinkNode` is told and tells where bytes belong.
        rates_hz: message id to rate, in vehicle time.
    """

    name: str
    rates_hz: Mapping[int, float]


def _profile(name: str, rates_hz: dict[str, float]) -> LinkProfile:
    by_id = {int(getattr(mavlink, f"MAVLINK_MSG_ID_{message}")): rate for message, rate in rates_hz.items()}
    return LinkProfile(name, MappingProxyType(by_id))


ONBOARD = _profile(
    "onboard",
    {
        "HEARTBEAT": 1,
        "ALTITUDE": 10,
        "ATTITUDE": 100,
        "ATTITUDE_QUATERNION": 50,
        "BATTERY_STATUS": 0.5,
        "CURRENT_MODE": 0.5,
        "ESTIMATOR_STATUS": 1,
        "EXTENDED_SYS_STATE": 5,
        "GLOBAL_POSITION_INT": 50,
        "GPS_RAW_INT": 8,
        "HIGHRES_IMU": 50,
        "HOME_POSITION": 0.5,
        "LOCAL_POSITION_NED": 30,
        "MISSION_CURRENT": 1,
        "ODOMETRY": 30,
        "PING": 1,
        "POSITION_TARGET_LOCAL_NED": 10,
        "SCALED_PRESSURE": 1,
        "SERVO_OUTPUT_RAW": 10,
        "SYSTEM_TIME": 1,
        "SYS_STATUS": 5,
        "TIMESYNC": 10,
        "VFR_HUD": 10,
        "VIBRATION": 0.5,
    },
)

GROUND = _profile(
    "ground",
    {
        "HEARTBEAT": 1,
        "ALTITUDE": 1,
        "ATTITUDE": 50,
        "ATTITUDE_QUATERNION": 50,
        "BATTERY_STATUS": 0.5,
        "CURRENT_MODE": 0.5,
        "ESTIMATOR_STATUS": 0.5,
        "EXTENDED_SYS_STATE": 1,
        "GLOBAL_POSITION_INT": 50,
        "GPS_RAW_INT": 5,
        "HOME_POSITION": 0.5,
        "LOCAL_POSITION_NED": 50,
        "MISSION_CURRENT": 1,
        "PING": 0.1,
        "POSITION_TARGET_LOCAL_NED": 50,
        "SCALED_PRESSURE": 1,
        "SERVO_OUTPUT_RAW": 50,
        "SYS_STATUS": 1,
        "VFR_HUD": 4,
        "VIBRATION": 0.1,
    },
)


@dataclass(slots=True)
class Link:
    """One link at run time.

    Attributes:
        profile: what it is.
        reader: bytes in.
        schedule: which messages are due when.
        gcs_heard: a ground station's heartbeat came in here, so people read its texts.
        sequence: of the next packet.
    """

    profile: LinkProfile
    reader: PacketReader = field(default_factory=PacketReader)
    schedule: Schedule = field(init=False)
    gcs_heard: bool = False
    sequence: int = 0
    _datagrams: list[bytearray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.schedule = Schedule(self.profile.rates_hz)

    def send(self, packet: Packet) -> None:
        """Queue a packet."""
        data = packet.numbered(self.sequence)
        self.sequence = (self.sequence + 1) % 256
        if self._datagrams and len(self._datagrams[-1]) + len(data) <= _DATAGRAM_BYTES:
            self._datagrams[-1] += data
        else:
            self._datagrams.append(bytearray(data))

    def take(self) -> list[bytes]:
        """What is queued, in whole packets, several to a datagram."""
        if not self._datagrams:
            return []
        taken = [bytes(datagram) for datagram in self._datagrams]
        self._datagrams.clear()
        return taken
