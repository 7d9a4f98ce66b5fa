"""What the true motion of each airframe never exceeds, by the class of its mission, and the bound from it.

The numbers were found by searching for the command sequences that exceed most, in JSBSim, and are a tenth
to a third above the highest found; docs/bound.md says how. `tests/framerunner/flying/test_envelopes.py` flies
the worst sequences found and random ones, and fails if any exceeds them.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import floor, sqrt

from framerunner.errors import UserError
from framerunner.flying.plan import FlightPlan
from scenarios.bound import Bound, Envelope, Fall, Reach, lower_bound
from scenarios.models import MissionClass

ENVELOPES: Mapping[tuple[str, MissionClass], Envelope] = {
    # +-1 m/s on each axis of the drone, which at a yaw of 45 degrees to its way is sqrt(2) m/s in plan.
    ("abejorro", "contest"): Envelope(
        level=Reach(sqrt(2.0), 0.9, 2.75),
        up=Reach(1.0, 0.6, 2.4),
        down=Reach(1.0, 0.35, 1.9),
        total_excess_m=0.5,
        fall=Fall(level_m=0.45, level_per_m=0.8, longest_m=2.6, deepest_m=4.2, rise_m=0.3),
    ),
    # The airframe's `level_speed_m_s` and its limits of climb and descent.
    ("abejorro", "open"): Envelope(
        level=Reach(1.7484, 1.0, 3.1),
        up=Reach(1.5, 0.8, 3.3),
        down=Reach(1.0, 0.4, 2.0),
        total_excess_m=1.0,
        fall=Fall(level_m=0.55, level_per_m=0.8, longest_m=2.7, deepest_m=4.3, rise_m=0.4),
    ),
}
"""By airframe and class of the mission."""


class EnvelopeError(UserError):
    """There is no bound: of this airframe, or of flights in wind, no motion was measured."""


def bound_of(plan: FlightPlan, mission_class: MissionClass) -> Bound:
    """The lower bound of a try of a plan's scenario; takes some milliseconds.

    Raises:
        EnvelopeError: there is no envelope of this airframe, or the scenario has wind.
        ScenarioError: the scenario has no gates.
    """
    airframe = plan.scenario.airframe
    envelope = ENVELOPES.get((airframe, mission_class))
    if envelope is None:
        known = ", ".join(sorted({name for name, _ in ENVELOPES}))
        raise EnvelopeError(f"airframe {airframe}: its motion was not measured, so no bound; use {known}")
    if plan.scenario.wind.blows:
        raise EnvelopeError(
            f"{plan.scenario.name}: wind pushes a drone beyond its limits, so no bound; leave wind out"
        )
    return lower_bound(plan.layout, plan.start_pose[:3], plan.airframe.envelope_m[2], envelope)


def bound_s(plan: FlightPlan, mission_class: MissionClass) -> float | None:
    """The bound in whole milliseconds, rounded down so that it stays one; None if there is none."""
    try:
        return floor(bound_of(plan, mission_class).time_s * 1000.0) / 1000.0
    except UserError:
        return None
