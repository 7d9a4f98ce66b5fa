"""The monitor's own referee, for a drone that brings none: it follows telemetry and sees no contacts."""

from __future__ import annotations

from collections.abc import Callable

from geometry.vectors import Quaternion, Vec3
from monitor.ports import Referee
from monitor.standing import Standing
from scenarios.models import Scenario
from scenarios.truth import TrueState


class OwnReferee:
    """Judges one try after the other.

    Args:
        scenario: what is flown.
        make_referee: a referee for one try.
    """

    def __init__(self, scenario: Scenario, make_referee: Callable[[Scenario], Referee]) -> None:
        self.scenario = scenario
        self._make = make_referee
        self._referee = make_referee(scenario)
        self._armed = False
        self._followed = False

    def follow(
        self,
        time_us: int,
        position_arena_m: Vec3,
        velocity_arena_m_s: Vec3,
        attitude: Quaternion,
        armed: bool,
    ) -> None:
        """Take a state as telemetry tells it.

        Args:
            time_us: vehicle time.
            position_arena_m: shape (3,).
            velocity_arena_m_s: shape (3,).
            attitude: unit quaternion (w, x, y, z), body FLU to arena.
            armed: motors on.
        """
        if armed and not self._armed and self._referee.snapshot().over:
            self._referee = self._make(self.scenario)
        self._armed = armed
        self._followed = True
        self._referee.update(TrueState(time_us, position_arena_m, velocity_arena_m_s, attitude, armed))

    def standing(self) -> Standing | None:
        """How the try stands; None if nothing was followed yet."""
        if not self._followed:
            return None
        referee = self._referee
        return Standing(self.scenario.name, "telemetry", referee.snapshot(), referee.report().as_dict())
