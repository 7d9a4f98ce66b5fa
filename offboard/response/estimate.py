"""How the vehicle that is flown responds to velocity commands: one model for all, identified in flight."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, cos, exp, hypot, pi, remainder, sin

from framerunner.geometry.vectors import turned
from offboard.drone import DroneState, VelocityFluCommand
from offboard.limits import clamped
from offboard.response.level_motion import LevelMotion, in_air
from offboard.response.rate_response import RateResponse
from offboard.response.tilt_loop import (
    GRAVITY_M_S2,
    HALF_S,
    MAX_TILT_RAD,
    STEP_S,
    Plan,
    TiltLoop,
    TiltLoopEstimate,
    body_rates,
    tilts_of,
)

TAKE_OFF_STEPS = 12  # after which the thrust is that of flight
TILT_S = 0.1  # in which a wrong tilt is closed: a vehicle lags where its path needs more than it can turn,
MAX_CLOSING_RAD_S = 1.5  # by at most this rate
_SETTLE_STEPS = 3  # in which a first lag of commands is overcome
_SETTLE_S = STEP_S * (_SETTLE_STEPS - 1)
_MAX_STEPS = 8  # after a longer gap everything but the estimate begins again
_SAME_LAG_S = 0.1  # lags that differ less are the same for planning
_REGULAR_S = 0.012  # by which a step may be longer or shorter, to learn from it

YawAhead = Callable[[float], float]
"""The heading after a time from the last state, rad."""


@dataclass(frozen=True, slots=True)
class Response:
    """How late a vehicle answers, for planning.

    Attributes:
        late_s: dead time and first lag of commands in plan.
        level_lag_s: by which the velocity in plan follows commands, beside the dead time.
        climb_lag_s: likewise up and down.
        known: the model has been learnt from enough flight.
    """

    late_s: float = 0.1
    level_lag_s: float = 0.3
    climb_lag_s: float = 0.05
    known: bool = False


@dataclass(frozen=True, slots=True)
class LevelComing:
    """The motion in plan when the next command has its effect, by the commands until then.

    Attributes:
        time_s: from the last state until then.
        moved_m: until then, arena axes.
        velocity_m_s: then, arena axes.
        yaw_rad: then.
        tilts_rad: then.
        held_m_s: velocity that the vehicle's loop will use, level axes.
        integrals_m: of the vehicle's loop, without the next command.
        along_m2_s2: square of the speed along the thrust, with its sign.
    """

    time_s: float
    moved_m: Plan
    velocity_m_s: Plan
    yaw_rad: float
    tilts_rad: Plan
    held_m_s: Plan
    integrals_m: Plan
    along_m2_s2: float


class ResponseEstimate:
    """Estimates the response of the vehicle that is flown; call `update` once a tick.

    Attributes:
        response: as known now, for planning.
        climb: how the vehicle climbs.
        turn: how it turns.
        motion: its velocity in plan, drag and disturbance.
    """

    def __init__(self) -> None:
        self.response = Response()
        self.climb = RateResponse()
        self.turn = RateResponse()
        self.motion = LevelMotion()
        self._tilt_loop = TiltLoopEstimate()
        self._last_s: float | None = None
        self._yaw = 0.0
        self._airborne_steps = 0
        self._tilts: Plan = (0.0, 0.0)
        self._up_m_s2 = 0.0

    @property
    def loop(self) -> TiltLoop:
        """The loop of tilts as known now."""
        return self._tilt_loop.loop

    def update(
        self,
        state: DroneState,
        sent: VelocityFluCommand | None,
        *,
        up_m_s2: float = 0.0,
        near_gate: bool = False,
    ) -> None:
        """Add a tick.

        Args:
            state: of the drone now.
            sent: the command that it has had since the last tick; None if it had none, or it is not known.
            up_m_s2: how it accelerates upwards.
            near_gate: another model would disturb the flight now: one that is known is kept.
        """
        now_s, last_s, yaw = state.time_us * 1e-6, self._last_s, self._yaw
        self._last_s, self._yaw, self._up_m_s2 = now_s, state.yaw, up_m_s2
        self._tilts = tilts_of(state)
        self.motion.update(state, self._tilts, up_m_s2)
        level = turned(*self.motion.velocity_m_s, -state.yaw)
        steps = 0 if last_s is None else round((now_s - last_s) / STEP_S)
        if sent is None or last_s is None or not 0 <= steps <= _MAX_STEPS:
            for part in (self._tilt_loop, self.climb, self.turn):
                part.restart()
            self._airborne_steps = 0
            return
        if steps == 0:
            return
        step_s, up_m_s = now_s - last_s, state.velocity_arena_m_s[2]
        turn_rad_s = remainder(state.yaw - yaw, 2 * pi) / step_s
        chooses = not (near_gate and self.response.known)
        for _ in range(steps):
            self._airborne_steps = self._airborne_steps + 1 if in_air(state) else 0
            flies = self._airborne_steps > TAKE_OFF_STEPS
            learns = flies and steps == 1 and abs(step_s - STEP_S) < _REGULAR_S
            self._tilt_loop.update(
                state,
                level,
                sent,
                turn_rad_s,
                learns=learns,
                chooses=chooses,
                disturbed_square=self.motion.disturbed_square,
            )
            self.climb.update(
                sent.up_m_s, up_m_s, learns=flies, chooses=chooses, cause=_along(self._tilts, level, up_m_s)
            )
            self.turn.update(sent.yaw_rate_rad_s, turn_rad_s, learns=flies, chooses=chooses)
        if chooses:
            self._summarise()

    def _summarise(self) -> None:
        """Note what planning needs, if it has changed."""
        loop, now = self._tilt_loop.loop, self.response
        late_s = loop.dead_s + HALF_S + loop.lag_s
        level_lag_s = loop.lag_s + 1.0 / (GRAVITY_M_S2 * max(loop.velocity, loop.command))
        known = self._tilt_loop.known
        same = abs(level_lag_s - now.level_lag_s) < _SAME_LAG_S and self.climb.lag_s == now.climb_lag_s
        if not same or late_s != now.late_s or known != now.known:
            self.response = Response(late_s, level_lag_s, self.climb.lag_s, known)

    def predict(self, state: DroneState, yaw_ahead: YawAhead) -> LevelComing:
        """Let the model fly on by the commands on their way, until the next one has its effect."""
        tilt_loop, motion, up_m_s2 = self._tilt_loop, self.motion, self._up_m_s2
        loop, turn_rad_s, trims = tilt_loop.loop, tilt_loop.turn_rad_s, tilt_loop.trims_rad
        integrals, tilts, velocity = tilt_loop.integrals_m, self._tilts, motion.velocity_m_s
        rates = tilt_loop.rates_rad_s
        past = _Velocities(tilt_loop.velocities_m_s or [turned(*velocity, -state.yaw)])
        age_s, acts_s = state.position_age_s, loop.dead_s + (_SETTLE_S if loop.lag_s else 0.0)
        vx, vy, up_m_s = state.velocity_arena_m_s
        moved = (0.5 * age_s * (velocity[0] + vx), 0.5 * age_s * (velocity[1] + vy))
        count, yaw = ceil(acts_s / HALF_S), yaw_ahead(0.0)
        step_s, begin_s, before = acts_s / count, 0.0, integrals
        for part in range(count + 1):
            if part == count:  # until the middle of the next command's time
                step_s, before = HALF_S, integrals
            middle_s, end_s = begin_s + 0.5 * step_s, begin_s + step_s
            command = tilt_loop.acting_m_s(begin_s, end_s, yaw)
            held = past.at(middle_s - loop.inner_s)
            off = (command[0] - held[0], command[1] - held[1])
            middles = _sum(integrals, 0.5 * step_s, off)
            demands = _sum(loop.demands(command, held, middles, turn_rad_s), 1.0, trims)
            integrals = _sum(integrals, step_s, off)
            ahead, rates = loop.followed(tilts, rates, demands, turn_rad_s, step_s)
            middle = (0.5 * (tilts[0] + ahead[0]), 0.5 * (tilts[1] + ahead[1]))
            yaw_before, yaw = yaw, yaw_ahead(end_s)
            acceleration = motion.acceleration(middle, 0.5 * (yaw_before + yaw), velocity, up_m_s2)
            moved = _sum(moved, step_s, _sum(velocity, 0.5 * step_s, acceleration))
            velocity, tilts, begin_s = _sum(velocity, step_s, acceleration), ahead, end_s
            past.add(end_s, turned(*velocity, -yaw))
        held = past.at(begin_s - loop.inner_s)
        along_m2_s2 = _along(tilts, past.last, up_m_s)
        return LevelComing(begin_s, moved, velocity, yaw, tilts, held, before, along_m2_s2)

    def command_for(
        self, tilts_rad: tuple[Plan, Plan, Plan], turn_rad_s: float, coming: LevelComing, yaw_ahead: YawAhead
    ) -> Plan:
        """The command in plan, forward and to the left, that makes the vehicle tilt when it has its effect.

        Args:
            tilts_rad: to have a step before then, then, and a step later.
            turn_rad_s: of the heading then.
            coming: of `predict`.
            yaw_ahead: the same.
        """
        tilt_loop = self._tilt_loop
        loop, trims = tilt_loop.loop, tilt_loop.trims_rad
        before, then, after = tilts_rad
        changes = ((after[0] - before[0]) / (2.0 * STEP_S), (after[1] - before[1]) / (2.0 * STEP_S))
        rates = body_rates(then, changes, turn_rad_s)
        demands = []
        for axis, (rate, has) in enumerate(zip(rates, coming.tilts_rad, strict=True)):
            close = clamped((then[axis] - has) / TILT_S, MAX_CLOSING_RAD_S, MAX_CLOSING_RAD_S)
            change = (before[axis] - 2.0 * then[axis] + after[axis]) / (STEP_S * STEP_S)
            demands.append(has + loop.lead(rate + close, change))
        size = hypot(*demands)
        scale = MAX_TILT_RAD / size if size > MAX_TILT_RAD else 1.0
        held, held_s = coming.held_m_s, coming.time_s - loop.inner_s
        turned_rad = yaw_ahead(held_s + HALF_S) - yaw_ahead(held_s - HALF_S)
        integrals = _sum(coming.integrals_m, -HALF_S, held)
        rests = loop.demands((0.0, 0.0), held, integrals, remainder(turned_rad, 2 * pi) / STEP_S)
        x, y = (
            (scale * demand - trim - rest) / (loop.command + HALF_S * loop.integral)
            for demand, trim, rest in zip(demands, trims, rests, strict=True)
        )
        if not loop.lag_s:
            return x, y
        if not loop.turning:
            x, y = turned(x, y, yaw_ahead(coming.time_s - STEP_S))
        fx, fy = tilt_loop.lagged_m_s
        share = 1.0 / (1.0 - exp(-_SETTLE_STEPS * STEP_S / loop.lag_s))
        x, y = fx + share * (x - fx), fy + share * (y - fy)
        return (x, y) if loop.turning else turned(x, y, -yaw_ahead(0.0))


class _Velocities:
    """Velocities in level axes, of the past and to come, by their times from the last state on.

    Args:
        past_m_s: one a step; the last is that of the last state.
    """

    def __init__(self, past_m_s: list[Plan]) -> None:
        first = 1 - len(past_m_s)
        self._all = [((first + number) * STEP_S, *each) for number, each in enumerate(past_m_s)]

    @property
    def last(self) -> Plan:
        """The one farthest ahead."""
        return self._all[-1][1:]

    def add(self, time_s: float, velocity_m_s: Plan) -> None:
        """Add one that is farther ahead than all others."""
        self._all.append((time_s, *velocity_m_s))

    def at(self, time_s: float) -> Plan:
        """The one at a time between them."""
        later_s, x, y = self._all[-1]
        for before_s, bx, by in reversed(self._all):
            if before_s <= time_s:
                share = (time_s - before_s) / (later_s - before_s) if later_s > before_s else 0.0
                return bx + min(share, 1.0) * (x - bx), by + min(share, 1.0) * (y - by)
            later_s, x, y = before_s, bx, by
        return x, y


def _sum(a: Plan, share: float, b: Plan) -> Plan:
    """The first, and a share of the second."""
    return a[0] + share * b[0], a[1] + share * b[1]


def _along(tilts_rad: Plan, level_m_s: Plan, up_m_s: float) -> float:
    """The square of the speed along the thrust, with its sign, m^2/s^2: drag along it disturbs the climb."""
    (forward, left), over = tilts_rad, cos(tilts_rad[1])
    speed = over * (sin(forward) * level_m_s[0] + cos(forward) * up_m_s) + sin(left) * level_m_s[1]
    return speed * abs(speed)
