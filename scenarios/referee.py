"""The referee: follows the drone's states and judges the try."""

from __future__ import annotations

from enum import Enum
from math import isfinite

from framerunner.geometry.vectors import Vec3
from scenarios.crossing import Boundary, Passage, PathWatch
from scenarios.goals import GoalWatch
from scenarios.models import COLOURS, Scenario, TrueState, ground_height
from scenarios.result import RefereeReport, RefereeSnapshot, TimedPosition
from scenarios.touchdown import (
    HARD_HIT_M_S,
    TIPPED_OVER,
    CrashWatch,
    Landing,
    find_landing,
    is_resting,
    up_component,
)
from scenarios.verdict import TryFacts, judge

PENALTY_S_PER_S = 1.0  # outside the arena time counts double
_FLOWN_STEP_US = 100_000
CONTACT_GAP_US = 500_000  # a gate touched again sooner is still the same contact
TAKEN_OFF_M = 0.1  # rise that makes a take-off
IN_AIR_M = 0.3  # height above ground at which a try that begins is already a flight
REST_US = 300_000  # how long the drone must be still; a fall passes through zero speed for less
SETTLE_LIMIT_US = 2_000_000  # after this it counts as settled however it moves


class _Phase(Enum):
    WAITING = "the motors have not been on"
    FLYING = "motors on"
    STOPPED = "motors off, coming to rest"
    SETTLED = "motors off and at rest"


class Referee:
    """Judges one try.

    Call `update` with states at any rate, from the simulated truth or a real drone's telemetry (contacts
    empty). A try runs from motors on to motors off; motors on again before the drone has come to rest
    continues the same try, and motors off without a take-off lets a new one begin. It is over with a crash,
    past the limit, or at rest after a flight: later states change nothing.

    Crossings count while the motors are on. Only the first crossing of each gate counts; one crossed too
    early makes the order wrong, whatever follows. The order is red, green, blue, those that the scenario has.
    In a scenario with goals no gate has to be crossed, and crossings are not noted: its goals count instead.

    Args:
        scenario: what is flown.
        envelope_m: length, width and height of the drone.
        floor_m: height of the floor, arena axes; without a base it is where the base's top would be.
    """

    def __init__(self, scenario: Scenario, envelope_m: Vec3, floor_m: float = 0.0) -> None:
        self._scenario = scenario
        self._envelope_m = envelope_m
        self._floor_m = floor_m
        self._limit_us = round(scenario.try_limit_s * 1e6)
        self._boundary = Boundary(scenario.arena)
        crossable = () if scenario.goals else scenario.frames
        self._gates = sorted(crossable, key=lambda gate: COLOURS.index(gate.colour))
        self._expected = tuple(gate.colour for gate in self._gates)
        self._solids = scenario.solid_names
        self._ignored = 0
        self._over = False
        self._time_us = -1
        self._position_m: Vec3 = (0.0, 0.0, 0.0)
        self._phase = _Phase.WAITING
        self._reset()

    def _reset(self) -> None:
        """Forget the try, if there was one."""
        self._path = PathWatch(self._scenario.arena, self._gates)
        self._crash_watch = CrashWatch(self._scenario, self._envelope_m, self._floor_m)
        self._goals = GoalWatch(
            self._scenario.goals, {gate.colour: gate.position_arena_m for gate in self._scenario.frames}
        )
        self._start_us = 0
        self._start_height_m = 0.0
        self._stop_us: int | None = None
        self._still_since_us: int | None = None
        self._taken_off = False
        self._crossings: dict[str, tuple[float, Passage]] = {}  # seconds since motors on
        self._contacts: list[str] = []
        self._contacts_s: list[float] = []  # since motors on
        self._touched_us: dict[str, int] = {}
        self._wrong_order = ""
        self._crash = ""
        self._timed_out = False
        self._landing: Landing | None = None
        self._flown: list[TimedPosition] = []
        self._next_flown_us = 0

    @property
    def flown_path(self) -> tuple[TimedPosition, ...]:
        """Where the drone was in the try every 0.1 s: seconds since motors on, and arena metres."""
        return tuple(self._flown)

    def update(self, state: TrueState) -> None:
        """Take the next state. States that are not finite or go back in time are counted and ignored."""
        if self._over:
            return
        if state.time_us < self._time_us or not _is_finite(state):
            self._ignored += 1
            return
        phase = self._phase
        if phase is _Phase.FLYING:
            self._fly(state)
        elif phase is _Phase.STOPPED:
            self._come_to_rest(state)
        elif state.motors_on:
            self._begin(state)
        self._time_us = state.time_us
        self._position_m = state.position_arena_m

    def _begin(self, state: TrueState) -> None:
        """Start a try: the motors are on now."""
        self._reset()
        self._phase = _Phase.FLYING
        self._start_us = state.time_us
        x_m, y_m, z_m = state.position_arena_m
        self._start_height_m = z_m
        underside_m = z_m - self._envelope_m[2] / 2
        self._taken_off = underside_m - ground_height(self._scenario, x_m, y_m, self._floor_m) > IN_AIR_M
        self._path.restart(state.position_arena_m)
        self._watch(state)

    def _fly(self, state: TrueState) -> None:
        """Take the step from the last state, at which the motors were on."""
        position_m = state.position_arena_m
        step_us = state.time_us - self._time_us
        for colour, passage in self._path.follow(self._position_m, position_m, step_us):
            self._cross(colour, passage, step_us)
        if position_m[2] - self._start_height_m > TAKEN_OFF_M:
            self._taken_off = True
        if self._scenario.goals:
            self._goals.follow(state.time_us, position_m, state.attitude_arena)
        self._watch(state)
        if self._over:
            return
        if state.time_us - self._start_us > self._limit_us:
            self._timed_out = self._over = True
        elif not state.motors_on:
            self._phase = _Phase.STOPPED
            self._stop_us = state.time_us
            self._still_since_us = None

    def _cross(self, colour: str, passage: Passage, step_us: int) -> None:
        """Record a passage, if it is the first one through this gate."""
        if colour in self._crossings:
            return
        time_s = (self._time_us - self._start_us + passage.fraction * step_us) * 1e-6
        expected = self._next_colour()
        if colour != expected and not self._wrong_order:
            self._wrong_order = f"crossed {colour} before {expected} at {time_s:.1f} s"
        self._crossings[colour] = (time_s, passage)

    def _next_colour(self) -> str | None:
        return next((colour for colour in self._expected if colour not in self._crossings), None)

    def _watch(self, state: TrueState) -> None:
        """Look for contacts with gates and obstacles, and for crashes; note where the drone is."""
        if state.time_us >= self._next_flown_us:
            self._next_flown_us = state.time_us + _FLOWN_STEP_US
            self._flown.append(((state.time_us - self._start_us) * 1e-6, *state.position_arena_m))
        if state.contacts:
            self._count_contacts(state)
        crash = self._crash_watch.follow(state, self._taken_off)
        if crash is not None:
            self._crash = crash
            self._over = True

    def _count_contacts(self, state: TrueState) -> None:
        for name in state.contacts:
            if name not in self._solids:
                continue
            last_us = self._touched_us.get(name)
            if last_us is None or state.time_us - last_us >= CONTACT_GAP_US:
                self._contacts.append(name)
                self._contacts_s.append((state.time_us - self._start_us) * 1e-6)
            self._touched_us[name] = state.time_us

    def _come_to_rest(self, state: TrueState) -> None:
        """Follow the drone after motors off until it is still, or the motors are on again."""
        self._watch(state)
        if self._over or self._stop_us is None:
            return
        if state.motors_on:
            self._phase = _Phase.FLYING
            self._stop_us = None
            self._path.restart(state.position_arena_m)
            return
        if not is_resting(state.velocity_arena_m_s):
            self._still_since_us = None
        elif self._still_since_us is None:
            self._still_since_us = state.time_us
        still_us = 0 if self._still_since_us is None else state.time_us - self._still_since_us
        if still_us >= REST_US or state.time_us - self._stop_us >= SETTLE_LIMIT_US:
            self._settle(state)

    def _settle(self, state: TrueState) -> None:
        """Judge where and how the drone came to rest; without a take-off a new try may begin."""
        self._phase = _Phase.SETTLED
        if not self._taken_off:
            return
        self._over = True
        if up_component(state.attitude_arena) < TIPPED_OVER:
            self._crash = "came to rest tipped over"
        elif -state.velocity_arena_m_s[2] > HARD_HIT_M_S:
            self._crash = "fell with its motors off"
        else:
            position_m = state.position_arena_m
            self._landing = find_landing(self._scenario, self._envelope_m, position_m, self._floor_m)

    @property
    def settled(self) -> bool:
        """Whether the motors are off and the drone at rest, at the latest 2 s (vehicle time) after them."""
        return self._phase is _Phase.SETTLED

    @property
    def over(self) -> bool:
        """Whether no later state can change the verdict: crashed, past the limit, or landed."""
        return self._over

    @property
    def try_time_s(self) -> float:
        """Vehicle time from motors on to motors off or, until then, to the last state; at most the limit."""
        if self._phase is _Phase.WAITING:
            return 0.0
        end_us = self._time_us if self._stop_us is None else self._stop_us
        return min(end_us - self._start_us, self._limit_us) * 1e-6

    @property
    def crossed(self) -> tuple[str, ...]:
        """Colours crossed so far, in order of their first crossing."""
        return tuple(self._crossings)

    def snapshot(self) -> RefereeSnapshot:
        """How the try stands now."""
        return RefereeSnapshot(
            began_us=None if self._phase is _Phase.WAITING else self._start_us,
            try_time_s=self.try_time_s,
            penalty_s=self._path.outside_us * 1e-6 * PENALTY_S_PER_S,
            crossed=self.crossed,
            next_colour=self._next_colour(),
            contacts=len(self._contacts),
            inside=self._boundary.margin(self._position_m) >= 0.0,
            motors_on=self._phase is _Phase.FLYING,
            settled=self.settled,
            over=self.over,
        )

    def report(self, mission_state: str = "", ended: str | None = None) -> RefereeReport:
        """Judge what was seen so far.

        Args:
            mission_state: state the mission is in, such as "red.turning".
            ended: why the flight was broken off, in a few words ("link lost"), when it was.
        """
        facts = TryFacts(
            expected=self._expected,
            crossed=self.crossed,
            contact_frames=tuple(self._contacts),
            outside_s=self._path.outside_us * 1e-6,
            try_time_s=self.try_time_s,
            missed_goal=str(self._goals.next_goal or ""),
            began=self._phase is not _Phase.WAITING,
            taken_off=self._taken_off,
            motors_on=self._phase is _Phase.FLYING,
            settled=self.settled,
            timed_out=self._timed_out,
            wrong_order=self._wrong_order,
            crash=self._crash,
            landing=self._landing,
        )
        verdict, reason = judge(facts, mission_state, ended)
        penalty_s = facts.outside_s * PENALTY_S_PER_S
        crossings = self._crossings.values()
        return RefereeReport(
            verdict=verdict,
            reason=reason,
            frames_crossed=facts.crossed,
            crossing_times_s=tuple(time_s for time_s, _ in crossings),
            crossing_offsets_m=tuple(passage.offset_m for _, passage in crossings),
            crossing_sides=tuple(passage.side for _, passage in crossings),
            goal_times_s=tuple([(time_us - self._start_us) * 1e-6 for time_us in self._goals.times_us]),
            contacts=len(self._contacts),
            contact_frames=facts.contact_frames,
            contact_times_s=tuple(self._contacts_s),
            outside_s=facts.outside_s,
            try_time_s=facts.try_time_s,
            penalty_s=penalty_s,
            total_time_s=facts.try_time_s + penalty_s,
            landed_on_base=self._landing is not None and self._landing.surface == "base",
            landing_error_m=self._landing.error_m if self._landing else None,
            path_length_m=self._path.length_m,
            ignored_states=self._ignored,
            longest_gap_s=self._path.longest_gap_us * 1e-6,
        )


def _is_finite(state: TrueState) -> bool:
    """Whether no number of a state is NaN or infinite: either would make the sum so."""
    x, y, z = state.position_arena_m
    vx, vy, vz = state.velocity_arena_m_s
    qw, qx, qy, qz = state.attitude_arena
    return isfinite(x + y + z + vx + vy + vz + qw + qx + qy + qz)
