"""The drone's camera: `Camera` paints images with OpenCV, `CameraFeed` takes them in simulated time.

Far to near: sky, ground to the horizon, tatami, shadows, then base and frames in an order in which nothing is
painted over by what it hides.

Pixels: OpenCV's convention, whole coordinates at pixel centres, so the optical axis is at ((w - 1) / 2,
(h - 1) / 2) and projection agrees with `cv2.projectPoints`. A polygon's border is painted on the *nearest*
pixels: a detected box is neither wider nor narrower than the true outline on average (each edge within half a
pixel), and a bar thinner than a pixel does not vanish.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from math import hypot, isfinite, tan

import cv2
import numpy as np
import numpy.typing as npt

from geometry.rotations import RotationRows, normalized, rotation, rotation_rows
from geometry.solids import Solid
from geometry.vectors import Quaternion, Vec3
from scenarios.models import Scenario, TrueState
from sitl.camera_projection import (
    SHIFT,
    SUBPIXELS,
    Ints,
    Mesh,
    MeshFace,
    Pinhole,
    Projection,
    clip_half_plane,
    drone_outlines,
)
from sitl.camera_scene import DRONE_BGR, GROUND_BGR, SKY_BGR, UNDERGROUND_BGR, PaintTree, build_scene

Image = npt.NDArray[np.uint8]

FIRST_EXPOSURE_US = 36_000
_HAZE_BAND = 0.09  # height of a band of haze above the horizon, as a share of the focal length
_MARGIN_PX = 2  # painted around the image and cut off: OpenCV is not exact at the border of its canvas
_INSIDE = (slice(_MARGIN_PX, -_MARGIN_PX), slice(_MARGIN_PX, -_MARGIN_PX))
_BANDS_BGR = (*SKY_BGR[1:], GROUND_BGR)
_OVERLAP_PX = 2.0  # of neighbouring bands of colour, so that no gap is seen between them
_FAR_HEIGHTS = 4.0  # of the image: lines farther away than this are cut before they are painted
_FAR_M = 1e5  # from farther away only sky and ground are seen


class Camera:
    """The camera of a scenario. It has no state: the same pose gives the same image."""

    def __init__(self, scenario: Scenario) -> None:
        self._settings = settings = scenario.camera
        focal_px = settings.width_px / 2 / tan(settings.horizontal_fov_rad / 2)
        width, height = settings.width_px + 2 * _MARGIN_PX, settings.height_px + 2 * _MARGIN_PX
        self._pinhole = Pinhole(width, height, focal_px, settings.near_m, settings.far_m)
        shape = (height, width, 3)
        self._sky = np.full(shape, SKY_BGR[0], np.uint8)
        self._underground = np.full(shape, UNDERGROUND_BGR, np.uint8)

        right, bottom = float(width), float(height)
        self._corners_px = ((-1.0, -1.0), (right, -1.0), (right, bottom), (-1.0, bottom))

        scene = build_scene(scenario)
        self._tree = PaintTree(scene.bodies)
        floor = (scene.tatami, *scene.mats, *scene.shadows)
        faces = [*floor, *self._tree.faces]
        self._mesh = Mesh(faces, self._pinhole)
        self._floor, self._solid = self._mesh.faces[: len(floor)], self._mesh.faces[len(floor) :]

    @property
    def focal_px(self) -> float:
        """Focal length, pixels."""
        return self._pinhole.focal_px

    def render(
        self, position_arena_m: Vec3, attitude_arena: Quaternion, drones: Sequence[Solid] = ()
    ) -> Image:
        """Paint what the camera sees.

        Args:
            position_arena_m: centre of the drone; the scenario has the camera's place on it.
            attitude_arena: quaternion (w, x, y, z), body FLU to arena; need not have unit length.
            drones: boxes of other drones. They move, so they are not in the tree of faces: each is painted
                where the tree has its centre. That is correct unless it flies closer to a thing than about
                its own size.

        Returns:
            A new image, BGR, shape (height, width, 3), uint8; its rows need not follow each other in memory.

        Raises:
            ValueError: a number is not finite, or the quaternion is zero.
        """
        rotation = _rows(attitude_arena)
        eye = self._eye(position_arena_m, rotation)
        if eye[2] <= 0.0:
            return self._underground[_INSIDE].copy()
        canvas = self._sky.copy()
        self._paint_background(canvas, rotation)
        if max(map(abs, eye)) < _FAR_M:
            projection = self._mesh.project(eye, rotation)
            seen = projection.seen
            _paint(canvas, projection, [face for face in self._floor if seen[face.index]])
            solid, first = self._solid, len(self._floor)
            order = self._tree.back_to_front(eye)
            painted = 0
            for behind, outline in self._place_drones(drones, eye, rotation) if drones else ():
                _paint(canvas, projection, [solid[i] for i in order[painted:behind] if seen[first + i]])
                cv2.fillConvexPoly(canvas, outline, DRONE_BGR, cv2.LINE_8, SHIFT)
                painted = behind
            _paint(canvas, projection, [solid[i] for i in order[painted:] if seen[first + i]])
        return canvas[_INSIDE]

    def _place_drones(
        self, drones: Sequence[Solid], eye: Vec3, rotation: RotationRows
    ) -> list[tuple[int, Ints]]:
        """How many faces are painted before each drone seen, and its outline, in order of painting."""
        found = drone_outlines(drones, eye, rotation, self._pinhole)
        places = self._tree.places(eye, np.array([drone.centre_arena_m for drone, _ in found]).reshape(-1, 3))
        outlines = [outline for _, outline in found]
        return sorted(zip(places.tolist(), outlines, strict=True), key=lambda each: each[0])

    def _eye(self, position: Vec3, rotation: RotationRows) -> Vec3:
        if not all(map(isfinite, position)):
            raise ValueError(f"position_arena_m: every component must be finite, got {position}")
        x, y, z = self._settings.position_flu_m
        ex, ey, ez = (p + r[0] * x + r[1] * y + r[2] * z for p, r in zip(position, rotation, strict=True))
        return (ex, ey, ez)

    def _paint_background(self, canvas: Image, rotation: RotationRows) -> None:
        """Paint the haze and the ground: bands between lines parallel to the horizon."""
        focal, (cu, cv) = self._pinhole.focal_px, self._pinhole.centre_px
        fwd_z, left_z, up_z = rotation[2]
        # A pixel's ray goes down where fwd_z - left_z (u - cu)/f - up_z (v - cv)/f is negative.
        a, b = left_z / focal, up_z / focal
        c = -(fwd_z + a * cu + b * cv)
        band = _HAZE_BAND * hypot(left_z, up_z)
        starts = (c + 3.0 * band, c + 2.0 * band, c + band, c)  # a band is where a u + b v + start >= 0
        bands = self._upright_bands(a, b, starts) or self._tilted_bands(a, b, starts)
        for colour, outline in zip(_BANDS_BGR, bands, strict=True):
            if len(outline) > 2:
                cv2.fillConvexPoly(canvas, outline, colour, cv2.LINE_8, SHIFT)

    def _upright_bands(self, a: float, b: float, starts: Sequence[float]) -> list[Ints] | None:
        """The bands from the left to the right border; None if they are too steep for that."""
        if abs(a) > b:
            return None
        (left, _), (right, bottom) = self._corners_px[0], self._corners_px[2]
        l0, l1, l2, l3 = (-(start + a * left) / b for start in starts)
        r0, r1, r2, r3 = (-(start + a * right) / b for start in starts)
        if max(abs(l0), abs(r0), abs(l3), abs(r3)) > _FAR_HEIGHTS * bottom:
            return None
        over = _OVERLAP_PX
        corners = np.array(
            (
                ((left, l0), (right, r0), (right, r1 + over), (left, l1 + over)),
                ((left, l1), (right, r1), (right, r2 + over), (left, l2 + over)),
                ((left, l2), (right, r2), (right, r3 + over), (left, l3 + over)),
                ((left, l3), (right, r3), (right, max(bottom, r3)), (left, max(bottom, l3))),
            )
        )
        return list(np.rint(SUBPIXELS * corners).astype(np.int32))

    def _tilted_bands(self, a: float, b: float, starts: Sequence[float]) -> list[Ints]:
        """The same for any attitude: half planes cut to the image."""
        overlap = _OVERLAP_PX * hypot(a, b)
        bands: list[Ints] = []
        for i, start in enumerate(starts):
            points = clip_half_plane(self._corners_px, a, b, start)
            if i + 1 < len(starts):  # no farther than a little into the next colour
                points = clip_half_plane(points, -a, -b, overlap - starts[i + 1])
            bands.append(np.rint(SUBPIXELS * np.array(points).reshape(-1, 2)).astype(np.int32))
        return bands


def _paint(canvas: Image, projection: Projection, faces: Iterable[MeshFace]) -> None:
    """Paint faces in their order."""
    for face in faces:
        outline = projection.outline(face)
        if outline is not None:
            cv2.fillConvexPoly(canvas, outline, face.colour, cv2.LINE_8, SHIFT)


def _rows(attitude: Quaternion) -> RotationRows:
    """The rotation matrix of a quaternion of any length but zero."""
    norm = hypot(*attitude)
    if not isfinite(norm) or norm == 0.0:
        raise ValueError(f"attitude_arena: need a finite quaternion other than zero, got {attitude}")
    return rotation_rows(rotation(normalized(attitude)))


class Exposure:
    """What the camera sees at a time, painted when `image` is first asked for.

    Args:
        camera: that sees it.
        truth: pose of the drone then.
        drones: boxes of other drones then.

    Attributes:
        time_us: of the exposure, simulated time.
    """

    def __init__(self, camera: Camera, truth: TrueState, drones: Sequence[Solid]) -> None:
        self.time_us = truth.time_us
        self._camera, self._truth, self._drones = camera, truth, drones

    @cached_property
    def image(self) -> Image:
        """BGR, shape (height, width, 3), uint8."""
        return self._camera.render(self._truth.position_arena_m, self._truth.attitude_arena, self._drones)


class CameraFeed:
    """Takes images at the camera's rate and returns each after the camera's latency.

    Exposures are on a grid of the camera's period that begins at 36 ms, each once; a rate above the control
    rate gives one image a tick. The navigator's ticks are 50 ms apart and begin at 0: with the default
    latency an image arrives 14 ms before one. That is recent, which the paper's navigator needs to keep its
    height before a frame, and early enough that video and telemetry do not race.

    Args:
        scenario: camera settings and what is to be seen.
        drones: called at each exposure for the boxes of other drones.

    Attributes:
        next_us: before this time there is nothing to do.
    """

    def __init__(self, scenario: Scenario, drones: Callable[[], Sequence[Solid]] = tuple) -> None:
        self._camera = Camera(scenario)
        self._drones = drones
        self._period_us = 1e6 / scenario.camera.rate_hz
        self._latency_us = round(scenario.camera.latency_s * 1e6)
        self._taken = 0
        self.next_us = 0
        self._waiting: deque[Exposure] = deque()

    def step(self, truth: TrueState) -> tuple[int, Image] | None:
        """Take the image that is due at this tick, and return the one that arrives.

        Args:
            truth: pose of the drone now.

        Returns:
            Time of exposure, microseconds, and the image; None if none arrives at this tick.
        """
        arrived = self.arrival(truth)
        return None if arrived is None else (arrived.time_us, arrived.image)

    def arrival(self, truth: TrueState) -> Exposure | None:
        """As `step`, for a user who does not look at every image: those are not painted."""
        if truth.time_us < self.next_us:
            return None
        index = int((truth.time_us - FIRST_EXPOSURE_US) // self._period_us)
        if index >= self._taken:
            self._taken = index + 1
            self._waiting.append(Exposure(self._camera, truth, self._drones()))
        arrived = None
        if self._waiting and self._waiting[0].time_us + self._latency_us <= truth.time_us:
            arrived = self._waiting.popleft()
        self.next_us = int(FIRST_EXPOSURE_US + self._taken * self._period_us)
        if self._waiting:
            self.next_us = min(self.next_us, self._waiting[0].time_us + self._latency_us)
        return arrived
