"""How an app reports its mission over MAVLink: TUNNEL payloads with state, detections and documents.

Numbers are little-endian. A document is compressed JSON, sent in pieces. The functions take a payload cut to
its `payload_length`.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from math import inf
from typing import Any

from framerunner.wire.finite_json import finite

COMPONENT_ID = 191  # MAV_COMP_ID_ONBOARD_COMPUTER, within the vehicle's system
STATE_TYPE = 0x8F10  # payload types of TUNNEL; those from 0x8000 are for private use
DETECTIONS_TYPE = 0x8F11
DOCUMENT_TYPE = 0x8F12
TEXT_PREFIX = "mission: "  # of the app's STATUSTEXTs
VERSION = 1
PIECE_BYTES = 118  # of a document, in one payload of at most 128
MAX_PIECES = 255
MAX_DOCUMENT_BYTES = 1_000_000  # uncompressed

_STATE = struct.Struct("<BBIhHQQ8f")
_DETECTIONS = struct.Struct("<BHHq18f")
_PIECE = struct.Struct("<BBIBB")
_FLYING, _PAUSED, _FINISHED = 1, 2, 4
_NO_TIME = -1

Box = tuple[float, float, float, float, float, float]  # n, s, e, w (pixels from the centre), d (m), a (deg)
UNSEEN: Box = (-inf, inf, -inf, inf, inf, inf)


class PayloadError(ValueError):
    """A payload that cannot be read, or values that do not fit into one; the message is one line."""


@dataclass(frozen=True, slots=True)
class MissionState:
    """The state of a mission, sent ten times a second and at every change."""

    mission_crc: int  # of the MISSION document with the list of states
    state_index: int  # of the present state in that list; -1 before the first
    transitions: int  # number of transitions so far, modulo 65536
    time_us: int  # vehicle time
    entered_us: int  # vehicle time at which the present state was entered
    flying: bool  # the app commands the drone
    paused: bool  # an operator has the sticks; the mission waits
    finished: bool  # the mission has ended
    command: tuple[
        float, float, float, float
    ]  # forward, left, up (m/s), yaw rate to the left (rad/s), as sent
    pose_arena: tuple[float, float, float, float]  # x, y, z (m), yaw (rad) in arena axes, as estimated


@dataclass(frozen=True, slots=True)
class MissionDetections:
    """What the app detected in one image: a box of each colour, as in `vision.types.Detection`."""

    time_us: int | None  # vehicle time of the image; None where its source has none
    width_px: int  # of the image
    height_px: int
    red: Box = UNSEEN
    green: Box = UNSEEN
    blue: Box = UNSEEN


class DocumentKind(IntEnum):
    """What a document is about."""

    MISSION = 1
    HISTORY = 2
    RESULT = 3
    MAP = 4
    GUARDS = 5


@dataclass(frozen=True, slots=True)
class TunnelDocument:
    """A JSON object sent in pieces; `crc`, the CRC-32 of its compressed bytes, identifies its version."""

    kind: DocumentKind
    crc: int
    content: Mapping[str, Any]


def encode_state(state: MissionState) -> bytes:
    """The 58 bytes of a state.

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
    """The 85 bytes of one image's detections.

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
    """Read one image's detections; numbers may be infinite or NaN.

    Raises:
        PayloadError: wrong length or version.
    """
    _check(payload, _DETECTIONS.size, _DETECTIONS.size, "detections")
    _, width, height, time_us, *numbers = _DETECTIONS.unpack(payload)
    return MissionDetections(
        None if time_us < 0 else time_us,
        width,
        height,
        red=_box(numbers[0:6]),
        green=_box(numbers[6:12]),
        blue=_box(numbers[12:18]),
    )


def split_document(kind: DocumentKind, content: Mapping[str, Any]) -> tuple[int, list[bytes]]:
    """Compress a JSON object and cut it into pieces; numbers that are not finite become null.

    Returns:
        CRC-32 that identifies this version of the document, and its payloads.

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
        raise PayloadError(f"{what}: {len(plain)} bytes; the limit is {MAX_DOCUMENT_BYTES}")
    packed = zlib.compress(plain, 9)
    parts = [packed[start : start + PIECE_BYTES] for start in range(0, len(packed), PIECE_BYTES)]
    if len(parts) > MAX_PIECES:
        raise PayloadError(f"{what}: {len(parts)} pieces; the limit is {MAX_PIECES}")
    crc = zlib.crc32(packed)
    heads = (_PIECE.pack(VERSION, kind, crc, index, len(parts)) for index in range(len(parts)))
    return crc, [head + part for head, part in zip(heads, parts, strict=True)]


@dataclass(slots=True)
class _IncompleteDocument:
    """A document of which pieces are missing."""

    crc: int
    count: int
    parts: dict[int, bytes] = field(default_factory=dict)


class DocumentAssembler:
    """Joins the pieces of one vehicle's documents, received in any order.

    It keeps at most one incomplete document of each kind, some 30 kB each.
    """

    def __init__(self) -> None:
        self._incomplete: dict[DocumentKind, _IncompleteDocument] = {}
        self._complete: dict[DocumentKind, int] = {}  # CRC of the latest

    def take(self, payload: bytes) -> TunnelDocument | None:
        """Take a piece.

        Returns:
            The document if this was its last missing piece. A repeated document is returned again only after
            another of its kind.

        Raises:
            PayloadError: this piece, or the document that it completes, is invalid; it is dropped.
        """
        _check(payload, _PIECE.size + 1, _PIECE.size + PIECE_BYTES, "piece of a document")
        _, number, crc, index, count = _PIECE.unpack_from(payload)
        try:
            kind = DocumentKind(number)
        except ValueError:
            raise PayloadError(f"piece of a document: kind {number} is not known") from None
        if index >= count:
            raise PayloadError(f"piece of a document: index {index} of {count}")
        if self._complete.get(kind) == crc:
            return None
        incomplete = self._incomplete.get(kind)
        if incomplete is None or incomplete.crc != crc or incomplete.count != count:
            incomplete = self._incomplete[kind] = _IncompleteDocument(crc, count)
        incomplete.parts[index] = payload[_PIECE.size :]
        if len(incomplete.parts) < count:
            return None
        del self._incomplete[kind]
        what = f"{kind.name.lower()} document"
        packed = b"".join(incomplete.parts[number] for number in range(count))
        if zlib.crc32(packed) != crc:
            raise PayloadError(f"{what}: its CRC is wrong; some piece was damaged")
        self._complete[kind] = crc  # also if it cannot be read: a repetition would not be better
        return TunnelDocument(kind, crc, _unpack(packed, what))


def _check(payload: bytes, min_bytes: int, max_bytes: int, what: str) -> None:
    """Refuse another version first: its length may be different too."""
    if payload and payload[0] != VERSION:
        raise PayloadError(
            f"{what}: version {payload[0]}; this program reads {VERSION}, update the older one"
        )
    if not min_bytes <= len(payload) <= max_bytes:
        expected = f"{min_bytes}" if min_bytes == max_bytes else f"{min_bytes} to {max_bytes}"
        raise PayloadError(f"{what}: {len(payload)} bytes; {expected} expected")


def _box(numbers: list[float]) -> Box:
    n, s, e, w, d, a = numbers
    return (n, s, e, w, d, a)


def _unpack(packed: bytes, what: str) -> dict[str, Any]:
    """Decompress, up to `MAX_DOCUMENT_BYTES`, and read."""
    decompressor = zlib.decompressobj()
    try:
        plain = decompressor.decompress(packed, MAX_DOCUMENT_BYTES + 1)
    except zlib.error:
        raise PayloadError(f"{what}: cannot be decompressed") from None
    if len(plain) > MAX_DOCUMENT_BYTES:
        raise PayloadError(f"{what}: more than {MAX_DOCUMENT_BYTES} bytes")
    if not decompressor.eof or decompressor.unused_data:
        raise PayloadError(f"{what}: cannot be decompressed")
    try:
        content = json.loads(plain.decode("utf-8"))
        # What JSON or UTF-8 do not allow (1e999, half a surrogate pair) must not be passed on.
        json.dumps(content, ensure_ascii=False, allow_nan=False).encode("utf-8")
    except (ValueError, RecursionError):
        raise PayloadError(f"{what}: is no JSON") from None
    if not isinstance(content, dict):
        raise PayloadError(f"{what}: is no JSON object")
    return content
