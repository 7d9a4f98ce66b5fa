"""When and where a path passes through the opening of a frame."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, sin
from typing import Literal

from geometry.vectors import Vec3
from scenarios.models import Frame

Side = Literal["front", "back"]


@dataclass(frozen=True, slots=True)
class Passage:
    """One passage through an opening.

    Attributes:
        fraction: where on the last step the plane was met, 0 (its start) to 1 (its end).
        offset_m: distance from the opening's centre, in the frame's plane.
        side: the side it came from; the front is where the frame's normal (its local x axis) points.
    """

    fraction: float
    offset_m: float
    side: Side


class Gate:
    """Follows a path past one frame.

    A step passes when its start is on one side of the frame's plane, its end on the other, and the straight
    line between meets the plane inside the opening. A point exactly in the plane belongs to the side the path
    came from, so touching the plane and going back is no passage, and a path cut into more steps passes as
    often as before. Only the drone's centre counts: what its edges touch is the business of contacts.
    """

    __slots__ = (
        "_centre",
        "_cos",
        "_distance_m",
        "_half_height_m",
        "_half_width_m",
        "_offset_m",
        "_side",
        "_sin",
    )

    def __init__(self, frame: Frame) -> None:
        width_m, height_m = frame.opening_m
        self._half_width_m = width_m / 2
        self._half_height_m = height_m / 2
        self._centre = frame.position_arena_m
        self._cos = cos(frame.yaw_rad)
        self._sin = sin(frame.yaw_rad)
        self._offset_m = self._cos * frame.x_m + self._sin * frame.y_m
        self._side = 0  # 1 front, -1 back, 0 not known yet
        self._distance_m = 0.0

    def forget(self) -> None:
        """Start a new path: the next point is not joined to the last one."""
        self._side = 0

    @property
    def distance_m(self) -> float:
        """From the last point to the frame's plane; as long as the path is shorter, it cannot pass."""
        return abs(self._distance_m)

    def follow(self, start_m: Vec3, end_m: Vec3) -> Passage | None:
        """Go one step on.

        Args:
            start_m: the end of the last step, arena axes, shape (3,).
            end_m: where the drone is now, arena axes, shape (3,).

        Returns:
            The passage, if this step passes through the opening.
        """
        before_m = self._cos * start_m[0] + self._sin * start_m[1] - self._offset_m
        now_m = self._cos * end_m[0] + self._sin * end_m[1] - self._offset_m
        self._distance_m = now_m
        came_from = self._side
        if now_m == 0.0 or ((came_from > 0.0) == (now_m > 0.0) and came_from):
            return None
        self._side = 1 if now_m > 0.0 else -1
        if came_from == 0:
            return None
        fraction = before_m / (before_m - now_m)
        x_m, y_m, z_m = (a + fraction * (b - a) for a, b in zip(start_m, end_m, strict=True))
        lateral_m = self._cos * (y_m - self._centre[1]) - self._sin * (x_m - self._centre[0])
        vertical_m = z_m - self._centre[2]
        if abs(lateral_m) > self._half_width_m or abs(vertical_m) > self._half_height_m:
            return None
        return Passage(fraction, hypot(lateral_m, vertical_m), "front" if came_from > 0 else "back")
