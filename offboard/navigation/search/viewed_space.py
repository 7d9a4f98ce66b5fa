"""Which places were in view of the camera, at their height: where a frame would have been seen."""

from __future__ import annotations

from math import hypot
from typing import Final

import numpy as np
import numpy.typing as npt

from framerunner.geometry.vectors import Vec3
from offboard.navigation.camera_model import CameraModel, CameraPose
from scenarios.models import Base

Doubles = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

_KEPT: Final = 256  # views
_MOVED_M: Final = 0.15  # a view from a pose nearer than this and _TURNED to the last one is skipped
_TURNED: Final = 0.1  # likewise, of any part of the rotation matrix
_FARTHEST_M: Final = 4.5  # a frame farther away may be too small to be seen
_BASE_M: Final = 0.8  # from the base in plan there is room for take-off and landing
_ABOVE_M: Final = 0.15  # above and below a place, that must be in view with it: a frame there
_FLOWN_M: Final = 0.3  # from where the camera was, along each axis: there is nothing
_NEAR_M: Final = 0.6  # from the drone in plan; nearer places cannot come into view


class ViewedSpace:
    """Remembers the camera's poses, and tells which places were in view from one of them.

    Attributes:
        needed: there may be frames that are not on the map; else all places are as good as viewed.
    """

    def __init__(self, camera: CameraModel, base: Base) -> None:
        self._base = base
        self._right = camera.half_width_px / camera.focal_px
        self._up = camera.half_height_px / camera.focal_px
        self._positions: Doubles = np.zeros((_KEPT, 3))
        self._rotations: Doubles = np.zeros((_KEPT, 9))
        self._count = -1  # views that are kept, less one; after the last one there is the latest
        self.needed = True
        self._excused: list[Vec3] = []

    def update(self, pose: CameraPose) -> None:
        """Take in an image from a pose."""
        row = (self._count + 1) % _KEPT
        self._positions[row], self._rotations[row] = pose.position_m, pose.rotation
        last = self._count % _KEPT
        moved = np.abs(self._positions[last] - pose.position_m).max() > _MOVED_M
        if self._count < 0 or moved or np.abs(self._rotations[last] - pose.rotation).max() > _TURNED:
            self._count += 1

    def is_viewed(self, place_m: Vec3) -> bool:
        """Whether a place was in view, or is excused."""
        return bool(self._are_viewed(np.array([place_m]))[0])

    def first_unviewed(self, places_m: list[Vec3], from_m: Vec3) -> Vec3 | None:
        """The first of some places that was not in view; those near the drone in plan are left out."""
        if not self.needed or self._count < 0:
            return None
        x, y, _ = from_m
        base = self._base
        far = [
            place
            for place in places_m
            if hypot(place[0] - x, place[1] - y) > _NEAR_M
            and hypot(place[0] - base.x_m, place[1] - base.y_m) > _BASE_M
        ]
        if not far:
            return None
        viewed = self._are_viewed(np.array(far))
        return None if viewed.all() else far[int(viewed.argmin())]

    def excuse(self, place_m: Vec3) -> None:
        """Take a place as viewed that cannot be brought into view."""
        self._excused.append(place_m)

    def _are_viewed(self, places_m: Doubles) -> Bools:
        """Likewise of several, shape (n, 3)."""
        views = min(self._count + 2, _KEPT)
        offsets = places_m[:, None] - self._positions[:views]
        axes = self._rotations[:views].reshape(views, 3, 3)
        ahead, left, up = np.moveaxis(np.einsum("pvi,vij->pvj", offsets, axes), 2, 0)
        shown = (np.abs(left) < ahead * self._right) & (np.abs(up) + _ABOVE_M < ahead * self._up)
        flown = (np.abs(offsets) < _FLOWN_M).all(axis=2)
        viewed: Bools = (flown | (shown & (ahead < _FARTHEST_M))).any(axis=1)
        for excused in self._excused:
            viewed |= np.linalg.norm(places_m - np.array(excused), axis=1) < _NEAR_M
        return viewed
