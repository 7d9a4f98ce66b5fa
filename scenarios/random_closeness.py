"""Frames that are near each other and the arena's border, and can be flown through all the same."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from math import ceil, cos, dist, sin

from pydantic import Field

from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import Vec3
from scenarios.models import Arena, Base, Frame
from scenarios.part import Part

_STEP_M = 0.05  # between the points of a way that are checked


class Closeness(Part):
    """How near frames are, and the straight way through each, along its normal, from one side at least."""

    border_m: float = Field(
        ge=0.01,
        le=100,
        description="the centre of each frame is this near a side of the arena, floor or ceiling",
    )
    together_m: float = Field(
        ge=0.01, le=100, description="the centres of two frames are this near each other"
    )
    apart_m: float = Field(
        ge=0.01, le=100, description="minimum distance of any two frames' centres, in space"
    )
    before_m: float = Field(ge=0.01, le=5, description="length of the way before the opening")
    behind_m: float = Field(ge=0.01, le=5, description="length of the way behind the opening")
    clear_m: float = Field(
        ge=0.01, le=5, description="from the way to the arena's border, the base and the other frames"
    )

    def allows(self, centres_arena_m: Sequence[Vec3]) -> bool:
        """Whether frames with these centres are as near as they should be, and no nearer."""
        gaps_m = [dist(*pair) for pair in itertools.combinations(centres_arena_m, 2)]
        if not self.apart_m < min(gaps_m) <= self.together_m:
            return False
        return all(_from_border_m(centre_m) <= self.border_m for centre_m in centres_arena_m)

    def leaves_ways(self, base: Base, frames: Sequence[Frame]) -> bool:
        """Whether each frame has a free straight way through it."""
        return all(
            self._has_way(frame, [base.solid, *(other.hull for other in frames if other is not frame)])
            for frame in frames
        )

    def _has_way(self, frame: Frame, solids: Sequence[Solid]) -> bool:
        x_m, y_m, z_m = frame.position_arena_m
        along_x, along_y = cos(frame.yaw_rad), sin(frame.yaw_rad)
        steps = ceil((self.before_m + self.behind_m) / _STEP_M)
        way_m = [min(step * _STEP_M - self.before_m, self.behind_m) for step in range(steps + 1)]
        ways = [
            [(x_m + side * at_m * along_x, y_m + side * at_m * along_y, z_m) for at_m in way_m]
            for side in (1, -1)
        ]
        return any(
            all(
                _from_border_m(point_m) >= self.clear_m
                and all(solid.distance_m(point_m) >= self.clear_m for solid in solids)
                for point_m in way
            )
            for way in ways
        )


def _from_border_m(point_m: Vec3) -> float:
    """Distance of a point to the nearest side of the arena, floor or ceiling, below zero outside."""
    arena = Arena()
    x_m, y_m, z_m = point_m
    return min(
        arena.length_x_m / 2 - abs(x_m),
        arena.width_y_m / 2 - abs(y_m),
        z_m,
        arena.height_m - z_m,
    )
