"""Flies to goals: plans a path, plans again when the map has changed, and follows it.

What stands in the way, or may stand where nothing has been seen yet, stops the drone: it turns to look there,
and goes on when the way is free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import dist, hypot, pi, remainder

from framerunner.geometry.vectors import Vec3
from offboard.drone import DroneState, VelocityFluCommand
from offboard.limits import CommandLimits
from offboard.navigation.control.stuck_detector import StuckDetector
from offboard.navigation.following import PathFollower
from offboard.navigation.goals import FlightStyle, Goal, Motion, Obstacles, PathGate, Refusal
from offboard.navigation.path import Path
from offboard.navigation.planner.clearance import SAME_GATE_M
from offboard.navigation.planner.passages import load_graphs
from offboard.navigation.planning import Search, obstructed
from offboard.navigation.search.lookout import Lookout, turn_to
from offboard.navigation.seen_space import SeenSpace, ViewedSpace
from offboard.response.estimate import Response
from scenarios.models import Arena

STILL = VelocityFluCommand()
RESTART_M = 0.28  # farther from its path, the drone's own motion is planned from
MAX_REFUSALS = 3  # in a row, until the drone stops
SAME_M = 0.004  # between two estimates of the gate that is crossed, for which the path stays as it is,
SAME_SHARE = 0.005  # or this share of its distance: there is time to plan again when it is nearer
NEARLY_SAME_M = 0.04  # likewise of the other gates
SAME_RAD_M = 1.0  # likewise of headings, for each metre
STILL_GOOD_M = 0.02  # an estimate that has moved less lets a path through it be kept, if another one is later
LATER_S = 0.5  # by this
ELSEWHERE_M = 0.08  # a gate that has moved by more, or turned, must not be flown through on the present path
AHEAD_S = 0.7  # of the path that must be free, beside the vehicle's lag: it is long enough to stop
LOOK_AHEAD_S = 2.0  # likewise; the drone turns in flight to look at what it has not seen there
AHEAD_STEP_S = 0.1
CHECK_S = 0.2  # between two checks that a path is free, if neither it nor the obstacles have changed
WAITING_REPLAN_S = 0.2  # between two attempts to go on
TICK_WORK = 160_000
"""Of planning in one tick, in the unit of `LegFinder`: some milliseconds of a processor. Then it pauses, so
that no command is late; most paths need less."""
MAX_LOOK_S = 0.6  # at a place; if it is not seen then, something stands there
LOOKED_AT_RAD = 0.3
LOOK_GAIN_PER_S = 2.0
LOOK_RAD_S = 0.9
STOPPED_M_S = 0.2
KEEP_MODEL_S = (-0.5, 2.0)  # to a gate, less than 0 behind it: then the vehicle's model is kept


class PathFlight:
    """One path after another, each from the motion that the last one has then.

    Attributes:
        path: the one that is flown; None while the drone stops or stands still.
        refusal: why the last planning found none; empty if it did.
        watched: the place that stopped the drone, which now looks there; None if none did.
        search: the one for a path that goes on at the next tick; None if none does.
        work: done at the last tick, in the unit of `LegFinder`.
        spent: of the next tick's work, on something else.
        arena: paths stay in it.
    """

    def __init__(self, arena: Arena, style: FlightStyle, limits: CommandLimits) -> None:
        self.path: Path | None = None
        self.refusal = ""
        self.watched: Vec3 | None = None
        self.search: Search | None = None
        self.work = self.spent = 0
        load_graphs()
        self.arena = arena
        self._usual_style = style
        self._follower = PathFollower(limits=limits)
        self._left: Path | None = None  # which the drone stops on
        self._anew = False  # the path begins with the drone's own motion
        self._lookout = Lookout(arena, style)
        self._response = Response()  # that the style is for
        self._style = style.adapted(self._response)
        self._planned_for: tuple[tuple[Goal, ...], Obstacles] | None = None
        self._checked: tuple[Path, int, tuple[Vec3, ...]] | None = None  # and which obstacles there were
        self._checked_s = 0.0
        self._tried_s = -style.replan_s
        self._refusals = 0
        self._stuck = StuckDetector()
        self._looks_aside = False  # and not where its path says
        self._watched_s = 0.0  # when the drone began to look there

    def learn(self, state: DroneState, sent: VelocityFluCommand | None) -> None:
        """How the vehicle responds, from the command that it had since the last tick; call every tick."""
        self._follower.observe(state, state.time_us * 1e-6, sent, near_gate=self._is_near_gate())
        response = self._follower.estimate.response
        if response != self._response:
            self._response = response
            self._style = self._usual_style.adapted(response)
            self._planned_for = self.search = None

    def _is_near_gate(self) -> bool:
        """Whether the path crosses a gate so soon that another model of the vehicle would disturb that."""
        if self.path is None:
            return False
        now_s, (first_s, last_s) = self._follower.progress_on(self.path), KEEP_MODEL_S
        return any(first_s < crossing.time_s - now_s < last_s for crossing in self.path.crossings)

    def stop(self) -> None:
        """Leave the path."""
        self.path = self.watched = self._left = None
        self._stuck.forget()
        self._lookout.leave()
        self.change()

    @property
    def looks(self) -> bool:
        """The drone has left its path to look at a place on it."""
        return self.watched is not None or self._lookout.active

    def change(self) -> None:
        """Plan at the next tick, for other goals."""
        self._planned_for = self.search = None
        self._tried_s = -self._style.replan_s

    def fly(
        self,
        goals: Sequence[Goal],
        obstacles: Obstacles,
        state: DroneState,
        seen: SeenSpace,
        viewed: ViewedSpace,
    ) -> VelocityFluCommand:
        """Plan again if that is due and goals or obstacles have changed; the command for this tick."""
        self.work, self.spent = self.spent, 0
        goals = self._goals_now(goals, state)
        looking = self._lookout.command(state, viewed)
        if looking is not None:
            return self._look_out(looking, state, seen)
        now_s = state.time_us * 1e-6
        if self.watched is not None and not seen.is_seen(self.watched):
            turn_rad = turn_to(self.watched, state)
            if abs(turn_rad) > LOOKED_AT_RAD:
                self._watched_s = now_s
            if now_s - self._watched_s < MAX_LOOK_S:
                return self._stand(state, _look_rate(turn_rad))
            seen.suspect(self.watched)
        self.watched = None
        checked = self._plan_if_due(goals, obstacles, state)
        if self.path is not None and seen.has_obstacles:
            self.watched = seen.first_unseen(self._ahead(AHEAD_S), position_now(state))
            if self.watched is not None:
                self.leave()
                self._watched_s = now_s
                return self._stand(state, _look_rate(turn_to(self.watched, state)))
        self._looks_aside = False
        to_gate = isinstance(goals[0], PathGate)
        if (
            checked
            and self._style.looks_ahead
            and self._lookout.begin(self._ahead(AHEAD_S + CHECK_S), state, viewed)
        ):
            self.leave()
            return self._look_out(self._lookout.command(state, viewed) or STILL, state, seen)
        if self.path is not None and seen.has_obstacles and not to_gate:
            later = seen.first_unseen(self._ahead(LOOK_AHEAD_S), position_now(state))
            if later is not None:
                self._looks_aside = True
                return self.follow(state, _look_rate(turn_to(later, state)))
        return self.follow(state)

    def _look_out(
        self, command: VelocityFluCommand, state: DroneState, seen: SeenSpace
    ) -> VelocityFluCommand:
        """The lookout's command; among obstacles the drone first stops on its path, and stays where it is."""
        if not seen.has_obstacles:
            self._left = None
            return command
        if self._left is not None and hypot(*state.velocity_arena_m_s) > STOPPED_M_S:
            return self._stand(state, command.yaw_rate_rad_s)
        self._left = None
        return replace(command, forward_m_s=0.0, left_m_s=0.0)

    def _plan_if_due(self, goals: Sequence[Goal], obstacles: Obstacles, state: DroneState) -> bool:
        """Plan again if goals or obstacles have changed, or stand in the way; whether that was checked."""
        now_s, begun = state.time_us * 1e-6, False
        if self.search is not None:
            self._go_on(self.search, state)
        elif now_s - self._tried_s >= (self._style.replan_s if self.path is not None else WAITING_REPLAN_S):
            planned_for = (tuple(goals), obstacles)
            off = self._stuck.is_held or self._follower.error_m > RESTART_M
            if self.path is None or off or _differ(planned_for, self._planned_for, position_now(state)):
                self._tried_s, begun = now_s, True
                self._plan(goals, obstacles, state)
        checked = self._must_check(obstacles, now_s)
        if checked and self._is_obstructed(obstacles):
            search = self.search
            searched_for = None if search is None else (search.goals, search.obstacles)
            if not begun and _differ((goals, obstacles), searched_for, position_now(state)):
                self._plan(goals, obstacles, state)
            if self._is_obstructed(obstacles):
                self.leave()
        return checked

    def follow(self, state: DroneState, turn_rad_s: float | None = None) -> VelocityFluCommand:
        """The command for this tick on the present path; without one, to stop.

        Args:
            state: of the drone.
            turn_rad_s: turn with this rate, not as the path says.
        """
        if self.path is None:
            return self._stand(state, turn_rad_s or 0.0)
        now_s = state.time_us * 1e-6
        if self._anew:  # not before: until then the drone may brake on the path that it has left
            self._follower.begin()
        self._left, self._anew = None, False
        return self._follower.command(self.path, state, now_s, turn_rad_s=turn_rad_s)

    def leave(self) -> None:
        """Stop, on the path if it is flown already."""
        if not self._anew:
            self._left = self.path
        self.path = None

    def _stand(self, state: DroneState, turn_rad_s: float) -> VelocityFluCommand:
        """Stop, and turn."""
        if self._left is None:
            return VelocityFluCommand(yaw_rate_rad_s=turn_rad_s)
        now_s, brake_m_s2 = state.time_us * 1e-6, self._style.acceleration_m_s2
        return self._follower.command(self._left, state, now_s, turn_rad_s=turn_rad_s, brake_m_s2=brake_m_s2)

    def _goals_now(self, goals: Sequence[Goal], state: DroneState) -> Sequence[Goal]:
        """The goals, or for a drone that something holds a place on the way that it came."""
        back, now_s = self._stuck.back, state.time_us * 1e-6
        has_path = self.path is not None
        self._stuck.observe(
            position_now(state),
            now_s,
            self._follower.error_m,
            has_path=has_path,
            has_way=has_path or self.looks,
        )
        if self._stuck.back is not back:
            self.change()
        return goals if self._stuck.back is None else [self._stuck.back]

    def _start(self, state: DroneState) -> tuple[Motion, bool]:
        """The motion to plan from, and whether it begins a path that does not continue the present one."""
        if self._follower.error_m <= RESTART_M and not self._stuck.is_held:
            flies = self.path is not None and not self._anew
            reference = self._follower.reference() if flies else None
            if reference is not None:
                turned = replace(reference, yaw_rad=state.yaw, yaw_rate_rad_s=0.0)
                return (turned if self._looks_aside else reference), False
            braking = self._follower.braking() if self._left is not None else None
            if braking is not None:
                return replace(braking, yaw_rad=state.yaw), True
        return self._follower.own_motion(state), True

    def _plan(self, goals: Sequence[Goal], obstacles: Obstacles, state: DroneState) -> None:
        """Begin to search for a path from the motion now."""
        self._stuck.planned(state.time_us * 1e-6)
        start, _ = self._start(state)
        arena, style = self.arena, self._style
        search = Search(start, goals, obstacles=obstacles, arena=arena, style=style, previous=self.path)
        self._go_on(search, state, begun=True)

    def _go_on(self, search: Search, state: DroneState, *, begun: bool = False) -> None:
        """Plan on for this tick; take the path when there is one.

        Args:
            search: for a path.
            state: of the drone.
            begun: the search begins now.
        """
        before = search.work
        search.advance(TICK_WORK - self.work)
        searched = search.work - before
        self.work += searched
        pauses = not search.over or (searched > 0 and self.work + search.path_work > TICK_WORK)
        self.search = search if pauses else None
        if pauses:
            return
        self.work += search.path_work
        start, restarts = self._start(state)
        found = search.path(None if begun else start)
        if found is None:  # the drone is elsewhere by now
            self.change()
            return
        if isinstance(found, Refusal):
            if found.goal > 0 and len(search.goals) > 1:
                self._plan(search.goals[:1], search.obstacles, state)
                return
            self.refusal = found.reason
            self._refusals += 1
            if self._refusals >= MAX_REFUSALS:
                self.leave()
            return
        self.refusal, self._refusals = "", 0
        if not restarts and self._delays(found, search.obstacles):
            return
        self.path = found if restarts else self._follower.continued(found)
        self._anew = restarts
        self._planned_for = (search.goals, search.obstacles)

    def _delays(self, found: Path, obstacles: Obstacles) -> bool:
        """Whether a new path is much later at the next gate than the present one, which is as good still."""
        path = self.path
        if path is None or self._is_obstructed(obstacles):
            return False
        now_s = self._follower.progress_on(path)
        coming = next((crossing for crossing in path.crossings if crossing.time_s > now_s), None)
        if coming is None or not found.crossings:
            return False
        later_s = found.crossings[0].time_s + self._follower.lead_s - (coming.time_s - now_s)
        return later_s > LATER_S and not _moved(found.crossings[0].gate, coming.gate, STILL_GOOD_M)

    def _ahead(self, time_s: float) -> list[Vec3]:
        """Where the drone will be on its path within a time, the vehicle's lag added."""
        path = self.path
        if path is None:
            return []
        now_s = self._follower.progress_on(path)
        steps = round((time_s + self._style.lag_s) / AHEAD_STEP_S)
        return [path.position_at_m(now_s + step * AHEAD_STEP_S) for step in range(steps + 1)]

    def _must_check(self, obstacles: Obstacles, now_s: float) -> bool:
        """Whether it is time to check that the path is free."""
        if self.path is None:
            return False
        what = (self.path, len(obstacles.gates), obstacles.columns_m)
        if what == self._checked and now_s - self._checked_s < CHECK_S:
            return False
        self._checked, self._checked_s = what, now_s
        return True

    def _is_obstructed(self, obstacles: Obstacles) -> bool:
        """Whether an obstacle is where the drone will be; the gates it flies through are none.

        A gate that turns out to be elsewhere, or turned, is one: the path does not lead through its opening.
        """
        if self.path is None:
            return False
        gates = [
            crossing.gate
            for crossing in self.path.crossings
            if not any(
                dist(gate.centre_m, crossing.gate.centre_m) < SAME_GATE_M
                and _moved(gate, crossing.gate, ELSEWHERE_M)
                for gate in obstacles.gates
            )
        ]
        places_m = self._ahead(AHEAD_S + CHECK_S)
        return obstructed(places_m, gates, obstacles=obstacles, arena=self.arena, style=self._style)


def position_now(state: DroneState) -> Vec3:
    """Where the drone is at the state's time."""
    vx, vy, vz = state.velocity_arena_m_s
    age_s = state.position_age_s
    return (state.x + vx * age_s, state.y + vy * age_s, state.z + vz * age_s)


def _look_rate(turn_rad: float) -> float:
    """How fast to turn, to look aside by an angle."""
    return min(max(LOOK_GAIN_PER_S * turn_rad, -LOOK_RAD_S), LOOK_RAD_S)


def _differ(
    a: tuple[Sequence[Goal], Obstacles], b: tuple[Sequence[Goal], Obstacles] | None, from_m: Vec3
) -> bool:
    """Whether goals or obstacles differ by more than the map's noise, as seen from a place."""
    if b is None or len(a[0]) != len(b[0]) or len(a[1].gates) != len(b[1].gates):
        return True
    if a[1].columns_m != b[1].columns_m:
        return True
    first = a[0][0]
    away_m = dist(first.centre_m if isinstance(first, PathGate) else first.position_m, from_m)
    if _moved(first, b[0][0], max(SAME_M, SAME_SHARE * away_m)):
        return True
    other = [*zip(a[0][1:], b[0][1:], strict=True), *zip(a[1].gates, b[1].gates, strict=True)]
    return any(_moved(*pair, NEARLY_SAME_M) for pair in other)


def _moved(a: Goal, b: Goal, same_m: float) -> bool:
    if isinstance(a, PathGate) and isinstance(b, PathGate):
        turned = abs(remainder(a.yaw_rad - b.yaw_rad, pi))
        return dist(a.centre_m, b.centre_m) > same_m or turned > same_m * SAME_RAD_M
    return a != b
