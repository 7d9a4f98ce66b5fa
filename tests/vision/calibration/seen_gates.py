"""What a camera that is turned on a drone sees of gates while the drone flies, without painting images."""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, radians, sin

import numpy as np

from framerunner.geometry.gate_shape import PAPER_GATE
from framerunner.geometry.rotations import quaternion_from_euler, rotation, rotation_rows
from vision.calibration.sightings import (
    MotionReport,
    PoseSpline,
    Sightings,
    Values,
    mounting_matrix,
    sightings_of,
)
from vision.types import Detections, GateCorner, GatePose, GateSighting

FOCAL_PX, HALF_WIDTH_PX, HALF_HEIGHT_PX = 160.0, 160.0, 120.0
TRUE = Values(tuple(map(radians, (2.0, 5.0, -3.0))), (0.08, 0.0, 0.02), 0.0)
Path = Callable[[float], tuple[float, float, float, float, float, float]]
"""From seconds to x, y, z in metres and roll, pitch, yaw in radians, axes forward, left, up."""


@dataclass(frozen=True)
class Rectangle:
    """A gate, or with another size something that looks like one; it faces +x when its yaw is 0."""

    colour: str
    position_m: tuple[float, float, float]
    yaw_rad: float
    size: float = 1.0


GATES = (
    Rectangle("red", (3.2, 0.3, 1.3), 3.0),
    Rectangle("green", (0.5, 3.0, 0.9), -1.2),
    Rectangle("blue", (-2.6, -1.5, 1.8), 0.9),
)
POSTER = Rectangle("green", (5.5, 1.5, 1.8), 3.1, 2.2)


def survey(time_s: float) -> tuple[float, float, float, float, float, float]:
    """As mission camera_survey: turning about, on a square with rounded corners."""
    around = 2 * np.pi * time_s / 40.0
    tilt = 0.02 * sin(3.0 * time_s)
    return (0.6 * cos(around), 0.6 * sin(around), 1.2 + 0.2 * sin(0.4 * time_s), tilt, -tilt, 0.5 * time_s)


def fly(
    path: Path,
    seconds: float,
    rectangles: tuple[Rectangle, ...] = (*GATES, POSTER),
    true: Values = TRUE,
    *,
    seed: int = 0,
    noise_px: float = 0.15,
    rate_hz: float = 8.0,
    delay_s: float = 0.0,
) -> tuple[list[Detections], PoseSpline]:
    """The images, whose times are those of their arrival, and the reported motion."""
    stream = np.random.default_rng(seed)
    reports = [report(path, time_s) for time_s in np.arange(0.0, seconds + 0.5, 0.05)]
    images = []
    for time_s in np.arange(0.3, seconds, 1.0 / rate_hz):
        x, y, z, *angles = path(time_s)
        body = np.array(rotation_rows(rotation(quaternion_from_euler(*angles))))
        camera = body @ mounting_matrix(true.angles_frd_rad)
        eye = np.array((x, y, z)) + body @ np.array(true.position_flu_m)
        found = (sighting(each, eye, camera, stream, noise_px) for each in rectangles)
        gates = tuple(each for each in found if each is not None)
        images.append(Detections(time_us=round(1e6 * (time_s + delay_s)), frames=gates))
    return images, PoseSpline(reports)


def report(path: Path, time_s: float) -> MotionReport:
    here, after = np.array(path(time_s)[:3]), np.array(path(time_s + 1e-4)[:3])
    velocity = tuple(((after - here) / 1e-4).tolist())
    attitude = quaternion_from_euler(*path(time_s)[3:])
    return MotionReport(round(1e6 * time_s), round(1e6 * time_s), tuple(here.tolist()), velocity, attitude)


def sighting(
    rectangle: Rectangle, eye: np.ndarray, camera: np.ndarray, stream: np.random.Generator, noise_px: float
) -> GateSighting | None:
    """Of a rectangle that is wholly in view."""
    centre, yaw = np.array(rectangle.position_m), rectangle.yaw_rad
    normal = np.array([cos(yaw), sin(yaw), 0.0])
    side = 1.0 if normal @ (eye - centre) > 0 else -1.0
    left = side * np.array([-sin(yaw), cos(yaw), 0.0])  # to the right as seen
    half = np.array(PAPER_GATE.half_m) * rectangle.size
    signs = np.array([(-1, 1), (1, 1), (1, -1), (-1, -1)])
    corners = centre + signs[:, :1] * half[0] * left + signs[:, 1:] * half[1] * np.array([0.0, 0.0, 1.0])
    seen = (corners - eye) @ camera
    if seen[:, 0].min() < 0.3 or abs(side * normal @ (centre - eye)) < 0.3 * np.linalg.norm(centre - eye):
        return None
    pixels = -FOCAL_PX * seen[:, 1:] / seen[:, :1]
    if (np.abs(pixels) > (HALF_WIDTH_PX, HALF_HEIGHT_PX)).any():
        return None
    pixels = pixels + stream.normal(0.0, noise_px, pixels.shape)
    place = (centre - eye) @ camera / rectangle.size
    facing = side * normal @ camera
    pose = GatePose(tuple(place.tolist()), tuple(facing.tolist()), 0.1)
    a, b, c, d = (GateCorner(right, down, noise_px, noise_px) for right, down in pixels.tolist())
    return GateSighting(rectangle.colour, (a, b, c, d), whole=True, poses=(pose,))


def sightings(images: list[Detections], motion: PoseSpline, delay_s: float = 0.0) -> Sightings:
    return sightings_of(images, motion, HALF_HEIGHT_PX, 0.0, delay_s)
