"""Packets: out of a stream of bytes that may hold anything, and onto several links at once."""

from __future__ import annotations

from struct import Struct
from sys import maxsize

from wire.dialect import Message, mavlink
from wire.headers import (
    CHECKSUM_BYTES,
    CRC_EXTRA,
    HEADER_BYTES_V1,
    HEADER_BYTES_V2,
    MARKER_V1,
    MARKER_V2,
    MARKERS,
    SIGNED,
    packet_length,
    possible_starts,
)

_HEADER = Struct("<BBBBBBBHB")
_CAPACITY_BYTES = 1 << 16  # the largest datagram fits
_WINDOW_BYTES = 2048  # of noise, searched in one step
_MAX_TRIES = 64  # of headers found in it, in one step


class PacketReader:
    """Takes bytes of one link and gives whole messages, MAVLink 1 and 2. Never raises, whatever the bytes.

    pymavlink's own loop throws away as many bytes as a broken header names, and with them good packets that
    follow; this one loses nothing but the noise itself. Where no packet follows the last one, it searches for
    the header of a known message, and computes a checksum only there.

    Reading is done in steps, so that its caller can bound the work: a step is one message, or noise: at
    most 2048 bytes and 64 checksums.

    Attributes:
        behind: the last `read` used up its steps; more can be read without more bytes.
        skipped_bytes: how many bytes were no part of a message.
        dropped_bytes: how many bytes were not taken, because 64 KiB already waited to be read.
        overflows: how often some were not taken.
        checksums: how many were computed.
    """

    __slots__ = (
        "_aligned",
        "_boundary",
        "_buffer",
        "_decoder",
        "_place",
        "behind",
        "checksums",
        "dropped_bytes",
        "overflows",
        "skipped_bytes",
    )

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._place = 0  # what stands before it has been read
        self._aligned = True  # a packet ended, or bytes began to come, at this place
        self._boundary = 0  # the newest bytes begin there, with a whole packet
        self._decoder = mavlink.MAVLink(None)
        self.behind = False
        self.skipped_bytes = 0
        self.dropped_bytes = 0
        self.overflows = 0
        self.checksums = 0

    def feed(self, data: bytes) -> list[Message]:
        """Take bytes and give the messages that are now complete; the rest waits for more."""
        messages: list[Message] = []
        piece = _CAPACITY_BYTES // 2
        for first in range(0, len(data), piece):
            self.add(data[first : first + piece])
            messages += self.read()
        return messages

    def add(self, data: bytes) -> None:
        """Take bytes to be read later; those that find no room are lost, and counted."""
        buffer = self._buffer
        room = _CAPACITY_BYTES - len(buffer)
        if len(data) > room:
            self.dropped_bytes += len(data) - room
            self.overflows += 1
            data = data[:room]
        if not buffer:
            self._aligned = True
        elif self._is_sound(data, 0, packet_length(data, 0) or 0):
            # What waits before a whole packet will never be completed.
            self._boundary = len(buffer)
        buffer += data

    def read(self, most_steps: int = maxsize) -> list[Message]:
        """Give the next messages that are complete.

        Args:
            most_steps: after how many steps to stop.
        """
        messages: list[Message] = []
        steps = 0
        while steps < most_steps and self._step(messages):
            steps += 1
        self.behind = steps == most_steps
        del self._buffer[: self._place]
        self._boundary = max(0, self._boundary - self._place)
        self._place = 0
        return messages

    def _step(self, messages: list[Message]) -> bool:
        """Read one message or pass over some noise; False: nothing can be done before more bytes come."""
        buffer, place = self._buffer, self._place
        if place >= len(buffer):
            return False
        if self._aligned or place == self._boundary:
            length = self._try(place, messages)
            if length is None:
                return False
            if length:
                self._place += length
                self._aligned = True
                return True
            self._aligned = False
            place += 1
        end = min(place + _WINDOW_BYTES, len(buffer))
        window = buffer[place : end + HEADER_BYTES_V2 - 1]
        starts = [place + start for start in possible_starts(window)]
        if end + HEADER_BYTES_V2 > len(buffer):  # the last bytes may be the beginning of a header
            end = len(buffer)
            tail = range(max(place, end - HEADER_BYTES_V2 + 1), end)
            starts += [start for start in tail if buffer[start] in MARKERS]
        if len(starts) > _MAX_TRIES:
            end = starts[_MAX_TRIES]
        for start in starts[:_MAX_TRIES]:
            length = self._try(start, messages)
            if length != 0:
                self._pass_over(start)
                if length is None:
                    return False
                self._place += length
                self._aligned = True
                return True
        self._pass_over(end)
        return True

    def _pass_over(self, end: int) -> None:
        self.skipped_bytes += end - self._place
        self._place = end

    def _try(self, start: int, messages: list[Message]) -> int | None:
        """Add the message that begins at a place; its length, 0 if there is none, None if more must come."""
        buffer = self._buffer
        length = packet_length(buffer, start)
        if length == 0:
            return 0
        end = start + (length or HEADER_BYTES_V1)
        if start < self._boundary < end:
            return 0
        if length is None or end > len(buffer):
            return None
        if not self._is_sound(buffer, start, length) and not self._is_unknown(start, length):
            return 0
        try:
            messages.append(self._decoder.decode(buffer[start:end]))
        except mavlink.MAVError:
            return 0
        return length

    def _is_sound(self, data: bytes | bytearray, start: int, length: int) -> bool:
        """Whether a whole packet of a known message is there and has the right checksum."""
        if length == 0 or start + length > len(data):
            return False
        is_v1 = data[start] == MARKER_V1
        header = HEADER_BYTES_V1 if is_v1 else HEADER_BYTES_V2
        extra = CRC_EXTRA.get(_message_id(data, start))
        if extra is None:
            return False
        self.checksums += 1
        end = start + header + data[start + 1]
        crc = int(mavlink.x25crc(bytes(data[start + 1 : end]) + bytes((extra,))).crc)
        return data[end] == crc & 0xFF and data[end + 1] == crc >> 8

    def _is_unknown(self, start: int, length: int) -> bool:
        """Whether to believe a packet of an unknown message, whose checksum cannot be tested.

        It must stand right after another packet, with another packet or nothing after it and none within it.
        """
        buffer, after = self._buffer, start + length
        if not (self._aligned and start == self._place) or _message_id(buffer, start) in CRC_EXTRA:
            return False
        if after < len(buffer) and buffer[after] not in MARKERS:
            return False
        inside = buffer[start + 1 : after]
        starts = possible_starts(inside)[:_MAX_TRIES]
        return not any(self._is_sound(inside, each, packet_length(inside, each) or 0) for each in starts)


def _payload_only(_packer: Message, _crc_extra: int, payload: bytes, force_mavlink1: bool = False) -> bytes:
    """In place of a message's own framing: only its fields, as they are on the wire."""
    del force_mavlink1
    return payload


class Packet:
    """A message packed once, to be sent on several links with their own sequence numbers and signatures.

    Attributes:
        component_id: of its sender; each counts its own packets.
        length: bytes without a signature.
        is_heartbeat: the one message that a slow link never leaves out.
    """

    __slots__ = ("_crc_extra", "_template", "component_id", "is_heartbeat", "length")

    def __init__(self, message: Message, system_id: int, component_id: int) -> None:
        # pymavlink's own way makes two objects and two checksums more, of which none would be used.
        message._pack = _payload_only
        payload = message.pack(None).rstrip(b"\0") or b"\0"
        del message._pack
        number = message.get_msgId()
        self._template = bytearray(
            _HEADER.pack(
                MARKER_V2, len(payload), 0, 0, 0, system_id, component_id, number & 0xFFFF, number >> 16
            )
        )
        self._template += payload + b"\0\0"
        self._crc_extra = bytes((message.crc_extra,))
        self.component_id = component_id
        self.length = len(self._template)
        self.is_heartbeat = message.get_msgId() == mavlink.MAVLINK_MSG_ID_HEARTBEAT

    def numbered(self, sequence: int, *, signed: bool = False) -> bytes:
        """The packet with a sequence number, 0 to 255, and the checksum that goes with it.

        Args:
            sequence: 0 to 255.
            signed: set the flag for "signed"; the caller adds the signature.
        """
        packet = self._template
        packet[2] = SIGNED if signed else 0
        packet[4] = sequence
        crc = mavlink.x25crc(bytes(packet[1:-CHECKSUM_BYTES]) + self._crc_extra).crc
        packet[-2] = crc & 0xFF
        packet[-1] = crc >> 8
        return bytes(packet)


def source_of(packet: bytes | bytearray) -> tuple[int, int]:
    """System id and component id of a whole packet's sender, also of one whose message is unknown."""
    return (packet[3], packet[4]) if packet[0] == MARKER_V1 else (packet[5], packet[6])


def message_id_of(packet: bytes | bytearray) -> int:
    """Message id of a whole packet."""
    return _message_id(packet, 0)


def _message_id(data: bytes | bytearray, start: int) -> int:
    if data[start] == MARKER_V1:
        return data[start + 5]
    return int.from_bytes(data[start + 7 : start + 10], "little")
