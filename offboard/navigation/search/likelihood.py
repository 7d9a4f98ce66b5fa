"""Where gates are likely: before anything is known of their layout, and by what was seen of them.

A gate that was not seen well enough to be on the map is somewhere on a line of sight.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Final

import numpy as np

from framerunner.geometry.gate_shape import GateShape, GateShapes
from framerunner.geometry.rotations import to_world
from framerunner.geometry.vectors import Quaternion, Vec3
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.search.gate_visibility import HEADINGS, Bools, Floats, SearchGrid
from vision.types import Detection, Detections

_SPARE: Final = 1.3  # a gate may be this much farther away than its size in the image says
_SPARE_M: Final = 0.5
_KEPT_IMAGES: Final = 150  # a glimpse is forgotten after so many further images


@dataclass(frozen=True, slots=True)
class LineOfSight:
    """A direction in which there is a gate, in arena axes."""

    origin_m: Vec3  # of the camera
    direction: Vec3  # unit vector
    nearest_m: float = 0.3
    farthest_m: float = 12.0


class Glimpses:
    """Remembers the last line of sight to each gate of the task that is not on the map."""

    def __init__(self, camera: CameraModel, shapes: GateShapes) -> None:
        self._camera = camera
        self._shapes = shapes
        self._images = 0
        self._lines: dict[str, tuple[int, LineOfSight]] = {}

    def update(
        self,
        position_m: Vec3,
        attitude_arena: Quaternion,
        detections: Detections,
        known: Collection[str],
        is_lookalike: Callable[[str, LineOfSight], bool],
    ) -> None:
        """Take in an image.

        Args:
            position_m: of the drone's centre when the image was exposed, arena axes.
            attitude_arena: body FLU to arena.
            detections: what the image showed.
            known: colours of the gates on the map.
            is_lookalike: whether what is seen in a direction looks like a gate of a colour, and is none.
        """
        self._images += 1
        boxes = {"red": detections.red, "green": detections.green, "blue": detections.blue}
        for colour, box in boxes.items():
            if colour in known:
                self._lines.pop(colour, None)
            elif box.seen:
                line = self._line(position_m, attitude_arena, box, self._shapes.of(colour))
                if not is_lookalike(colour, line):
                    self._lines[colour] = (self._images, line)

    def lines(self) -> tuple[LineOfSight, ...]:
        """The lines of sight to gates that are not known, the oldest glimpses left out."""
        return tuple(line for image, line in self._lines.values() if self._images - image <= _KEPT_IMAGES)

    def _line(
        self, position_m: Vec3, attitude_arena: Quaternion, box: Detection, shape: GateShape
    ) -> LineOfSight:
        """Through the middle of what was seen; at most as far as a gate looks that small."""
        focal_px = self._camera.focal_px
        pose = self._camera.pose(position_m, attitude_arena)
        left, up = -(box.e + box.w) / 2 / focal_px, (box.n + box.s) / 2 / focal_px
        x, y, z = to_world(pose.rotation, 1.0, left, up)
        length = hypot(x, y, z)
        size = max((box.n - box.s) / shape.outer_height_m, (box.e - box.w) / shape.outer_width_m, 1.0)
        farthest_m = _SPARE * focal_px / size + _SPARE_M
        return LineOfSight(pose.position_m, (x / length, y / length, z / length), farthest_m=farthest_m)


_FLOOR_M, _CEILING_M = 0.3, 3.0  # most gates hang between
_ELSEWHERE: Final = 0.4  # weight of other heights
_APART_M: Final = 1.2  # from a gate found to other gates, most likely
_NEAR_FOUND: Final = 0.25  # weight nearer than that
_RAY_M: Final = 0.45  # half width of a line of sight at its origin
_RAY_SLOPE: Final = 0.06  # how much wider it gets
_RAY_LEFT: Final = 0.1  # share of a line of sight; when less is unseen it attracts less


class Likelihood:
    """Weights of the blocks of a grid. None is ever zero.

    Args:
        blocks: the grid.
    """

    def __init__(self, blocks: SearchGrid) -> None:
        self._x_m, self._y_m, self._z_m = blocks.centres()
        half_m = blocks.z_m[0]
        low = np.maximum(self._z_m - half_m, np.float32(_FLOOR_M))
        high = np.minimum(self._z_m + half_m, np.float32(_CEILING_M))
        share = np.clip((high - low) / (2 * half_m), np.float32(0.0), np.float32(1.0))
        self._prior: Floats = np.float32(_ELSEWHERE) + np.float32(1.0 - _ELSEWHERE) * share

    def weights(self, seen: Floats, found: Sequence[Vec3], hints: Sequence[LineOfSight]) -> Floats:
        """How likely there is a gate in each block, compared with others, before it is looked at.

        A line of sight weighs as much as all the rest of the arena. Its weight is on those of its blocks that
        are not seen yet.

        Args:
            seen: quality of the best view so far, shape (HEADINGS, blocks).
            found: centres of the gates that are known.
            hints: directions in which there are others.
        """
        weights = self._prior.copy()
        for x, y, _ in found:
            dx_m, dy_m = self._x_m - np.float32(x), self._y_m - np.float32(y)
            weights[dx_m * dx_m + dy_m * dy_m < np.float32(_APART_M**2)] *= np.float32(_NEAR_FOUND)
        if hints:
            total = _sum(weights)
            doubt = np.float32(1.0) - seen[0] / np.float32(HEADINGS)
            for layer in seen[1:]:
                doubt -= layer / np.float32(HEADINGS)
            rays = np.zeros_like(weights)
            for hint in hints:
                on_ray = self._on_ray(hint)
                unseen = max(_sum(doubt[on_ray]), _RAY_LEFT * np.count_nonzero(on_ray), _RAY_LEFT)
                rays[on_ray] = np.maximum(rays[on_ray], np.float32(total / unseen))
            weights += rays
        return weights

    def _on_ray(self, hint: LineOfSight) -> Bools:
        offset = [
            axis - np.float32(origin)
            for axis, origin in zip((self._x_m, self._y_m, self._z_m), hint.origin_m, strict=True)
        ]
        x, y, z = (np.float32(component) for component in hint.direction)
        along = offset[0] * x + offset[1] * y + offset[2] * z
        along = np.clip(along, np.float32(hint.nearest_m), np.float32(hint.farthest_m))
        dx, dy, dz = offset[0] - along * x, offset[1] - along * y, offset[2] - along * z
        width = np.float32(_RAY_M) + along * np.float32(_RAY_SLOPE)
        on_ray: Bools = dx * dx + dy * dy + dz * dz < width * width
        return on_ray


def _sum(values: Floats) -> float:
    """The sum, added in one order on every processor."""
    return float(np.cumsum(values, dtype=np.float64)[-1]) if values.size else 0.0
