"""Frames that were seen, but not well enough to be on the map: only their direction is known."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from math import hypot
from typing import Final

from framerunner.geometry.rotations import to_world
from framerunner.geometry.vectors import Quaternion, Vec3
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.goals import FRAME_HEIGHT_M, FRAME_WIDTH_M
from vision.types import Detection, Detections

_SPARE: Final = 1.3  # a frame may be this much farther away than its size in the image says
_SPARE_M: Final = 0.5
_KEPT_IMAGES: Final = 150  # a glimpse is forgotten after so many further images


@dataclass(frozen=True, slots=True)
class LineOfSight:
    """A direction in which there is a frame, in arena axes."""

    origin_m: Vec3  # of the camera
    direction: Vec3  # unit vector
    nearest_m: float = 0.3
    farthest_m: float = 12.0


class Glimpses:
    """Remembers the last line of sight to each frame of the task that is not on the map."""

    def __init__(self, camera: CameraModel) -> None:
        self._camera = camera
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
            known: colours of the frames on the map.
            is_lookalike: whether what is seen in a direction looks like a frame of a colour, and is none.
        """
        self._images += 1
        boxes = {"red": detections.red, "green": detections.green, "blue": detections.blue}
        for colour, box in boxes.items():
            if colour in known:
                self._lines.pop(colour, None)
            elif box.seen:
                line = self._line(position_m, attitude_arena, box)
                if not is_lookalike(colour, line):
                    self._lines[colour] = (self._images, line)

    def lines(self) -> tuple[LineOfSight, ...]:
        """The lines of sight to frames that are not known, the oldest glimpses left out."""
        return tuple(line for image, line in self._lines.values() if self._images - image <= _KEPT_IMAGES)

    def _line(self, position_m: Vec3, attitude_arena: Quaternion, box: Detection) -> LineOfSight:
        """Through the middle of what was seen; at most as far as a frame looks that small."""
        focal_px = self._camera.focal_px
        pose = self._camera.pose(position_m, attitude_arena)
        left, up = -(box.e + box.w) / 2 / focal_px, (box.n + box.s) / 2 / focal_px
        x, y, z = to_world(pose.rotation, 1.0, left, up)
        length = hypot(x, y, z)
        size = max((box.n - box.s) / FRAME_HEIGHT_M, (box.e - box.w) / FRAME_WIDTH_M, 1.0)
        farthest_m = _SPARE * focal_px / size + _SPARE_M
        return LineOfSight(pose.position_m, (x / length, y / length, z / length), farthest_m=farthest_m)
