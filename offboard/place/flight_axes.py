"""The axes in which paths are flown: those of the arena, but continuous when the estimated place jumps.

A correction of the place moves the drone and the gates that it has seen together, by centimetres, or by
decimetres when it has not seen anything for long. A path that was planned before would then lead past the
opening. So the axes move along first, and come back to the arena's slowly, or when the drone is away from the
gate.
"""

from __future__ import annotations

from math import exp

from framerunner.geometry.vectors import Vec3

BACK_S = 0.3  # time constant in which the axes come back to the arena's
NEAR_M = 2.0  # nearer to the gate that is crossed they do not, so that its path stays in its opening
AT_GATE_M = 0.75  # nearer to it they move with the gate, not with the drone: the drone is brought to the path


class FlightAxes:
    """Where a place in the arena is in the axes of flight.

    Attributes:
        offset_m: what to add to a place in the arena.
    """

    def __init__(self) -> None:
        self.offset_m: Vec3 = (0.0, 0.0, 0.0)

    def jump(self, by_m: Vec3, step_s: float, *, held: bool) -> None:
        """Take in a jump of the estimate.

        Args:
            by_m: of the drone, or of the gate to which the axes belong; arena axes.
            step_s: since the last call.
            held: the axes do not come back now.
        """
        kept = 1.0 if held else exp(-step_s / BACK_S)
        x, y, z = self.offset_m
        self.offset_m = (kept * (x - by_m[0]), kept * (y - by_m[1]), kept * (z - by_m[2]))

    def of(self, place_m: Vec3) -> Vec3:
        """A place in the arena, in the axes of flight."""
        (x, y, z), (dx, dy, dz) = place_m, self.offset_m
        return (x + dx, y + dy, z + dz)
