"""What a recording holds: its topics, and the JSON Schemas of their messages."""

from __future__ import annotations

import json

from framerunner.recording.foxglove_schemas import FOXGLOVE, TIME, VECTOR_3, Schema, schema_of

IMAGE = "/camera/image"
CALIBRATION = "/camera/calibration"
ANNOTATIONS = "/camera/annotations"
TRANSFORM = "/tf"
SCENE = "/scene"
LOG = "/log"
TELEMETRY = "/telemetry"
SETPOINT = "/setpoint"
DETECTIONS = "/detections"
MISSION = "/mission"
CROSSING = "/crossing"


def _said(kind: str, description: str) -> Schema:
    return {"type": kind, "description": description}


_FLIGHT_TIME = _said("number", "vehicle time since motors on, seconds; 0 before")
_BOX = {
    "n": _said("number", "upper edge of its box, pixels above the image's centre"),
    "s": _said("number", "lower edge, pixels above the centre"),
    "e": _said("number", "right edge, pixels right of the centre"),
    "w": _said("number", "left edge, pixels right of the centre"),
    "d": _said("number", "distance, metres; only of a frame wholly in view"),
    "a": _said("number", "angle between line of sight and the frame's normal, degrees; only as d"),
}
_DETECTION = schema_of(
    "framerunner.Detection",
    {"seen": _said("boolean", "whether any pixel of the colour was seen"), **_BOX},
    optional=tuple(_BOX),
)

_VALUE = schema_of(
    "framerunner.GuardValue",
    {
        "name": _said("string", "as the guard has it, such as frame.d"),
        "number": _said("number", "its value then; missing if it was infinite or none"),
        "flag": _said("boolean", "its value then, if it was true or false"),
        "text": _said("string", "its value then, if it was neither"),
    },
    optional=("number", "flag", "text"),
)

_OWN = (
    schema_of(
        "framerunner.Telemetry",
        {
            "timestamp": TIME,
            "flight_time_s": _FLIGHT_TIME,
            "position_arena_m": VECTOR_3,
            "velocity_arena_m_s": VECTOR_3,
            "yaw_rad": _said("number", "heading, counter-clockwise from the arena's x"),
            "armed": _said("boolean", "motors are on"),
            "offboard": _said("boolean", "the drone follows the app's setpoints"),
            "landed": _said("boolean", "it stands on something"),
            "mode": _said("string", "flight mode"),
        },
    ),
    schema_of(
        "framerunner.Setpoint",
        {
            "timestamp": TIME,
            "forward_m_s": _said("number", "in level axes turned with the yaw"),
            "left_m_s": _said("number", "in level axes turned with the yaw"),
            "up_m_s": _said("number", "upwards"),
            "yaw_rate_rad_s": _said("number", "to the left"),
        },
    ),
    schema_of(
        "framerunner.Detections",
        {
            "timestamp": TIME,
            "image_timestamp": TIME,
            "red": _DETECTION,
            "green": _DETECTION,
            "blue": _DETECTION,
        },
        optional=("image_timestamp",),
    ),
    schema_of(
        "framerunner.MissionState",
        {
            "timestamp": TIME,
            "flight_time_s": _FLIGHT_TIME,
            "state": _said("string", "entered, such as red.turning"),
            "previous": _said("string", "left; empty at the start"),
            "previous_s": _said("number", "time spent in it, seconds"),
            "when": _said("string", "the guard that held"),
            "values": {"type": "array", "items": _VALUE},
        },
        optional=("when", "values"),
    ),
    schema_of(
        "framerunner.Crossing",
        {
            "timestamp": TIME,
            "colour": _said("string", "of the frame"),
            "time_s": _said("number", "since motors on, as in result.json"),
            "offset_m": _said("number", "from the opening's centre, in its plane"),
            "side": _said("string", "front or back, the side the drone came from"),
        },
    ),
)

TOPICS = {
    TELEMETRY: "framerunner.Telemetry",
    SETPOINT: "framerunner.Setpoint",
    DETECTIONS: "framerunner.Detections",
    MISSION: "framerunner.MissionState",
    CROSSING: "framerunner.Crossing",
    IMAGE: "foxglove.CompressedImage",
    CALIBRATION: "foxglove.CameraCalibration",
    ANNOTATIONS: "foxglove.ImageAnnotations",
    TRANSFORM: "foxglove.FrameTransform",
    SCENE: "foxglove.SceneUpdate",
    LOG: "foxglove.Log",
}
"""Name of each topic's schema."""


def schemas() -> dict[str, bytes]:
    """All schemas as JSON, by name."""
    return {schema["title"]: json.dumps(schema).encode() for schema in (*_OWN, *FOXGLOVE)}
