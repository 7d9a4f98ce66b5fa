"""Plans a path through gates and past points, clear of all obstacles.

In this order: `route` chooses sides and speeds, `detours` finds clear legs, `timing` makes one smooth path.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import replace
from itertools import pairwise
from math import dist, hypot, sqrt

import numpy as np

from framerunner.geometry.vectors import Vec3
from offboard.navigation.goals import FlightStyle, Goal, Motion, Obstacles, PathGate, Refusal
from offboard.navigation.path import Crossing, Path
from offboard.navigation.planner.clearance import DRONE_RADIUS_M, SAME_GATE_M, Clearance, gate_reach_m
from offboard.navigation.planner.detours import MOST_WORK, LegFinder, PlannedLeg, Steps, open_ended
from offboard.navigation.planner.legs import Array, Connector, Leg
from offboard.navigation.planner.route import BLOCKED_S, Pass, RouteFinder, place
from offboard.navigation.planner.timing import Stretch, headings, run_in, sample, slowed
from scenarios.models import Arena

LIFT_OFF_M_S = 0.5  # when the base is left below
LIFT_OFF_M_S2 = 0.4  # acceleration to that speed, also of vehicles that answer late
LIFT_OFF_SPARE_M = 0.02
LEAVE_OPENING_M_S = 0.3  # of a drone that was stopped in a gate's opening
STOPPING_M = 0.5  # behind a last gate the drone stops in this distance,
STOPPING_SHARES = np.array([1.0, 0.7, 0.5, 0.3, 0.15])  # or in the largest of these shares that is clear
USED_MARGIN_M = 0.05  # of the margin to obstacles, while a path is flown
MAX_ROUTES = 6  # for which legs are sought
SLOWER_S = 0.3  # legs slower than expected by this make another route worth a look
PATH_WORK = 15_000  # of making the path that was found, in the unit of `LegFinder`,
PATH_WORK_PER_S = 4_000  # and of each second of it
SAME_START_M = 0.02  # a drone that stands drifts less while a path is sought,
SAME_START_M_S = 0.05  # and moves more slowly

_Route = tuple[list[Pass], list[Steps]]


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
        obstacles: what must not be touched; gates to be crossed belong to them.
        arena: its sides and ceiling.
        style: how boldly to fly.
        previous: the path flown now; without a reason, gates are crossed from the same sides.

    Returns:
        The path, or why there is none.
    """
    search = Search(start, goals, obstacles=obstacles, arena=arena, style=style, previous=previous)
    while not search.over:
        search.advance(MOST_WORK)
    found = search.path()
    assert found is not None
    return found


class Search:
    """Looks for a path, which may take many ticks where obstacles block the way: a part of it at each.

    Args: as for `plan`.

    Attributes:
        goals: where the path leads.
        obstacles: that it keeps clear of.
        over: whether it has ended, so that `path` tells what was found.
        work: done so far, in the unit of `LegFinder`.
    """

    def __init__(
        self,
        start: Motion,
        goals: Sequence[Goal],
        *,
        obstacles: Obstacles,
        arena: Arena,
        style: FlightStyle,
        previous: Path | None = None,
    ) -> None:
        self.goals = tuple(goals)
        self.obstacles = obstacles
        self.over = False
        self._start = start
        self._style = style
        self._clearance = Clearance(obstacles, arena, style)
        self._connector = Connector(style)
        self._legs = LegFinder(self._clearance, self._connector, style)
        self._found: _Route | Refusal | None = None
        self._running = self._run(() if previous is None else previous.crossings)

    @property
    def work(self) -> int:
        """See the class."""
        return self._legs.work

    @property
    def path_work(self) -> int:
        """Of `path`, once the search is over."""
        if self._found is None or isinstance(self._found, Refusal):
            return 0
        duration_s = sum(step.leg.duration_s for steps in self._found[1] for step in steps or ())
        return PATH_WORK + round(PATH_WORK_PER_S * duration_s)

    def advance(self, work: int) -> None:
        """Go on until this much work is done, and little more, or the search is over."""
        until = self.work + work
        while not self.over and self.work < until:
            try:
                next(self._running)
            except StopIteration:
                self.over = True

    def path(self, start: Motion | None = None) -> Path | Refusal | None:
        """What was found.

        Args:
            start: where the drone is going to be now, if the search has taken some time; if it stands still,
                the path begins where the search did.

        Returns:
            The path, why there is none, or None if what was found is of no use from there.
        """
        route = self._found
        if route is None or isinstance(route, Refusal):
            return route
        if start is not None and not self._stands(start):
            route = self._from(start, *route)
            if route is None:
                return None
        else:
            start = self._start
        stretches = _stretches(*route)
        samples = sample(stretches, start, self._style)
        yaw, yaw_rate = headings(samples, stretches, start, self._style)
        return slowed(samples, yaw, yaw_rate, stretches, self._style)

    def _run(self, previous: Sequence[Crossing]) -> Generator[None, None, None]:
        """The search itself; it pauses after each part."""
        if not self.goals:
            self._found = Refusal("there is no goal to fly to")
            return
        finder = RouteFinder(self._clearance, self._connector, self._style)
        self._found = finder.prepare(self._begin(self._start), self.goals, previous)
        if self._found:
            return
        route = yield from _fastest(finder, self._legs, self._clearance)
        self._found = _refusal(*route) or route

    def _begin(self, start: Motion) -> Motion:
        position, velocity = run_in(start, self._style)
        (x, y, z), (vx, vy, vz) = position.tolist(), velocity.tolist()
        return replace(start, position_m=(x, y, z), velocity_m_s=(vx, vy, vz))

    def _stands(self, start: Motion) -> bool:
        """Whether the drone is where the search began, nearly at rest."""
        moved_m = dist(start.position_m, self._start.position_m)
        return moved_m < SAME_START_M and hypot(*start.velocity_m_s) < SAME_START_M_S

    def _from(self, start: Motion, route: list[Pass], found: list[Steps]) -> _Route | None:
        """The same from another start, where the way to the first place is as short."""
        steps = found[0]
        if steps is None or route[1].begun:
            return None
        begin = self._begin(start)
        at = place(np.array(begin.position_m), np.array(begin.velocity_m_s), begin.yaw_rad)
        leg = self._legs.clear_leg(at, steps[0].end)
        if leg is None or leg.duration_s > steps[0].leg.duration_s + SLOWER_S:
            return None
        return [at, *route[1:]], [[PlannedLeg(leg, steps[0].end), *steps[1:]], *found[1:]]


def obstructed(
    places_m: Sequence[Vec3],
    gates: Sequence[PathGate],
    *,
    obstacles: Obstacles,
    arena: Arena,
    style: FlightStyle,
) -> bool:
    """Whether obstacles are in the way of a path that was planned without them, or before they moved.

    What the first place is in does not count where later ones are no deeper, and the base never does.

    Args:
        places_m: on the path, from the drone on.
        gates: the gates that the path leads through.
        obstacles: as they are known now.
        arena: as for `plan`.
        style: as for `plan`; of its margin a part may be used up.
    """
    near = _near(places_m, obstacles, style)
    others = tuple(
        other
        for other in near.gates
        if all(dist(other.centre_m, gate.centre_m) >= SAME_GATE_M for gate in gates)
    )
    if not others and not near.columns_m:
        return False
    nearer = replace(style, bar_margin_m=style.bar_margin_m - USED_MARGIN_M)
    clearance = Clearance(replace(near, gates=others, base=None), arena, nearer)
    depths = clearance.depths(np.array(places_m))[:, :-1]
    return bool((open_ended(depths[None], ends=False) > 0.0).any())


def _near(places_m: Sequence[Vec3], obstacles: Obstacles, style: FlightStyle) -> Obstacles:
    """The gates and columns that may be in the way of some of these places, and perhaps some more."""
    first = places_m[0]
    span_m = max(dist(first, place_m) for place_m in places_m)
    column_m = span_m + DRONE_RADIUS_M + style.bar_margin_m
    x, y, _ = first
    return replace(
        obstacles,
        gates=tuple(
            gate
            for gate in obstacles.gates
            if dist(first, gate.centre_m) < span_m + gate_reach_m(gate.shape, style)
        ),
        columns_m=tuple(
            column
            for column in obstacles.columns_m
            if hypot(column[0] - x, column[1] - y) < column_m + column[2]
        ),
    )


def _fastest(
    finder: RouteFinder, leg_finder: LegFinder, clearance: Clearance
) -> Generator[None, None, _Route]:
    """The fastest route and its legs, which are None where obstacles block all routes.

    Legs are sought only for the route that seems fastest; the time they take corrects what seems so, until
    the fastest one stays the same (Dellin & Srinivasa, "A unifying formalism for shortest path problems with
    expensive edge evaluations via lazy best-first search", 2016).
    """
    best: tuple[float, list[Pass], list[Steps]] | None = None
    for _ in range(MAX_ROUTES):
        route, ways, expected_s = finder.best()
        full = _complete(route, clearance)
        legs = yield from leg_finder.route(full)
        before = full.index(route[1]) - 1  # a way out may come before the first leg
        times = [BLOCKED_S if found is None else sum(step.leg.duration_s for step in found) for found in legs]
        times[: before + 1] = [sum(times[: before + 1])]
        total_s = sum(times) + sum(float(one.inner_s[0] + one.costs_s[0]) for one in route)
        if best is None or total_s < best[0]:
            best = total_s, full, legs
        slower = [i for i, expected in enumerate(expected_s) if times[i] > expected + SLOWER_S]
        for leg in slower:
            finder.correct(leg, (ways[leg], ways[leg + 1]), min(times[leg], BLOCKED_S))
        if not slower or sum(expected_s) >= BLOCKED_S or leg_finder.work > MOST_WORK:
            break
    assert best is not None
    return best[1:]


def _complete(route: list[Pass], clearance: Clearance) -> list[Pass]:
    """The route with a way out of the base or opening that it starts in, and a stop behind a last gate."""
    start, end = route[0], route[-1]
    passes = list(route)
    from_m = start.exits.places_m[0]
    if clearance.on_base(from_m) and not clearance.on_base(route[1].entries.places_m[0]):
        up = np.array([from_m[0], from_m[1], clearance.base_top_m + LIFT_OFF_SPARE_M])
        # A drone that is over the base already has less way to speed up: more would need a run-up downwards.
        rise_m, climb_m_s = up[2] - from_m[2], max(float(start.exits.velocities_m_s[0, 2]), 0.0)
        fastest_m_s = sqrt(climb_m_s**2 + 2.0 * LIFT_OFF_M_S2 * max(rise_m, 0.0))
        passes.insert(1, place(up, np.array([0.0, 0.0, min(LIFT_OFF_M_S, fastest_m_s)]), start.yaw_rad))
    elif not route[1].begun:
        out = clearance.way_out(from_m, route[1].entries.places_m[0])
        if out is not None:
            at, direction = out
            speed = max(float(start.exits.velocities_m_s[0] @ direction), LEAVE_OPENING_M_S)
            passes.insert(1, place(at, speed * direction, start.yaw_rad))
    if isinstance(end.goal, PathGate):
        passes.append(place(_stop_behind(end, clearance), np.zeros(3), end.yaw_rad))
    return passes


def _stop_behind(crossing: Pass, clearance: Clearance) -> Array:
    """Where the drone stops behind a last gate: gently, unless something is behind it."""
    leave, velocity = crossing.exits.places_m[0], crossing.exits.velocities_m_s[0]
    speed = float(np.linalg.norm(velocity))
    stops = leave + STOPPING_SHARES[:, None] * min(STOPPING_M, speed) * velocity / speed
    clear = clearance.depths(stops).max(axis=1) <= 0.0
    farthest: Array = stops[int(clear.argmax()) if clear.any() else -1]
    return farthest


def _refusal(route: list[Pass], found: list[Steps]) -> Refusal | None:
    """Why there is no path, if one of the legs was not found."""
    passed: list[Goal] = []
    for after, steps in zip(route[1:], found, strict=True):
        if steps is None:
            gate = 1 + sum(isinstance(goal, PathGate) for goal in passed)
            what = f"gate {gate}" if isinstance(after.goal, PathGate) else "the next point"
            return Refusal(f"obstacles block the way to {what}", len(passed))
        if after.goal is not None:
            passed.append(after.goal)
    return None


def _stretches(route: list[Pass], found: list[Steps]) -> list[Stretch]:
    stretches: list[Stretch] = []
    for (_, after), steps in zip(pairwise(route), found, strict=True):
        goal = after.goal
        look = goal if isinstance(goal, PathGate) else None
        stretches += [Stretch(step.leg, goal, False, after.yaw_rad, look) for step in steps or ()]
        if not isinstance(goal, PathGate):
            continue
        if after.begun:
            stretches[-1] = replace(stretches[-1], crosses=True, look=None)
        else:
            stretches.append(Stretch(_through(after), goal, True, after.yaw_rad, None))
    return stretches


def _through(crossing: Pass) -> Leg:
    """The straight, even flight from a gate's entry to its exit."""
    duration_s = float(crossing.inner_s[0])
    phases = np.zeros((3, 3))
    phases[1] = duration_s
    entries = crossing.entries
    return Leg(entries.places_m[0], (1.0, 0.0), entries.velocities_m_s[0], np.zeros(3), phases, duration_s)
