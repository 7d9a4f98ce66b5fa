"""What a recording holds: its topics, and the JSON Schemas of their messages.

Foxglove draws messages whose schema has one of its well-known names, see
https://docs.foxglove.dev/docs/sdk/schemas; those below hold its fields as far as they are used. Its reader of
JSON Schemas requires one plain type for each field and no references: a number that may be unknown is left
out of a message, never null.
"""

from __future__ import annotations

import json
from typing import Any

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
MAP = "/map"
MAP_SCENE = "/map/scene"
PATH = "/path"
ESTIMATE = "/estimate"
ESTIMATE_SCENE = "/estimate/scene"
TRUTH = "/truth"

_Schema = dict[str, Any]


def _object(title: str, /, optional: tuple[str, ...] = (), **properties: _Schema) -> _Schema:
    """An object that must have all its properties except the optional ones."""
    required = [name for name in properties if name not in optional]
    return {"title": title, "type": "object", "properties": properties, "required": required}


def _array(items: _Schema) -> _Schema:
    return {"type": "array", "items": items}


def _choice(**names: int) -> _Schema:
    return {"oneOf": [{"title": name, "const": value} for name, value in names.items()]}


_NUMBER: _Schema = {"type": "number"}
_STRING: _Schema = {"type": "string"}
_BOOLEAN: _Schema = {"type": "boolean"}
_NATURAL: _Schema = {"type": "integer", "minimum": 0}
_NSEC: _Schema = {"type": "integer", "minimum": 0, "maximum": 999_999_999}
_TIME = _object("time", sec=_NATURAL, nsec=_NSEC)
_DURATION = _object("duration", sec={"type": "integer"}, nsec=_NSEC)
_POINT_2 = _object("foxglove.Point2", x=_NUMBER, y=_NUMBER)
_POINT_3 = _object("foxglove.Point3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_VECTOR_3 = _object("foxglove.Vector3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object("foxglove.Quaternion", x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_COLOUR = _object("foxglove.Color", r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_POSE = _object("foxglove.Pose", position=_VECTOR_3, orientation=_QUATERNION)
_PAIR = _object("foxglove.KeyValuePair", key=_STRING, value=_STRING)

_CUBE = _object("foxglove.CubePrimitive", pose=_POSE, size=_VECTOR_3, color=_COLOUR)
_SPHERE = _object("foxglove.SpherePrimitive", pose=_POSE, size=_VECTOR_3, color=_COLOUR)
_LINE = _object(
    "foxglove.LinePrimitive",
    type=_choice(LINE_STRIP=0, LINE_LOOP=1, LINE_LIST=2),
    pose=_POSE,
    thickness=_NUMBER,
    scale_invariant=_BOOLEAN,
    points=_array(_POINT_3),
    color=_COLOUR,
    colors=_array(_COLOUR),
    indices=_array(_NATURAL),
)
_SCENE_ENTITY = _object(
    "foxglove.SceneEntity",
    timestamp=_TIME,
    frame_id=_STRING,
    id=_STRING,
    lifetime=_DURATION,
    frame_locked=_BOOLEAN,
    metadata=_array(_PAIR),
    cubes=_array(_CUBE),
    spheres=_array(_SPHERE),
    lines=_array(_LINE),
)
_SCENE_DELETION = _object(
    "foxglove.SceneEntityDeletion", timestamp=_TIME, type=_choice(MATCHING_ID=0, ALL=1), id=_STRING
)
_POINTS_ANNOTATION = _object(
    "foxglove.PointsAnnotation",
    timestamp=_TIME,
    type=_choice(UNKNOWN=0, POINTS=1, LINE_LOOP=2, LINE_STRIP=3, LINE_LIST=4),
    points=_array(_POINT_2),
    outline_color=_COLOUR,
    outline_colors=_array(_COLOUR),
    fill_color=_COLOUR,
    thickness=_NUMBER,
    metadata=_array(_PAIR),
)
_TEXT_ANNOTATION = _object(
    "foxglove.TextAnnotation",
    timestamp=_TIME,
    position=_POINT_2,
    text=_STRING,
    font_size=_NUMBER,
    text_color=_COLOUR,
    background_color=_COLOUR,
    metadata=_array(_PAIR),
)
_CIRCLE_ANNOTATION = _object(
    "foxglove.CircleAnnotation",
    timestamp=_TIME,
    position=_POINT_2,
    diameter=_NUMBER,
    thickness=_NUMBER,
    fill_color=_COLOUR,
    outline_color=_COLOUR,
    metadata=_array(_PAIR),
)
_MATRIX_3_BY_3: _Schema = {**_array(_NUMBER), "minItems": 9, "maxItems": 9}
_MATRIX_3_BY_4: _Schema = {**_array(_NUMBER), "minItems": 12, "maxItems": 12}

_FOXGLOVE: tuple[_Schema, ...] = (
    _object(
        "foxglove.CompressedImage",
        timestamp=_TIME,
        frame_id=_STRING,
        data={"type": "string", "contentEncoding": "base64"},
        format=_STRING,
    ),
    _object(
        "foxglove.CameraCalibration",
        timestamp=_TIME,
        frame_id=_STRING,
        width=_NATURAL,
        height=_NATURAL,
        distortion_model=_STRING,
        D=_array(_NUMBER),
        K=_MATRIX_3_BY_3,
        R=_MATRIX_3_BY_3,
        P=_MATRIX_3_BY_4,
    ),
    _object(
        "foxglove.ImageAnnotations",
        circles=_array(_CIRCLE_ANNOTATION),
        points=_array(_POINTS_ANNOTATION),
        texts=_array(_TEXT_ANNOTATION),
    ),
    _object(
        "foxglove.FrameTransform",
        timestamp=_TIME,
        parent_frame_id=_STRING,
        child_frame_id=_STRING,
        translation=_VECTOR_3,
        rotation=_QUATERNION,
    ),
    _object("foxglove.PosesInFrame", timestamp=_TIME, frame_id=_STRING, poses=_array(_POSE)),
    _object("foxglove.SceneUpdate", deletions=_array(_SCENE_DELETION), entities=_array(_SCENE_ENTITY)),
    _object(
        "foxglove.Log",
        timestamp=_TIME,
        level=_choice(UNKNOWN=0, DEBUG=1, INFO=2, WARNING=3, ERROR=4, FATAL=5),
        message=_STRING,
        name=_STRING,
        file=_STRING,
        line=_NATURAL,
    ),
)


def _field(kind: str, description: str) -> _Schema:
    return {"type": kind, "description": description}


_FLIGHT_TIME = _field("number", "vehicle time since motors on, seconds; 0 before")
_BOX = {
    "n": _field("number", "upper edge of its box, pixels above the image's centre"),
    "s": _field("number", "lower edge, pixels above the centre"),
    "e": _field("number", "right edge, pixels right of the centre"),
    "w": _field("number", "left edge, pixels right of the centre"),
    "d": _field("number", "distance, metres; only of a frame wholly in view"),
    "a": _field("number", "angle between line of sight and the frame's normal, degrees; only as d"),
    "signed_a": _field(
        "number", "that angle, positive if flying left makes it smaller; missing if not known"
    ),
}
_DETECTION = _object(
    "framerunner.Detection",
    optional=tuple(_BOX),
    seen=_field("boolean", "whether any pixel of the colour was seen"),
    **_BOX,
)

_VALUE = _object(
    "framerunner.GuardValue",
    optional=("number", "flag", "text"),
    name=_field("string", "as the guard has it, such as frame.d"),
    number=_field("number", "its value then; missing if it was infinite or none"),
    flag=_field("boolean", "its value then, if it was true or false"),
    text=_field("string", "its value then, if it was neither"),
)

_MAPPED_GATE = _object(
    "framerunner.MappedFrame",
    optional=("position_std_m", "yaw_std_rad", "shape"),
    colour=_STRING,
    position_arena_m=_VECTOR_3,
    yaw_rad=_field("number", "heading of its normal, counter-clockwise from the arena's x"),
    position_std_m=_VECTOR_3,
    yaw_std_rad=_field("number", "standard deviation of the yaw"),
    ambiguous=_field("boolean", "another yaw explains the images nearly as well"),
    certain=_field("boolean", "known well enough to fly through"),
    views=_field("integer", "how many images have been used"),
    seen=_TIME,
    shape=_object(
        "framerunner.FrameShape",
        outer_width_m=_field("number", "horizontal, bars included"),
        outer_height_m=_field("number", "vertical, bars included"),
        bar_m=_field("number", "width of the bars, seen from the front"),
        depth_m=_field("number", "thickness of the bars, along the normal"),
    ),
)

_OWN = (
    _object(
        "framerunner.Telemetry",
        timestamp=_TIME,
        flight_time_s=_FLIGHT_TIME,
        position_arena_m=_VECTOR_3,
        velocity_arena_m_s=_VECTOR_3,
        position_age_s=_field("number", "how much older position and velocity are than the timestamp"),
        attitude_arena=_QUATERNION,
        yaw_rad=_field("number", "heading, counter-clockwise from the arena's x"),
        armed=_field("boolean", "motors are on"),
        offboard=_field("boolean", "the drone follows the app's setpoints"),
        landed=_field("boolean", "it stands on something"),
        mode=_field("string", "flight mode"),
    ),
    _object(
        "framerunner.Setpoint",
        timestamp=_TIME,
        forward_m_s=_field("number", "in level axes turned with the yaw"),
        left_m_s=_field("number", "in level axes turned with the yaw"),
        up_m_s=_field("number", "upwards"),
        yaw_rate_rad_s=_field("number", "to the left"),
    ),
    _object(
        "framerunner.Detections",
        optional=("image_timestamp",),
        timestamp=_TIME,
        image_timestamp=_TIME,
        red=_DETECTION,
        green=_DETECTION,
        blue=_DETECTION,
    ),
    _object(
        "framerunner.MissionState",
        optional=("when", "values", "transitions"),
        timestamp=_TIME,
        flight_time_s=_FLIGHT_TIME,
        state=_field("string", "entered, such as red.turning"),
        previous=_field("string", "left; empty at the start"),
        previous_s=_field("number", "time spent in it, seconds"),
        when=_field("string", "the guard that held"),
        values={"type": "array", "items": _VALUE},
        transitions=_array(_field("string", "taken: a transition and each `then` it led to")),
    ),
    _object(
        "framerunner.Crossing",
        timestamp=_TIME,
        colour=_field("string", "of the frame"),
        time_s=_field("number", "since motors on, as in result.json"),
        offset_m=_field("number", "from the opening's centre, in its plane"),
        side=_field("string", "front or back, the side the drone came from"),
    ),
    _object(
        "framerunner.Map",
        timestamp=_TIME,
        goal=_field("string", "what the navigator does, such as cross red"),
        frames=_array(_MAPPED_GATE),
    ),
    _object(
        "framerunner.Estimate",
        timestamp=_TIME,
        position_arena_m=_VECTOR_3,
        yaw_rad=_field("number", "heading, counter-clockwise from the arena's x"),
        position_covariance_m2={
            **_array(_NUMBER),
            "minItems": 9,
            "maxItems": 9,
            "description": "of x, y and z, row by row",
        },
        yaw_std_rad=_field("number", "standard deviation of the yaw"),
    ),
    _object("framerunner.Truth", timestamp=_TIME, position_arena_m=_VECTOR_3),
)

TOPICS = {
    TELEMETRY: "framerunner.Telemetry",
    SETPOINT: "framerunner.Setpoint",
    DETECTIONS: "framerunner.Detections",
    MISSION: "framerunner.MissionState",
    CROSSING: "framerunner.Crossing",
    MAP: "framerunner.Map",
    MAP_SCENE: "foxglove.SceneUpdate",
    PATH: "foxglove.PosesInFrame",
    ESTIMATE: "framerunner.Estimate",
    ESTIMATE_SCENE: "foxglove.SceneUpdate",
    TRUTH: "framerunner.Truth",
    IMAGE: "foxglove.CompressedImage",
    CALIBRATION: "foxglove.CameraCalibration",
    ANNOTATIONS: "foxglove.ImageAnnotations",
    TRANSFORM: "foxglove.FrameTransform",
    SCENE: "foxglove.SceneUpdate",
    LOG: "foxglove.Log",
}
"""Name of each topic's schema."""


def schema_texts() -> dict[str, bytes]:
    """All schemas as JSON, by name."""
    return {schema["title"]: json.dumps(schema).encode() for schema in (*_OWN, *_FOXGLOVE)}
