"""Poses of a motion capture, and their axes.

A record has a time and a pose: position in metres and a unit quaternion (w, x, y, z) that turns body axes
into the room's. Records are lines of JSON or rows of a CSV file with the same names.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum
from io import StringIO
from itertools import pairwise
from math import cos, hypot, nan, radians, sin, sqrt
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from framerunner.errors import UserError
from framerunner.files.text_file import TextError, decode_text, read_text
from framerunner.geometry.axes import flip_quaternion, flip_vector
from framerunner.geometry.rotations import multiply, normalized
from framerunner.geometry.vectors import Quaternion, Vec3

_HALF = sqrt(0.5)
_ENU_TO_NED: Quaternion = (0.0, _HALF, _HALF, 0.0)  # half a turn about (1, 1, 0)
_FRD_TO_FLU: Quaternion = (0.0, 1.0, 0.0, 0.0)  # half a turn about x
_NORM_TOLERANCE = 0.02
_MAX_FILE_BYTES = 1 << 28  # of an hour at 500 Hz
_COLUMNS = ("time_s", "x", "y", "z", "qw", "qx", "qy", "qz")


class PoseError(UserError):
    """A pose or a file of poses that cannot be used; the message is one line for people."""


class Axes(Enum):
    """Axes of the room and of the body in it, as the motion capture has them.

    Attributes:
        FLU: x forward, y left, z up; the body likewise. Those of arenas here, of Vicon and Qualisys.
        NED: x north or forward, y east or right, z down; the body forward, right, down.
        ENU: x east, y north, z up; the body forward, left, up. Those of ROS.
        YUP: x forward, y up, z right; the body likewise. Those of OptiTrack's Motive.
    """

    FLU = "flu"
    NED = "ned"
    ENU = "enu"
    YUP = "yup"


@dataclass(frozen=True, slots=True)
class MeasuredPose:
    """A pose in the vehicle's axes.

    Attributes:
        time_s: of the source's clock; NaN: the source gives none.
        position_ned_m: from the source's origin, shape (3,).
        attitude: unit quaternion, body FRD to NED.
        velocity_ned_m_s: shape (3,); None: the source gives none.
    """

    time_s: float
    position_ned_m: Vec3
    attitude: Quaternion
    velocity_ned_m_s: Vec3 | None = None


class PoseRecord(BaseModel):
    """One line or row; names that are not listed here are ignored."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    time_s: float | None = None
    x: float
    y: float
    z: float
    qw: float
    qx: float
    qy: float
    qz: float
    vx: float | None = None
    vy: float | None = None
    vz: float | None = None
    frame: Axes | None = None
    name: str | None = None

    def pose(self, axes: Axes) -> MeasuredPose:
        """The pose in the vehicle's axes; `axes` are those of a record that names none.

        Raises:
            PoseError: the quaternion is not of unit length.
        """
        norm = hypot(self.qw, self.qx, self.qy, self.qz)
        if abs(norm - 1.0) > _NORM_TOLERANCE:
            raise PoseError(f"qw, qx, qy, qz: a quaternion of length {norm:.3g}; it must be 1")
        attitude = normalized((self.qw, self.qx, self.qy, self.qz))
        velocity = None
        if self.vx is not None and self.vy is not None and self.vz is not None:
            velocity = (self.vx, self.vy, self.vz)
        time_s = nan if self.time_s is None else self.time_s
        return in_ned(MeasuredPose(time_s, (self.x, self.y, self.z), attitude, velocity), self.frame or axes)


def in_ned(pose: MeasuredPose, axes: Axes) -> MeasuredPose:
    """A pose whose vectors and attitude are in some axes, in NED and FRD."""
    if axes is Axes.NED:
        return pose
    velocity = pose.velocity_ned_m_s
    return MeasuredPose(
        pose.time_s,
        _vector(pose.position_ned_m, axes),
        _attitude(pose.attitude, axes),
        None if velocity is None else _vector(velocity, axes),
    )


def _vector(vector: Vec3, axes: Axes) -> Vec3:
    x, y, z = vector
    if axes is Axes.YUP:
        return (x, z, -y)
    return (y, x, -z) if axes is Axes.ENU else flip_vector(vector)


def _attitude(attitude: Quaternion, axes: Axes) -> Quaternion:
    if axes is Axes.YUP:
        w, x, y, z = attitude
        return (w, x, z, -y)
    if axes is Axes.ENU:
        return multiply(multiply(_ENU_TO_NED, attitude), _FRD_TO_FLU)
    return flip_quaternion(attitude)


def with_forward(pose: MeasuredPose, turn_deg: float) -> MeasuredPose:
    """The pose of a vehicle whose forward axis is turned from the body's first one.

    Args:
        pose: of the body that the motion capture tracks.
        turn_deg: counter-clockwise seen from above.
    """
    if turn_deg == 0.0:
        return pose
    half = radians(-turn_deg) / 2.0  # FRD: about down
    return replace(pose, attitude=multiply(pose.attitude, (cos(half), 0.0, 0.0, sin(half))))


def parse_line(line: str | bytes) -> PoseRecord:
    """The record in a line of JSON.

    Raises:
        PoseError: it is none.
    """
    try:
        return PoseRecord.model_validate_json(decode_text(line) if isinstance(line, bytes) else line)
    except ValidationError as error:
        raise PoseError(_words(error)) from None
    except TextError as error:
        raise PoseError(str(error)) from None


def read_poses(path: Path, axes: Axes, name: str | None) -> list[MeasuredPose]:
    """All poses of a file: CSV if its name ends in .csv, else lines of JSON.

    Raises:
        PoseError: it cannot be read, or a line is wrong; the message names file, line and what to do.
    """
    number, poses = 0, []
    if path.exists() and not path.is_file():  # a device may never end
        raise PoseError(f"{path}: is not a regular file; give a .csv or .jsonl file of poses")
    try:
        text = read_text(path, _MAX_FILE_BYTES)
        for number, raw in _raw(text, is_csv=path.suffix.lower() == ".csv"):  # noqa: B007 - errors name it
            record = _record(raw)
            if record.time_s is None:
                raise PoseError("time_s: missing; a file needs it in every line")
            if name is None or record.name == name:
                poses.append(record.pose(axes))
    except ValidationError as error:
        raise PoseError(f"{path}, line {number}: {_words(error)}") from None
    except PoseError as error:
        raise PoseError(f"{path}, line {number or 1}: {error}") from None
    except (TextError, csv.Error) as error:
        raise PoseError(f"{path}: {error}; give a .csv or .jsonl file of poses") from None
    if not poses:
        of_body = "" if name is None else f" of a body named {name}"
        raise PoseError(f"{path}: there is no pose{of_body} in it")
    for before, after in pairwise(poses):
        if not before.time_s < after.time_s:
            raise PoseError(
                f"{path}: time_s {after.time_s:g} must be above {before.time_s:g}, the one before"
            )
    return poses


def _raw(text: str, *, is_csv: bool) -> Iterator[tuple[int, str | dict[str, str | None]]]:
    """Line numbers with lines of JSON or rows of CSV."""
    if is_csv:
        rows = csv.DictReader(StringIO(text))
        rows.fieldnames = [name.strip() for name in rows.fieldnames or ()]
        missing = [name for name in _COLUMNS if name not in rows.fieldnames]
        for row in rows:
            if missing:
                raise PoseError(f"there is no column {missing[0]}; name the columns {','.join(_COLUMNS)}")
            yield rows.line_num, {key: (value or "").strip() or None for key, value in row.items() if key}
        return
    for number, line in enumerate(text.split("\n"), start=1):
        if line.strip():
            yield number, line


def _record(raw: str | dict[str, str | None]) -> PoseRecord:
    return PoseRecord.model_validate_json(raw) if isinstance(raw, str) else PoseRecord.model_validate(raw)


def _words(error: ValidationError) -> str:
    """The first fault, in one line."""
    fault = error.errors()[0]
    field = ".".join(map(str, fault["loc"])) or "line"
    return f"{field}: {fault['msg']}"
