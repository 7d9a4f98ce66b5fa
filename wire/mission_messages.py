"""What an app tells of its mission: the present state, what it sees, and documents about the whole."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from math import inf
from typing import Any

COMPONENT_ID = 191  # MAV_COMP_ID_ONBOARD_COMPUTER, within the vehicle's system
STATE_TYPE = 0x8F10  # payload types of MAVLink's TUNNEL; those from 0x8000 are nobody's
DETECTIONS_TYPE = 0x8F11
DOCUMENT_TYPE = 0x8F12
TEXT_PREFIX = "mission: "  # of the app's STATUSTEXTs

Box = tuple[float, float, float, float, float, float]  # n, s, e, w (pixels from the centre), d (m), a (deg)
UNSEEN: Box = (-inf, inf, -inf, inf, inf, inf)


@dataclass(frozen=True, slots=True)
class MissionState:
    """Where a mission is, ten times a second and at every change.

    Attributes:
        mission_crc: of the MISSION document in whose list of states `state_index` counts.
        state_index: of the present state; -1 before the first.
        transitions: how many were taken so far, modulo 65536.
        time_us: vehicle time, microseconds.
        entered_us: vehicle time at which the present state was entered.
        flying: the app commands the drone.
        paused: a pilot has the sticks; the mission waits.
        finished: it reached its end.
        command: forward, left, up (m/s) and yaw rate to the left (rad/s), as sent.
        pose_arena: x, y, z (m) and yaw (rad) in arena axes, as the app knows them.
    """

    mission_crc: int
    state_index: int
    transitions: int
    time_us: int
    entered_us: int
    flying: bool
    paused: bool
    finished: bool
    command: tuple[float, float, float, float]
    pose_arena: tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class MissionDetections:
    """What the app saw in one image.

    Attributes:
        time_us: vehicle time of the image, microseconds; None where the source does not tell.
        width_px: of the image.
        height_px: of the image.
        red: n, s, e, w, d, a as in `vision.types.Detection`.
        green: see red.
        blue: see red.
    """

    time_us: int | None
    width_px: int
    height_px: int
    red: Box = UNSEEN
    green: Box = UNSEEN
    blue: Box = UNSEEN


class DocumentKind(IntEnum):
    """What a document is about."""

    MISSION = 1
    HISTORY = 2
    RESULT = 3


@dataclass(frozen=True, slots=True)
class Document:
    """A JSON object sent in pieces.

    Attributes:
        kind: what it is about.
        crc: CRC-32 of its compressed bytes; names this version of it.
        content: the object.
    """

    kind: DocumentKind
    crc: int
    content: Mapping[str, Any]
