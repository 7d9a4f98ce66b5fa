"""JSON Schemas of the messages that Foxglove draws by itself.

It does so for schemas with one of its well-known names, see https://docs.foxglove.dev/docs/sdk/schemas; those
here hold its fields as far as they are used. Its reader of JSON Schemas wants one plain type for each field
and no references: a number that may be unknown is left out of a message, never null.
"""

from __future__ import annotations

from typing import Any

Schema = dict[str, Any]


def schema_of(title: str, properties: dict[str, Schema], optional: tuple[str, ...] = ()) -> Schema:
    """An object that has all its properties, but for the optional ones."""
    required = [name for name in properties if name not in optional]
    return {"title": title, "type": "object", "properties": properties, "required": required}


def _array(items: Schema) -> Schema:
    return {"type": "array", "items": items}


def _choice(**names: int) -> Schema:
    return {"oneOf": [{"title": name, "const": value} for name, value in names.items()]}


NUMBER: Schema = {"type": "number"}
STRING: Schema = {"type": "string"}
BOOLEAN: Schema = {"type": "boolean"}
_NSEC: Schema = {"type": "integer", "minimum": 0, "maximum": 999_999_999}
TIME = schema_of("time", {"sec": {"type": "integer", "minimum": 0}, "nsec": _NSEC})
_DURATION = schema_of("duration", {"sec": {"type": "integer"}, "nsec": _NSEC})
_POINT_2 = schema_of("foxglove.Point2", {"x": NUMBER, "y": NUMBER})
_POINT_3 = schema_of("foxglove.Point3", {"x": NUMBER, "y": NUMBER, "z": NUMBER})
VECTOR_3 = schema_of("foxglove.Vector3", {"x": NUMBER, "y": NUMBER, "z": NUMBER})
_QUATERNION = schema_of("foxglove.Quaternion", {"x": NUMBER, "y": NUMBER, "z": NUMBER, "w": NUMBER})
_COLOUR = schema_of("foxglove.Color", {"r": NUMBER, "g": NUMBER, "b": NUMBER, "a": NUMBER})
_POSE = schema_of("foxglove.Pose", {"position": VECTOR_3, "orientation": _QUATERNION})
_PAIR = schema_of("foxglove.KeyValuePair", {"key": STRING, "value": STRING})

_CUBE = schema_of("foxglove.CubePrimitive", {"pose": _POSE, "size": VECTOR_3, "color": _COLOUR})
_LINE = schema_of(
    "foxglove.LinePrimitive",
    {
        "type": _choice(LINE_STRIP=0, LINE_LOOP=1, LINE_LIST=2),
        "pose": _POSE,
        "thickness": NUMBER,
        "scale_invariant": BOOLEAN,
        "points": _array(_POINT_3),
        "color": _COLOUR,
        "colors": _array(_COLOUR),
        "indices": _array({"type": "integer", "minimum": 0}),
    },
)
_SCENE_ENTITY = schema_of(
    "foxglove.SceneEntity",
    {
        "timestamp": TIME,
        "frame_id": STRING,
        "id": STRING,
        "lifetime": _DURATION,
        "frame_locked": BOOLEAN,
        "metadata": _array(_PAIR),
        "cubes": _array(_CUBE),
        "lines": _array(_LINE),
    },
)
_SCENE_DELETION = schema_of(
    "foxglove.SceneEntityDeletion",
    {"timestamp": TIME, "type": _choice(MATCHING_ID=0, ALL=1), "id": STRING},
)
_POINTS_ANNOTATION = schema_of(
    "foxglove.PointsAnnotation",
    {
        "timestamp": TIME,
        "type": _choice(UNKNOWN=0, POINTS=1, LINE_LOOP=2, LINE_STRIP=3, LINE_LIST=4),
        "points": _array(_POINT_2),
        "outline_color": _COLOUR,
        "outline_colors": _array(_COLOUR),
        "fill_color": _COLOUR,
        "thickness": NUMBER,
        "metadata": _array(_PAIR),
    },
)
_TEXT_ANNOTATION = schema_of(
    "foxglove.TextAnnotation",
    {
        "timestamp": TIME,
        "position": _POINT_2,
        "text": STRING,
        "font_size": NUMBER,
        "text_color": _COLOUR,
        "background_color": _COLOUR,
        "metadata": _array(_PAIR),
    },
)
_CIRCLE_ANNOTATION = schema_of(
    "foxglove.CircleAnnotation",
    {
        "timestamp": TIME,
        "position": _POINT_2,
        "diameter": NUMBER,
        "thickness": NUMBER,
        "fill_color": _COLOUR,
        "outline_color": _COLOUR,
        "metadata": _array(_PAIR),
    },
)
_MATRIX_3_BY_3: Schema = {**_array(NUMBER), "minItems": 9, "maxItems": 9}
_MATRIX_3_BY_4: Schema = {**_array(NUMBER), "minItems": 12, "maxItems": 12}
_PIXELS: Schema = {"type": "integer", "minimum": 0}

FOXGLOVE: tuple[Schema, ...] = (
    schema_of(
        "foxglove.CompressedImage",
        {
            "timestamp": TIME,
            "frame_id": STRING,
            "data": {"type": "string", "contentEncoding": "base64"},
            "format": STRING,
        },
    ),
    schema_of(
        "foxglove.CameraCalibration",
        {
            "timestamp": TIME,
            "frame_id": STRING,
            "width": _PIXELS,
            "height": _PIXELS,
            "distortion_model": STRING,
            "D": _array(NUMBER),
            "K": _MATRIX_3_BY_3,
            "R": _MATRIX_3_BY_3,
            "P": _MATRIX_3_BY_4,
        },
    ),
    schema_of(
        "foxglove.ImageAnnotations",
        {
            "circles": _array(_CIRCLE_ANNOTATION),
            "points": _array(_POINTS_ANNOTATION),
            "texts": _array(_TEXT_ANNOTATION),
        },
    ),
    schema_of(
        "foxglove.FrameTransform",
        {
            "timestamp": TIME,
            "parent_frame_id": STRING,
            "child_frame_id": STRING,
            "translation": VECTOR_3,
            "rotation": _QUATERNION,
        },
    ),
    schema_of(
        "foxglove.SceneUpdate",
        {"deletions": _array(_SCENE_DELETION), "entities": _array(_SCENE_ENTITY)},
    ),
    schema_of(
        "foxglove.Log",
        {
            "timestamp": TIME,
            "level": _choice(UNKNOWN=0, DEBUG=1, INFO=2, WARNING=3, ERROR=4, FATAL=5),
            "message": STRING,
            "name": STRING,
            "file": STRING,
            "line": {"type": "integer", "minimum": 0},
        },
    ),
)
