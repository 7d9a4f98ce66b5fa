"""The fence that a vehicle gets for one flight: around the box in which the app keeps it.

The app's box acts first. The vehicle's own fence is a little larger and acts when the app fails.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from framerunner.geometry.axes import ArenaAlignment
from framerunner.geometry.vectors import Vec3
from offboard.limits import Box

BEYOND_BOX_M = 0.3
"""How far outside the box the fence is: as far as the app still counts as kept in."""


@dataclass(frozen=True, slots=True)
class FlightFence:
    """A fence.

    Attributes:
        corners_arena_m: x, y of its corners, in order.
        height_m: its top above the place of the start.
        radius_m: from the start to its farthest corner.
    """

    corners_arena_m: tuple[tuple[float, float], ...]
    height_m: float
    radius_m: float

    def corners_ned_m(self, alignment: ArenaAlignment) -> tuple[Vec3, ...]:
        """Its corners in the vehicle's local frame, at the height of the arena's floor."""
        return tuple(alignment.to_ned((x, y, 0.0)) for x, y in self.corners_arena_m)


def flight_fence(box: Box, start_arena_m: Vec3) -> FlightFence:
    """The fence around a box.

    Args:
        box: in which the app keeps the drone.
        start_arena_m: where the drone stands, which is its home.
    """
    (x0, y0, _), (x1, y1, top_m) = box.low_m, box.high_m
    x0, y0, x1, y1 = x0 - BEYOND_BOX_M, y0 - BEYOND_BOX_M, x1 + BEYOND_BOX_M, y1 + BEYOND_BOX_M
    corners = ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
    start_x, start_y, start_z = start_arena_m
    radius_m = max(hypot(x - start_x, y - start_y) for x, y in corners)
    return FlightFence(corners, round(top_m + BEYOND_BOX_M - start_z, 2), round(radius_m, 2))
