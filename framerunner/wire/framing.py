"""Packets of MAVLink 1 and 2: read from any stream of bytes, and packed once for several links.

The header fields are those of https://mavlink.io/en/guide/serialization.html.
"""

from __future__ import annotations

import binascii
from struct import Struct
from sys import maxsize

import numpy as np

from framerunner.wire.dialect import Message, mavlink

MARKER_V1 = int(mavlink.PROTOCOL_MARKER_V1)
MARKER_V2 = int(mavlink.PROTOCOL_MARKER_V2)
MARKERS = (MARKER_V1, MARKER_V2)
SIGNED = int(mavlink.MAVLINK_IFLAG_SIGNED)
SIGNATURE_BYTES = 13  # link id 1, timestamp 6, hash 6
CHECKSUM_BYTES = 2
HEADER_BYTES_V1 = int(mavlink.HEADER_LEN_V1)
HEADER_BYTES_V2 = int(mavlink.HEADER_LEN_V2)
CRC_EXTRA: dict[int, int] = {number: kind.crc_extra for number, kind in mavlink.mavlink_map.items()}

_ID_COUNT_V1 = 256
_PAYLOAD_BYTES_V1 = {n: kind.unpacker.size for n, kind in mavlink.mavlink_map.items() if n < _ID_COUNT_V1}
_KNOWN_IDS = np.zeros(1 << 16, dtype=np.bool_)  # all of the dialect's are below 2^16
_KNOWN_IDS[list(CRC_EXTRA)] = True
_MAX_PAYLOAD_BYTES_V1 = np.full(_ID_COUNT_V1, -1)  # by message id; -1: unknown
_MAX_PAYLOAD_BYTES_V1[list(_PAYLOAD_BYTES_V1)] = list(_PAYLOAD_BYTES_V1.values())

HEADER_V2 = Struct("<BBBBBBBHB")
_REVERSED = bytes(int(f"{value:08b}"[::-1], 2) for value in range(256))
_CAPACITY_BYTES = 1 << 16  # the largest datagram fits
_WINDOW_BYTES = 2048  # of noise, searched in one step
_MAX_TRIES = 64  # of headers found in it, in one step


def checksum(data: bytes | bytearray, seed: int) -> int:
    """MAVLink's checksum of a packet without its marker: CRC-16/MCRF4XX over the data and the seed.

    It is the CRC that `binascii.crc_hqx` computes, with the bits of each byte and of the result reversed.
    """
    crc = binascii.crc_hqx(data.translate(_REVERSED) + _REVERSED[seed : seed + 1], 0xFFFF)
    return _REVERSED[crc & 0xFF] << 8 | _REVERSED[crc >> 8]


def packet_length(data: bytes | bytearray, start: int) -> int | None:
    """Length in bytes of the packet whose header begins at `start`.

    Returns:
        None while the header is not complete; 0 if no packet can begin so.
    """
    available = len(data) - start
    if available < 3:
        return None
    if data[start] == MARKER_V1:
        known = available >= HEADER_BYTES_V1 and _PAYLOAD_BYTES_V1.get(data[start + 5])
        if known and data[start + 1] > known:
            return 0
        return HEADER_BYTES_V1 + data[start + 1] + CHECKSUM_BYTES
    flags = data[start + 2]
    if data[start] != MARKER_V2 or flags & ~SIGNED:
        return 0  # the packet has an unknown flag and must be dropped
    signature = SIGNATURE_BYTES if flags else 0
    return HEADER_BYTES_V2 + data[start + 1] + CHECKSUM_BYTES + signature


def possible_starts(window: bytes | bytearray) -> list[int]:
    """Where headers of known messages may begin; the last `HEADER_BYTES_V2` - 1 bytes are not searched."""
    count = len(window) - HEADER_BYTES_V2 + 1
    if count <= 0:
        return []
    data = np.frombuffer(bytes(window), dtype=np.uint8)
    first = data[:count]
    starts_v1 = np.flatnonzero(first == MARKER_V1)
    if starts_v1.size:
        starts_v1 = starts_v1[data[starts_v1 + 1] <= _MAX_PAYLOAD_BYTES_V1[data[starts_v1 + 5]]]
    starts_v2 = np.flatnonzero((first == MARKER_V2) & (data[2 : count + 2] <= SIGNED))
    if starts_v2.size:
        low = data[starts_v2 + 7] | data[starts_v2 + 8].astype(np.uint16) << 8
        starts_v2 = starts_v2[(data[starts_v2 + 9] == 0) & _KNOWN_IDS[low]]
    return sorted([*starts_v1.tolist(), *starts_v2.tolist()])


class PacketReader:
    """Reads whole messages from the bytes of one link, MAVLink 1 and 2. Never raises, whatever the bytes.

    pymavlink's own loop drops as many bytes as a broken header states, and with them valid packets that
    follow; this one drops only the noise itself. Where no packet follows the last one, it searches for
    the header of a known message, and computes a checksum only there.

    Reading is done in steps, so that its caller can bound the work: a step is one message, or noise: at
    most 2048 bytes and 64 checksums.

    Attributes:
        behind: the last `read` used up its steps; more can be read without more bytes.
        skipped_bytes: number of bytes that were no part of a message.
        overflows: how often bytes were dropped, because 64 KiB already waited to be read.
        checksums: number of checksums computed.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._position = 0  # all before it has been read
        self._aligned = True  # a packet ended, or the stream began, at this position
        self._boundary = 0  # the newest bytes begin there, with a whole packet
        self._decoder = mavlink.MAVLink(None)
        self.behind = False
        self.skipped_bytes = 0
        self.overflows = 0
        self.checksums = 0

    def feed(self, data: bytes) -> list[Message]:
        """Take bytes and return the messages that are now complete; the rest waits for more."""
        messages: list[Message] = []
        piece = _CAPACITY_BYTES // 2
        for first in range(0, len(data), piece):
            self.add(data[first : first + piece])
            messages += self.read()
        return messages

    def add(self, data: bytes) -> int:
        """Take bytes to be read later; the number of bytes dropped, because 64 KiB already waited."""
        buffer = self._buffer
        dropped_bytes = max(0, len(data) - (_CAPACITY_BYTES - len(buffer)))
        if dropped_bytes:
            self.overflows += 1
            data = data[:-dropped_bytes]
        if not buffer:
            self._aligned = True
        elif self._is_sound(data, 0, packet_length(data, 0) or 0):
            # An incomplete packet before a whole one will never be completed.
            self._boundary = len(buffer)
        buffer += data
        return dropped_bytes

    def read(self, max_steps: int = maxsize) -> list[Message]:
        """Return the next messages that are complete, after some steps at most."""
        messages: list[Message] = []
        steps = 0
        while steps < max_steps and self._step(messages):
            steps += 1
        self.behind = steps == max_steps
        del self._buffer[: self._position]
        self._boundary = max(0, self._boundary - self._position)
        self._position = 0
        return messages

    def _step(self, messages: list[Message]) -> bool:
        """Read one message or skip some noise; False: nothing can be done without more bytes."""
        buffer, position = self._buffer, self._position
        if position >= len(buffer):
            return False
        if self._aligned or position == self._boundary:
            length = self._try(position, messages)
            if length is None:
                return False
            if length:
                self._position += length
                self._aligned = True
                return True
            self._aligned = False
            position += 1
        end = min(position + _WINDOW_BYTES, len(buffer))
        window = buffer[position : end + HEADER_BYTES_V2 - 1]
        starts = [position + start for start in possible_starts(window)]
        if end + HEADER_BYTES_V2 > len(buffer):  # the last bytes may be the beginning of a header
            end = len(buffer)
            tail = range(max(position, end - HEADER_BYTES_V2 + 1), end)
            starts += [start for start in tail if buffer[start] in MARKERS]
        if len(starts) > _MAX_TRIES:
            end = starts[_MAX_TRIES]
        for start in starts[:_MAX_TRIES]:
            length = self._try(start, messages)
            if length != 0:
                self._skip_to(start)
                if length is None:
                    return False
                self._position += length
                self._aligned = True
                return True
        self._skip_to(end)
        return True

    def _skip_to(self, end: int) -> None:
        self.skipped_bytes += end - self._position
        self._position = end

    def _try(self, start: int, messages: list[Message]) -> int | None:
        """Append the message at a position; its length, 0 if there is none, None if more bytes are needed."""
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
        """Whether a whole packet of a known message begins there, with the right checksum."""
        if length == 0 or start + length > len(data):
            return False
        is_v1 = data[start] == MARKER_V1
        header = HEADER_BYTES_V1 if is_v1 else HEADER_BYTES_V2
        extra = CRC_EXTRA.get(message_id_of(data, start))
        if extra is None:
            return False
        self.checksums += 1
        end = start + header + data[start + 1]
        return int.from_bytes(data[end : end + CHECKSUM_BYTES], "little") == checksum(
            data[start + 1 : end], extra
        )

    def _is_unknown(self, start: int, length: int) -> bool:
        """Whether to accept a packet of an unknown message, whose checksum cannot be tested.

        It must follow another packet directly, with another packet or nothing after it and none within it.
        """
        buffer, after = self._buffer, start + length
        if not (self._aligned and start == self._position) or message_id_of(buffer, start) in CRC_EXTRA:
            return False
        if after < len(buffer) and buffer[after] not in MARKERS:
            return False
        inside = buffer[start + 1 : after]
        starts = possible_starts(inside)[:_MAX_TRIES]
        return not any(self._is_sound(inside, each, packet_length(inside, each) or 0) for each in starts)


def _payload_only(_packer: Message, _crc_extra: int, payload: bytes, force_mavlink1: bool = False) -> bytes:
    """Replaces a message's own framing: only its fields, as they are on the wire."""
    del force_mavlink1
    return payload


class Packet:
    """A message packed once, to be sent on several links with their own sequence numbers and signatures.

    Attributes:
        component_id: of its sender; each counts its own packets.
        length: bytes without a signature.
        is_heartbeat: the one message that is never left out on a slow link.
    """

    __slots__ = ("_crc_extra", "_template", "component_id", "is_heartbeat", "length")

    def __init__(self, message: Message, system_id: int, component_id: int) -> None:
        # pymavlink's own packing makes two more objects and two more checksums, which are not needed.
        message._pack = _payload_only
        payload = message.pack(None).rstrip(b"\0") or b"\0"
        del message._pack
        number = message.get_msgId()
        self._template = bytearray(
            HEADER_V2.pack(
                MARKER_V2, len(payload), 0, 0, 0, system_id, component_id, number & 0xFFFF, number >> 16
            )
        )
        self._template += payload + b"\0\0"
        self._crc_extra = message.crc_extra
        self.component_id = component_id
        self.length = len(self._template)
        self.is_heartbeat = message.get_msgId() == mavlink.MAVLINK_MSG_ID_HEARTBEAT

    def numbered(self, sequence: int, *, signed: bool = False) -> bytes:
        """The packet with a sequence number, 0 to 255; if `signed`, the caller appends the signature."""
        packet = self._template
        packet[2] = SIGNED if signed else 0
        packet[4] = sequence
        crc = checksum(packet[1:-CHECKSUM_BYTES], self._crc_extra)
        packet[-CHECKSUM_BYTES:] = crc.to_bytes(CHECKSUM_BYTES, "little")
        return bytes(packet)


def packed(message: Message, sender: mavlink.MAVLink) -> bytes:
    """A message as the next packet of a sender, which counts its packets."""
    data: bytes = message.pack(sender)
    sender.seq = (sender.seq + 1) % 256
    return data


def source_of(packet: bytes | bytearray) -> tuple[int, int]:
    """System id and component id of a whole packet's sender; the message may be unknown."""
    return (packet[3], packet[4]) if packet[0] == MARKER_V1 else (packet[5], packet[6])


def message_id_of(data: bytes | bytearray, start: int = 0) -> int:
    """Message id of a packet that begins at `start`."""
    if data[start] == MARKER_V1:
        return data[start + 5]
    return int.from_bytes(data[start + 7 : start + 10], "little")


class SequenceCounter:
    """Packets of one sender, counted against their numbers.

    Args:
        max_missing: a number that is farther ahead is that of a late or doubled packet.

    Attributes:
        received: packets.
        missing: packets that were sent meanwhile; one that is late is missing no longer.
    """

    __slots__ = ("_last", "_max_missing", "missing", "received")

    def __init__(self, max_missing: int = 127) -> None:
        self._max_missing = max_missing
        self._last: int | None = None
        self.received = self.missing = 0

    def take(self, sequence: int) -> int:
        """Count a packet by its number, 0 to 255; how many are missing before it, or -1: it is late."""
        self.received += 1
        missing = 0 if self._last is None else (sequence - self._last - 1) % 256
        if missing > self._max_missing:
            missing = -1
        else:
            self._last = sequence
        self.missing += missing
        return missing

    @property
    def sent(self) -> int:
        """Packets that were sent, by their numbers."""
        return self.received + self.missing

    @property
    def lost_share(self) -> float:
        """Of the packets sent, 0 to 1."""
        return max(0.0, self.missing / self.sent) if self.sent > 0 else 0.0
