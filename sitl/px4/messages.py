"""Messages of PX4's simulator interface, packed and read in microseconds: MAVLink 2 over a TCP connection.

Formats and checksum seeds are those of pymavlink's definitions; only its slow packing is replaced.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from struct import Struct

from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import (
    CHECKSUM_BYTES,
    CRC_EXTRA,
    HEADER_BYTES_V2,
    HEADER_V2,
    MARKER_V2,
    SIGNATURE_BYTES,
    SIGNED,
    checksum,
)

_CHECKSUM = Struct("<H")
SIMULATOR_SYSTEM_ID = 1
SIMULATOR_COMPONENT_ID = 200  # the component PX4's own simulators use
LOCKSTEP_FLAG = 1  # of HIL_ACTUATOR_CONTROLS
_AUTOPILOT = slice(5, 6)  # in the payload of HEARTBEAT
_PX4 = bytes([mavlink.MAV_AUTOPILOT_PX4])
ARMED_FLAG = int(mavlink.MAV_MODE_FLAG_SAFETY_ARMED)


class Packer:
    """Packs one kind of message.

    Args:
        message_id: MAVLink's number.
        system_id: of the sender.
        component_id: of the sender.
    """

    __slots__ = ("_crc_extra", "_message_id", "_pack", "_sender", "_sequence")

    def __init__(
        self,
        message_id: int,
        system_id: int = SIMULATOR_SYSTEM_ID,
        component_id: int = SIMULATOR_COMPONENT_ID,
    ) -> None:
        kind = mavlink.mavlink_map[message_id]
        self._sender = (system_id, component_id)
        self._message_id, self._crc_extra = message_id, kind.crc_extra
        self._pack = kind.unpacker.pack
        self._sequence = 0

    def pack(self, *fields: float) -> bytes:
        """A packet; the fields in their order on the wire, which MAVLink sorts by size."""
        payload = self._pack(*fields).rstrip(b"\0") or b"\0"
        self._sequence = (self._sequence + 1) & 0xFF
        low, high = self._message_id & 0xFFFF, self._message_id >> 16
        head = HEADER_V2.pack(MARKER_V2, len(payload), 0, 0, self._sequence, *self._sender, low, high)
        body = head + payload
        return body + _CHECKSUM.pack(checksum(body[1:], self._crc_extra))


@dataclass(frozen=True, slots=True)
class ActuatorControls:
    """HIL_ACTUATOR_CONTROLS: what PX4 commands.

    Attributes:
        time_us: PX4's clock, that of the sensors it answers.
        controls: of its outputs, shape (16,); of motors 0..1, all zero while disarmed.
        armed: whether PX4 is armed.
        lockstep: whether PX4's time waits for each HIL_SENSOR.
    """

    time_us: int
    controls: tuple[float, ...]
    armed: bool
    lockstep: bool


class ControlsReader:
    """Reads HIL_ACTUATOR_CONTROLS from PX4's stream; other messages are left out. Never raises.

    Attributes:
        is_of_px4: a heartbeat that says so has come; PX4 sends one as soon as it is connected.
        skipped_bytes: that were no part of a valid packet.
    """

    def __init__(self) -> None:
        kind = mavlink.mavlink_map[mavlink.MAVLINK_MSG_ID_HIL_ACTUATOR_CONTROLS]
        self._unpacker = kind.unpacker
        self._buffer = b""
        self.is_of_px4 = False
        self.skipped_bytes = 0

    def feed(self, data: bytes) -> Iterator[ActuatorControls]:
        """Take bytes; yields the messages that are now complete."""
        buffer = self._buffer + data
        position = 0
        while True:
            start = buffer.find(MARKER_V2, position)
            if start < 0:
                self.skipped_bytes += len(buffer) - position
                position = len(buffer)
                break
            self.skipped_bytes += start - position
            position = start
            if len(buffer) - start < HEADER_BYTES_V2:
                break
            _, length, flags, *_, low, high = HEADER_V2.unpack_from(buffer, start)
            end = start + HEADER_BYTES_V2 + length
            packet_end = end + CHECKSUM_BYTES + (SIGNATURE_BYTES if flags & SIGNED else 0)
            if len(buffer) < packet_end:
                break
            message_id = high << 16 | low
            seed = CRC_EXTRA.get(message_id)
            (sent,) = _CHECKSUM.unpack_from(buffer, end)
            if seed is None or checksum(buffer[start + 1 : end], seed) != sent:
                self.skipped_bytes += 1
                position = start + 1  # the next packet may begin in it
                continue
            if message_id == mavlink.MAVLINK_MSG_ID_HIL_ACTUATOR_CONTROLS:
                yield self._read(buffer[start + HEADER_BYTES_V2 : end])
            elif message_id == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                self.is_of_px4 |= buffer[start + HEADER_BYTES_V2 : end][_AUTOPILOT] == _PX4
            position = packet_end
        self._buffer = buffer[position:]

    def _read(self, payload: bytes) -> ActuatorControls:
        size = self._unpacker.size
        time_us, flags, *rest = self._unpacker.unpack(payload[:size].ljust(size, b"\0"))
        *controls, mode = rest
        return ActuatorControls(
            time_us, tuple(controls), bool(mode & ARMED_FLAG), bool(flags & LOCKSTEP_FLAG)
        )
