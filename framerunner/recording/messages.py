"""From what a flight shows of itself to the messages of its recording. Plain data in, plain data out."""

from __future__ import annotations

from base64 import b64encode
from math import cos, isfinite, sin
from typing import Any

from geometry.vectors import Vec3
from offboard.app import Moment
from offboard.drone import DroneState
from offboard.engine import TransitionTaken
from scenarios.models import COLOURS
from vision.types import Detection, Detections

Message = dict[str, Any]

ARENA = "arena"
DRONE = "drone"
CAMERA = "camera"
RGBA: dict[str, Message] = {
    "red": {"r": 1.0, "g": 0.0, "b": 0.0, "a": 1.0},
    "green": {"r": 0.0, "g": 0.8, "b": 0.0, "a": 1.0},
    "blue": {"r": 0.0, "g": 0.0, "b": 1.0, "a": 1.0},
}
_CLEAR = {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.0}
_LABEL = {"r": 1.0, "g": 1.0, "b": 1.0, "a": 1.0}
INFO = 2
_TEXT_CHARACTERS = 80  # of a guard's value that is no number


def time_of(time_us: int) -> Message:
    """Vehicle time as a message has it."""
    seconds, rest_us = divmod(time_us, 1_000_000)
    return {"sec": seconds, "nsec": rest_us * 1000}


def vector_of(vector: Vec3) -> Message:
    """A vector as a message has it."""
    return {"x": vector[0], "y": vector[1], "z": vector[2]}


def turn_of(yaw_rad: float) -> Message:
    """A turn about the vertical as a message has it."""
    return {"x": 0.0, "y": 0.0, "z": sin(yaw_rad / 2), "w": cos(yaw_rad / 2)}


def telemetry(moment: Moment) -> Message:
    """What the drone told at a tick."""
    state = moment.state
    return {
        "timestamp": time_of(state.time_us),
        "flight_time_s": moment.flight_time_s,
        "position_arena_m": vector_of((state.x, state.y, state.z)),
        "velocity_arena_m_s": vector_of(state.velocity_arena_m_s),
        "yaw_rad": state.yaw,
        "armed": state.armed,
        "offboard": state.offboard,
        "landed": state.landed,
        "mode": state.mode,
    }


def transform(state: DroneState) -> Message:
    """Where the drone is; telemetry tells no roll and pitch, so it is drawn level."""
    return {
        "timestamp": time_of(state.time_us),
        "parent_frame_id": ARENA,
        "child_frame_id": DRONE,
        "translation": vector_of((state.x, state.y, state.z)),
        "rotation": turn_of(state.yaw),
    }


def setpoint(moment: Moment) -> Message:
    """What the mission asked of the drone at a tick."""
    command = moment.command
    return {
        "timestamp": time_of(moment.state.time_us),
        "forward_m_s": command.forward_m_s,
        "left_m_s": command.left_m_s,
        "up_m_s": command.up_m_s,
        "yaw_rate_rad_s": command.yaw_rate_rad_s,
    }


def detections(seen: Detections, time_us: int) -> Message:
    """What the camera saw, as the mission was told.

    Args:
        seen: of one image.
        time_us: vehicle time of the first tick that had them, microseconds.
    """
    message: Message = {"timestamp": time_of(time_us)}
    if seen.time_us is not None:
        message["image_timestamp"] = time_of(seen.time_us)
    for colour in COLOURS:
        message[colour] = _detection(getattr(seen, colour))
    return message


def _detection(detection: Detection) -> Message:
    """Only what is known: JSON has neither infinity nor NaN."""
    message: Message = {"seen": detection.seen}
    for name in ("n", "s", "e", "w", "d", "a"):
        value: float = getattr(detection, name)
        if isfinite(value):
            message[name] = value
    return message


def boxes(seen: Detections, image_us: int, size_px: tuple[int, int]) -> Message:
    """Boxes around what was detected, to be drawn over the image.

    Args:
        seen: of one image.
        image_us: vehicle time of that image, microseconds.
        size_px: its width and height.
    """
    time = time_of(image_us)
    outlines, texts = [], []
    for colour in COLOURS:
        detection: Detection = getattr(seen, colour)
        if not detection.seen:
            continue
        left, top, right, bottom = box_edges(detection, size_px)
        corners = ((left, top), (right, top), (right, bottom), (left, bottom))
        outlines.append(
            {
                "timestamp": time,
                "type": 2,  # LINE_LOOP
                "points": [{"x": x, "y": y} for x, y in corners],
                "outline_color": _LABEL,
                "outline_colors": [],
                "fill_color": _CLEAR,
                "thickness": 1.0,
                "metadata": [],
            }
        )
        known = f" {detection.d:.2f} m" if isfinite(detection.d) else ""
        texts.append(
            {
                "timestamp": time,
                "position": {"x": left, "y": top},
                "text": f"{colour}{known}",
                "font_size": 10.0,
                "text_color": _LABEL,
                "background_color": {**RGBA[colour], "a": 0.6},
                "metadata": [],
            }
        )
    return {"circles": [], "points": outlines, "texts": texts}


def box_edges(detection: Detection, size_px: tuple[int, int]) -> tuple[float, float, float, float]:
    """Left, top, right and bottom edge of a box, pixels from the image's top left corner.

    The paper counts rows and columns from 1, so n = height / 2 - row and e = column - (width / 2 + 1); see
    `vision.detector.measure`. The edges are those of the outer pixels, not their centres.
    """
    width, height = size_px
    left, right = detection.w + width / 2, detection.e + width / 2 + 1
    return (left, height / 2 - detection.n - 1, right, height / 2 - detection.s)


def image(data: bytes, kind: str, time_us: int) -> Message:
    """An image.

    Args:
        data: compressed.
        kind: "png" or "jpeg".
        time_us: vehicle time of its exposure, microseconds.
    """
    return {
        "timestamp": time_of(time_us),
        "frame_id": CAMERA,
        "data": b64encode(data).decode("ascii"),
        "format": kind,
    }


def mission_state(moment: Moment, previous: str, previous_s: float) -> Message:
    """The mission has entered another state.

    Args:
        moment: its first tick in the new state.
        previous: the state before; empty at the start.
        previous_s: time spent in that, seconds.
    """
    return {
        "timestamp": time_of(moment.state.time_us),
        "flight_time_s": moment.flight_time_s,
        "state": moment.mission_state,
        "previous": previous,
        "previous_s": previous_s,
        **_guard(moment.transition),
    }


def _guard(taken: TransitionTaken | None) -> Message:
    """Why the mission went on; nothing where that is not known."""
    if taken is None:
        return {}
    return {"when": taken.when, "values": [_value(name, value) for name, value in taken.values]}


def _value(name: str, value: object) -> Message:
    """A value of a guard; a contestant's pilot may hold anything."""
    try:
        if isinstance(value, bool):
            return {"name": name, "flag": value}
        if isinstance(value, str) or not hasattr(value, "__float__"):
            return {"name": name, "text": str(value)[:_TEXT_CHARACTERS]}
        number = float(value)
    except Exception:  # whatever a contestant's conversion raises
        return {"name": name, "text": type(value).__name__}
    return {"name": name, "number": number} if isfinite(number) else {"name": name}


def crossing(time_us: int, colour: str, time_s: float, offset_m: float, side: str) -> Message:
    """A frame was crossed; see `scenarios.crossing.Passage`."""
    return {
        "timestamp": time_of(time_us),
        "colour": colour,
        "time_s": time_s,
        "offset_m": offset_m,
        "side": side,
    }


def log(time_us: int, name: str, text: str) -> Message:
    """A line of text."""
    return {
        "timestamp": time_of(time_us),
        "level": INFO,
        "message": text,
        "name": name,
        "file": "",
        "line": 0,
    }
