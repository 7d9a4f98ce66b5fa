"""How the vehicle that is flown responds to velocity commands: one model for all, identified in flight."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from math import cos, exp, hypot, pi, remainder, sin

from framerunner.geometry.vectors import turned
from offboard.drone import DroneState, VelocityFluCommand
from offboard.response.level_motion import LevelMotion
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
KNOWN_STEPS = 25
_SETTLE_STEPS = 3  # in which a first lag of commands is overcome
_SETTLE_HALVES = 2 * (_SETTLE_STEPS - 1)
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
        held_m_s: velocity that the vehicle's loop will use, level axes.
        integrals_m: of the vehicle's loop, without the next command.
        along_m2_s2: square of the speed along the thrust, with its sign.
    """

    time_s: float
    moved_m: Plan
    velocity_m_s: Plan
    yaw_rad: float
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
            self._airborne_steps = 0 if state.landed else self._airborne_steps + 1
            flies = self._airborne_steps > TAKE_OFF_STEPS
            learns = flies and steps == 1 and abs(step_s - STEP_S) < _REGULAR_S
            self._tilt_loop.update(state, level, sent, turn_rad_s, learns=learns, chooses=chooses)
            self.climb.update(
                sent.up_m_s, up_m_s, learns=flies, chooses=chooses, cause=_along(self._tilts, level, up_m_s)
            )
            self.turn.update(sent.yaw_rate_rad_s, turn_rad_s, learns=flies, chooses=chooses)
        if chooses:
            self._summarise()

    def _summarise(self) -> None:
        """Note what planning needs, if it has changed."""
        loop, now = self._tilt_loop.loop, self.response
        late_s = loop.dead_halves * HALF_S + loop.lag_s
        level_lag_s = loop.lag_s + 1.0 / (GRAVITY_M_S2 * max(loop.velocity, loop.command))
        known = self._tilt_loop.updates >= KNOWN_STEPS
        same = abs(level_lag_s - now.level_lag_s) < _SAME_LAG_S and self.climb.lag_s == now.climb_lag_s
        if not same or late_s != now.late_s or known != now.known:
            self.response = Response(late_s, level_lag_s, self.climb.lag_s, known)

    def predict(self, state: DroneState, yaw_ahead: YawAhead) -> LevelComing:
        """Let the model fly on by the commands on their way, until the next one has its effect."""
        tilt_loop, motion, up_m_s2 = self._tilt_loop, self.motion, self._up_m_s2
        loop, turn_rad_s, trims = tilt_loop.loop, tilt_loop.turn_rad_s, tilt_loop.trims_rad
        integrals, tilts, velocity = tilt_loop.integrals_m, self._tilts, motion.velocity_m_s
        velocities = _halves(tilt_loop.velocities_m_s or [turned(*velocity, -state.yaw)])
        now = len(velocities) - 1 - loop.inner_halves
        age_s = state.position_age_s
        x = 0.5 * age_s * (velocity[0] + state.velocity_arena_m_s[0])
        y = 0.5 * age_s * (velocity[1] + state.velocity_arena_m_s[1])
        halves = loop.dead_halves + (_SETTLE_HALVES if loop.lag_s else 0)
        yaw = yaw_ahead(0.0)
        for half in range(-1, halves):
            command = tilt_loop.coming_m_s(max((loop.dead_halves - half) // 2, 1), yaw)
            held = velocities[max(now + half + 1, 0)]
            before = integrals
            if half < halves - 1:
                integrals = (
                    before[0] + HALF_S * (command[0] - held[0]),
                    before[1] + HALF_S * (command[1] - held[1]),
                )
            if half < 0:  # the integrals are known by then
                continue
            demands = (
                loop.demand(0, command[0], held, before[0], turn_rad_s) + trims[0],
                loop.demand(1, command[1], held, before[1], turn_rad_s) + trims[1],
            )
            ahead = loop.followed(tilts, demands, turn_rad_s)
            middle = (0.5 * (tilts[0] + ahead[0]), 0.5 * (tilts[1] + ahead[1]))
            yaw_before, yaw = yaw, yaw_ahead((half + 1) * HALF_S)
            ax, ay = motion.acceleration(middle, 0.5 * (yaw_before + yaw), velocity, up_m_s2)
            x += HALF_S * (velocity[0] + 0.5 * HALF_S * ax)
            y += HALF_S * (velocity[1] + 0.5 * HALF_S * ay)
            velocity, tilts = (velocity[0] + HALF_S * ax, velocity[1] + HALF_S * ay), ahead
            velocities.append(turned(*velocity, -yaw))
        along_m2_s2 = _along(tilts, velocities[-1], state.velocity_arena_m_s[2])
        return LevelComing(halves * HALF_S, (x, y), velocity, yaw, held, integrals, along_m2_s2)

    def command_for(
        self, tilts_rad: Plan, rates_rad_s: Plan, turn_rad_s: float, coming: LevelComing, yaw_ahead: YawAhead
    ) -> Plan:
        """The command in plan, forward and to the left, that makes the vehicle tilt when it has its effect.

        Args:
            tilts_rad: to have then.
            rates_rad_s: by which they change then.
            turn_rad_s: of the heading then.
            coming: of `predict`.
            yaw_ahead: the same.
        """
        tilt_loop = self._tilt_loop
        loop, trims = tilt_loop.loop, tilt_loop.trims_rad
        rates = body_rates(tilts_rad, rates_rad_s, turn_rad_s)
        demands = [tilt + loop.lead(rate) for tilt, rate in zip(tilts_rad, rates, strict=True)]
        size = hypot(*demands)
        scale = MAX_TILT_RAD / size if size > MAX_TILT_RAD else 1.0
        asked = []
        for axis in (0, 1):
            demand = scale * demands[axis] - trims[axis]
            rest = loop.demand(axis, 0.0, coming.held_m_s, coming.integrals_m[axis], turn_rad_s)
            asked.append((demand - rest) / (loop.command + HALF_S * loop.integral))
        x, y = asked
        if not loop.lag_s:
            return x, y
        if not loop.turning:
            x, y = turned(x, y, yaw_ahead(coming.time_s - STEP_S))
        fx, fy = tilt_loop.lagged_m_s
        share = 1.0 / (1.0 - exp(-_SETTLE_STEPS * STEP_S / loop.lag_s))
        x, y = fx + share * (x - fx), fy + share * (y - fy)
        return (x, y) if loop.turning else turned(x, y, -yaw_ahead(0.0))


def _halves(velocities: list[Plan]) -> list[Plan]:
    """Those between velocities, too."""
    halves = velocities[:1]
    for (x0, y0), (x1, y1) in itertools.pairwise(velocities):
        halves += [(0.5 * (x0 + x1), 0.5 * (y0 + y1)), (x1, y1)]
    return halves


def _along(tilts_rad: Plan, level_m_s: Plan, up_m_s: float) -> float:
    """The square of the speed along the thrust, with its sign, m^2/s^2: drag along it disturbs the climb."""
    (forward, left), over = tilts_rad, cos(tilts_rad[1])
    speed = over * (sin(forward) * level_m_s[0] + cos(forward) * up_m_s) + sin(left) * level_m_s[1]
    return speed * abs(speed)
