"""Plans a path through gates and past points, clear of all obstacles.

In this order: `route` chooses sides and speeds, `detours` finds clear legs, `timing` makes one smooth path.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from offboard.navigation.goals import FlightStyle, Gate, Goal, Motion, Obstacles, Point, Refusal
from offboard.navigation.path import Path
from offboard.navigation.planner.clearance import Clearance
from offboard.navigation.planner.detours import LegFinder
from offboard.navigation.planner.legs import Leg
from offboard.navigation.planner.route import Pass, RouteFinder
from offboard.navigation.planner.timing import Stretch, headings, run_in, sample, slowed
from scenarios.models import Arena

LIFT_OFF_M_S = 0.5  # when the base is left below
LIFT_OFF_SPARE_M = 0.02
STOPPING_M = 0.5  # behind a last gate the drone stops in this distance


def plan(
    start: Motion,
    goals: Sequence[Goal],
    *,
    obstacles: Obstacles,
    arena: Arena,
    style: FlightStyle,
    previous: Path | None = None,
) -> Path | Refusal:
    """The fastest path found from a motion through all goals in order; it ends at rest.

    Args:
        start: the motion now; for a continuous flight that of the path flown now, `Path.at`.
        goals: at least one.
        obstacles: what must not be touched; frames to be crossed belong to them.
        arena: its sides and ceiling.
        style: how boldly to fly.
        previous: the path flown now; without a reason, gates are crossed from the same sides.

    Returns:
        The path, or why there is none.
    """
    if not goals:
        return Refusal("there is no goal to fly to")
    clearance = Clearance(obstacles, arena, style)
    position, velocity = run_in(start, style)
    begin = replace(start, position_m=tuple(position.tolist()), velocity_m_s=tuple(velocity.tolist()))
    crossings = () if previous is None else previous.crossings
    route, reason = RouteFinder(clearance, style).find(begin, goals, crossings)
    if not route:
        return Refusal(reason)
    if clearance.on_base(route[0].exit_m) and not clearance.on_base(route[1].entry_m):
        route.insert(1, _lift_off(route[0], clearance))
    stretches = _stretches(_with_stop(route), LegFinder(clearance, style))
    if stretches is None:
        return Refusal("obstacles block the way to the next goal")
    samples = sample(stretches, start, style)
    yaw, yaw_rate = headings(samples, stretches, start, style)
    return slowed(samples, yaw, yaw_rate, stretches, style)


def _with_stop(route: list[Pass]) -> list[Pass]:
    """The route with a place to stop behind a last gate."""
    last = route[-1]
    if not isinstance(last.goal, Gate):
        return route
    speed = float(np.linalg.norm(last.velocity_m_s))
    place = last.exit_m + last.velocity_m_s / speed * min(STOPPING_M, speed)
    stop = Point((float(place[0]), float(place[1]), float(place[2])), last.yaw_rad)
    return [*route, Pass(stop, place, place, np.zeros(3), 0.0, last.yaw_rad, 0.0)]


def _lift_off(start: Pass, clearance: Clearance) -> Pass:
    """Straight up from the base before anything else."""
    place = np.array([start.exit_m[0], start.exit_m[1], clearance.base_top_m + LIFT_OFF_SPARE_M])
    return Pass(None, place, place, np.array([0.0, 0.0, LIFT_OFF_M_S]), 0.0, start.yaw_rad, 0.0)


def _stretches(route: list[Pass], finder: LegFinder) -> list[Stretch] | None:
    stretches: list[Stretch] = []
    for before, after in pairwise(route):
        legs = finder.legs(before, after)
        if legs is None:
            return None
        gate = after.goal if isinstance(after.goal, Gate) else None
        look = None if gate is None else np.array(gate.centre_m)
        stretches += [Stretch(leg, after.goal, False, after.yaw_rad, look) for leg in legs]
        if gate is not None and not after.inner_s:  # the gate has been entered already
            stretches[-1] = Stretch(legs[-1], gate, True, after.yaw_rad, None)
        elif gate is not None:
            stretches.append(Stretch(_through(after), gate, True, after.yaw_rad, None))
    return stretches


def _through(crossing: Pass) -> Leg:
    """The straight, even flight from a gate's entry to its exit."""
    still = np.zeros((3, 3))
    still[1] = crossing.inner_s
    return Leg(crossing.entry_m, (1.0, 0.0), crossing.velocity_m_s, np.zeros(3), still, crossing.inner_s)
