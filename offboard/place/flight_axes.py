"""The axes in which paths are flown: those of the arena, but continuous when the estimated place jumps.

A correction of the place moves the drone and the gates that it has seen together, by centimetres, or by
decimetres when it has not seen anything for long. A path that was planned before would then lead past the
opening. So the axes move along first, and come back to the arena's slowly, or when the drone is away from the
gate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import dist, exp, inf

from framerunner.geometry.vectors import Vec3
from offboard.drone import DroneState

BACK_S = 0.3  # time constant in which the axes come back to the arena's
NEAR_M = 2.0  # nearer to the gate that is crossed they do not, so that its path stays in its opening
AT_GATE_M = 0.75  # nearer to it they move with the gate, not with the drone: the drone is brought to the path


@dataclass(frozen=True, slots=True)
class DroneAndGates:
    """Where the drone is estimated to be, and gates by colour; arena axes."""

    drone_m: Vec3
    gates_m: Mapping[str, Vec3]


class FlightAxes:
    """Where a place in the arena is in the axes of flight.

    Attributes:
        offset_m: what to add to a place in the arena.
    """

    def __init__(self) -> None:
        self.offset_m: Vec3 = (0.0, 0.0, 0.0)
        self._gate = ""
        self._time_us: int | None = None

    def stay_by(self, colour: str) -> None:
        """The drone is flown by a gate until the next correction."""
        self._gate = colour

    def correct(self, before: DroneAndGates, after: DroneAndGates, time_us: int) -> None:
        """Take in by what the estimate was corrected at a tick.

        Args:
            before: as it was expected at this time.
            after: as it is estimated.
            time_us: vehicle time.
        """
        step_s = 0.0 if self._time_us is None else (time_us - self._time_us) * 1e-6
        gate_m, gate_after_m = before.gates_m.get(self._gate), after.gates_m.get(self._gate)
        by_m, away_m = _minus(after.drone_m, before.drone_m), inf
        if gate_m is not None and gate_after_m is not None:
            away_m = dist(after.drone_m, gate_after_m)
            by_m = _minus(gate_after_m, gate_m) if away_m < AT_GATE_M else by_m
        kept = 1.0 if away_m < NEAR_M else exp(-step_s / BACK_S)
        x, y, z = _minus(self.offset_m, by_m)
        self.offset_m = (kept * x, kept * y, kept * z)
        self._time_us, self._gate = time_us, ""

    def of(self, place_m: Vec3) -> Vec3:
        """A place in the arena, in the axes of flight."""
        (x, y, z), (dx, dy, dz) = place_m, self.offset_m
        return (x + dx, y + dy, z + dz)

    def of_state(self, state: DroneState) -> DroneState:
        """The drone's state in the axes of flight, which are the arena's if the vehicle knows its place."""
        if not any(self.offset_m):
            return state
        x, y, z = self.of((state.x, state.y, state.z))
        return replace(state, x=x, y=y, z=z)


def _minus(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
