"""The bytes of what an app tells of its mission: payloads of MAVLink's TUNNEL, little-endian."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Mapping
from typing import Any

from wire.finite_json import finite
from wire.mission_messages import Box, Document, DocumentKind, MissionDetections, MissionState

VERSION = 1
PIECE_BYTES = 118  # of a document, in one payload of at most 128
MAX_PIECES = 255
MAX_DOCUMENT_BYTES = 1_000_000  # uncompressed

_STATE = struct.Struct("<BBIhHQQ8f")
_DETECTIONS = struct.Struct("<BHHq18f")
_PIECE = struct.Struct("<BBIBB")
_FLYING, _PAUSED, _FINISHED = 1, 2, 4
_NO_TIME = -1


class PayloadError(ValueError):
    """Bytes that say nothing, or something that cannot be said in bytes; the message is one line."""


def encode_state(state: MissionState) -> bytes:
    """Return the 58 bytes of a state.

    Raises:
        PayloadError: a value does not fit its field.
    """
    flags = _FLYING * state.flying | _PAUSED * state.paused | _FINISHED * state.finished
    try:
        return _STATE.pack(
            VERSION,
            flags,
            state.mission_crc,
            state.state_index,
            state.transitions & 0xFFFF,
            state.time_us,
            state.entered_us,
            *state.command,
            *state.pose_arena,
        )
    except (struct.error, OverflowError) as error:
        raise PayloadError(f"state: a value does not fit its field: {error}") from None


def decode_state(payload: bytes) -> MissionState:
    """Read a state; numbers may be infinite or NaN.

    Args:
        payload: the TUNNEL's payload, cut to its `payload_length`.

    Raises:
        PayloadError: wrong length or version.
    """
    _check(payload, _STATE.size, _STATE.size, "state")
    _, flags, crc, index, transitions, time_us, entered_us, *numbers = _STATE.unpack(payload)
    forward, left, up, yaw_rate, x, y, z, yaw = numbers
    return MissionState(
        mission_crc=crc,
        state_index=index,
        transitions=transitions,
        time_us=time_us,
        entered_us=entered_us,
        flying=bool(flags & _FLYING),
        paused=bool(flags & _PAUSED),
        finished=bool(flags & _FINISHED),
        command=(forward, left, up, yaw_rate),
        pose_arena=(x, y, z, yaw),
    )


def encode_detections(detections: MissionDetections) -> bytes:
    """Return the 85 bytes of what one image showed.

    Raises:
        PayloadError: a value does not fit its field.
    """
    time_us = _NO_TIME if detections.time_us is None else detections.time_us
    width, height = detections.width_px, detections.height_px
    try:
        return _DETECTIONS.pack(
            VERSION, width, height, time_us, *detections.red, *detections.green, *detections.blue
        )
    except (struct.error, OverflowError) as error:
        raise PayloadError(f"detections: a value does not fit its field: {error}") from None


def decode_detections(payload: bytes) -> MissionDetections:
    """Read what one image showed; numbers may be infinite or NaN.

    Args:
        payload: the TUNNEL's payload, cut to its `payload_length`.

    Raises:
        PayloadError: wrong length or version.
    """
    _check(payload, _DETECTIONS.size, _DETECTIONS.size, "detections")
    _, width, height, time_us, *numbers = _DETECTIONS.unpack(payload)
    return MissionDetections(
        time_us=None if time_us < 0 else time_us,
        width_px=width,
        height_px=height,
        red=_box(numbers[0:6]),
        green=_box(numbers[6:12]),
        blue=_box(numbers[12:18]),
    )


def split_document(kind: DocumentKind, content: Mapping[str, Any]) -> tuple[int, list[bytes]]:
    """Compress a JSON object and cut it; numbers that are not finite become null.

    Returns:
        CRC-32 that names this version of the document, and its payloads.

    Raises:
        PayloadError: it is no JSON, or too large.
    """
    what = f"{kind.name.lower()} document"
    try:
        text = json.dumps(finite(content), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    except (TypeError, ValueError, RecursionError) as error:
        raise PayloadError(f"{what}: cannot be written as JSON: {error}") from None
    plain = text.encode("utf-8", "replace")  # half a surrogate pair becomes "?"
    if len(plain) > MAX_DOCUMENT_BYTES:
        raise PayloadError(f"{what}: {len(plain)} bytes; at most {MAX_DOCUMENT_BYTES} can be told")
    packed = zlib.compress(plain, 9)
    parts = [packed[start : start + PIECE_BYTES] for start in range(0, len(packed), PIECE_BYTES)]
    if len(parts) > MAX_PIECES:
        raise PayloadError(f"{what}: {len(parts)} pieces; at most {MAX_PIECES} can be told")
    crc = zlib.crc32(packed)
    heads = (_PIECE.pack(VERSION, kind, crc, index, len(parts)) for index in range(len(parts)))
    return crc, [head + part for head, part in zip(heads, parts, strict=True)]


class DocumentAssembler:
    """Joins the pieces of one vehicle's documents, however they are mixed.

    It holds at most one unfinished document of each kind: some 30 kB each.
    """

    def __init__(self) -> None:
        """Wait for the first piece."""
        self._unfinished: dict[DocumentKind, _Unfinished] = {}
        self._done: dict[DocumentKind, int] = {}

    def take(self, payload: bytes) -> Document | None:
        """Take a piece.

        Args:
            payload: the TUNNEL's payload, cut to its `payload_length`.

        Returns:
            The document if this was its last missing piece. One that is merely repeated is not returned
            again until another of its kind came between.

        Raises:
            PayloadError: this piece, or what it completes, makes no sense; it is forgotten.
        """
        _check(payload, _PIECE.size + 1, _PIECE.size + PIECE_BYTES, "piece of a document")
        _, number, crc, index, count = _PIECE.unpack_from(payload)
        try:
            kind = DocumentKind(number)
        except ValueError:
            raise PayloadError(f"piece of a document: kind {number} is not known") from None
        if index >= count:
            raise PayloadError(f"piece of a document: index {index} of {count}")
        if self._done.get(kind) == crc:
            return None
        unfinished = self._unfinished.get(kind)
        if unfinished is None or unfinished.crc != crc or unfinished.count != count:
            unfinished = self._unfinished[kind] = _Unfinished(crc, count)
        unfinished.parts[index] = payload[_PIECE.size :]
        if len(unfinished.parts) < count:
            return None
        del self._unfinished[kind]
        what = f"{kind.name.lower()} document"
        packed = b"".join(unfinished.parts[number] for number in range(count))
        if zlib.crc32(packed) != crc:
            raise PayloadError(f"{what}: its CRC is wrong; some piece was damaged")
        self._done[kind] = crc  # also if it cannot be read: it will be no better the next time
        return Document(kind, crc, _unpack(packed, what))


class _Unfinished:
    """A document of which pieces are missing."""

    __slots__ = ("count", "crc", "parts")

    def __init__(self, crc: int, count: int) -> None:
        self.crc = crc
        self.count = count
        self.parts: dict[int, bytes] = {}


def _check(payload: bytes, least: int, most: int, what: str) -> None:
    """Refuse another version first: its length may well be another."""
    if payload and payload[0] != VERSION:
        raise PayloadError(
            f"{what}: version {payload[0]}; this program knows {VERSION}, update the older one"
        )
    if not least <= len(payload) <= most:
        wanted = f"{least}" if least == most else f"{least} to {most}"
        raise PayloadError(f"{what}: {len(payload)} bytes; {wanted} expected")


def _box(numbers: list[float]) -> Box:
    n, s, e, w, d, a = numbers
    return (n, s, e, w, d, a)


def _unpack(packed: bytes, what: str) -> dict[str, Any]:
    """Decompress with a bound, and read."""
    inflate = zlib.decompressobj()
    try:
        plain = inflate.decompress(packed, MAX_DOCUMENT_BYTES + 1)
    except zlib.error:
        raise PayloadError(f"{what}: cannot be decompressed") from None
    if len(plain) > MAX_DOCUMENT_BYTES:
        raise PayloadError(f"{what}: more than {MAX_DOCUMENT_BYTES} bytes")
    if not inflate.eof or inflate.unused_data:
        raise PayloadError(f"{what}: cannot be decompressed")
    try:
        content = json.loads(plain.decode("utf-8"))
        # What JSON or UTF-8 do not have (1e999, half a surrogate pair) must not reach whoever writes it on.
        json.dumps(content, ensure_ascii=False, allow_nan=False).encode("utf-8")
    except (ValueError, RecursionError):
        raise PayloadError(f"{what}: is no JSON") from None
    if not isinstance(content, dict):
        raise PayloadError(f"{what}: is no JSON object")
    return content
