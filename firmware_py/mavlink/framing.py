"""Packets: out of a stream of bytes that may hold anything, and onto several links at once."""

from __future__ import annotations

from struct import Struct

from firmware_py.mavlink.dialect import Message, mavlink

_MARKER_V1 = mavlink.PROTOCOL_MARKER_V1
_MARKER_V2 = mavlink.PROTOCOL_MARKER_V2
_MARKERS = (_MARKER_V1, _MARKER_V2)
_SIGNED = mavlink.MAVLINK_IFLAG_SIGNED
_SIGNATURE_LENGTH = 13
_CHECKSUM_LENGTH = 2
_HEADER = Struct("<BBBBBBBHB")


class PacketReader:
    """Takes bytes of one link and gives whole messages, MAVLink 1 and 2. Never raises, whatever the bytes.

    pymavlink's own loop throws away as many bytes as a broken header names, and with them good packets that
    follow; this one steps on by one byte, so noise costs nothing but itself.

    Attributes:
        skipped_bytes: how many bytes were no part of a message.
    """

    __slots__ = ("_buffer", "_decoder", "skipped_bytes")

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._decoder = mavlink.MAVLink(None)
        self.skipped_bytes = 0

    def feed(self, data: bytes) -> list[Message]:
        """Take bytes and give the messages that are now complete; the rest waits for more."""
        messages: list[Message] = []
        if self._buffer and self._decoded(data, 0) is not None:
            # This datagram begins with a whole packet, so what waits before it will never be completed.
            messages = self._scan(complete=True)
        self._buffer += data
        return messages + self._scan(complete=False)

    def _scan(self, *, complete: bool) -> list[Message]:
        """Take the messages out of the buffer; with `complete`, nothing is left to wait for more."""
        buffer = self._buffer
        messages: list[Message] = []
        place = 0
        while place < len(buffer):
            if buffer[place] in _MARKERS:
                length = self._length(buffer, place)
                if not complete and (length is None or place + length > len(buffer)):
                    break
                message = self._decoded(buffer, place)
                if message is not None and length is not None:
                    messages.append(message)
                    place += length
                    continue
            place += 1
            self.skipped_bytes += 1
        del buffer[:place]
        return messages

    @staticmethod
    def _length(data: bytes | bytearray, place: int) -> int | None:
        """Length of the packet whose header begins here; None when the header is not complete."""
        if len(data) - place < 3:
            return None
        payload_length, flags = data[place + 1], data[place + 2]
        if data[place] == _MARKER_V1:
            return int(mavlink.HEADER_LEN_V1) + payload_length + _CHECKSUM_LENGTH
        signature = _SIGNATURE_LENGTH if flags & _SIGNED else 0
        return int(mavlink.HEADER_LEN_V2) + payload_length + _CHECKSUM_LENGTH + signature

    def _decoded(self, data: bytes | bytearray, place: int) -> Message | None:
        """The message of the packet that begins here; None when there is no whole, sound packet."""
        if place >= len(data) or data[place] not in _MARKERS:
            return None
        length = self._length(data, place)
        if length is None or place + length > len(data):
            return None
        if data[place] == _MARKER_V2 and data[place + 2] & ~_SIGNED:
            return None  # a flag this version does not know: the packet must be dropped
        try:
            message = self._decoder.decode(bytearray(data[place : place + length]))
        except mavlink.MAVError:
            return None
        if isinstance(message, mavlink.MAVLink_unknown):
            # Its checksum cannot be tested; believe it only where another packet or nothing follows.
            after = place + length
            return message if after == len(data) or data[after] in _MARKERS else None
        return message


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
                _MARKER_V2, len(payload), 0, 0, 0, system_id, component_id, number & 0xFFFF, number >> 16
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
        packet[2] = _SIGNED if signed else 0
        packet[4] = sequence
        crc = mavlink.x25crc(bytes(packet[1:-_CHECKSUM_LENGTH]) + self._crc_extra).crc
        packet[-2] = crc & 0xFF
        packet[-1] = crc >> 8
        return bytes(packet)


def source_of(packet: bytes | bytearray) -> tuple[int, int]:
    """System id and component id of a whole packet's sender, also of one whose message is unknown."""
    return (packet[3], packet[4]) if packet[0] == _MARKER_V1 else (packet[5], packet[6])


def message_id_of(packet: bytes | bytearray) -> int:
    """Message id of a whole packet."""
    return packet[5] if packet[0] == _MARKER_V1 else int.from_bytes(packet[7:10], "little")
