"""Corrects velocity commands so that a vehicle with poor velocity control moves as the simulated drone would.

A mission flies by velocities: 0.3 m/s for four seconds are 1.2 m through a gate, and zero is a hover. The
simulated drone follows that closely. A real one lags by half a second and more, stays slower than commanded
against drag, and drifts in height while it hovers, as PX4 does under velocity setpoints. So a model of an
ideal drone is flown by the same commands, and the vehicle is made to follow the model: by the model's
acceleration, sent ahead by the lag that was measured, and by the vehicle's offset from the model's velocity
and position. Correction starts once the vehicle is farther off than an ideal one ever is; until then commands
are sent unchanged, to the last bit.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import cos, exp, hypot, pi, remainder, sin

from framerunner.geometry.vectors import Vec3, turned
from offboard.drone import DroneState, VelocityFluCommand

MODEL_LAG_S = 0.15  # as of the simulated drone
SPEED_MEMORY_S = 0.5  # decay of the commanded speed by which the threshold is raised
FORGET_S = 1.0  # decay of the offset across the command: the mission sees it, and steers again from there
MIN_OFFSET_M = 0.14  # of the model in hover, before commands are corrected; the simulated drone: 0.04
MIN_OFFSET_S = 0.3  # added to that for each m/s commanded
MIN_OFFSET_RAD = 0.2  # likewise for its heading; the simulated drone: 0.13
MAX_OFFSET_M = 0.5  # of the model from the vehicle
MAX_OFFSET_RAD = 0.5
HOVER_M_S = 0.05  # a slower command is a hover, which has no direction
POSITION_GAIN_PER_S = 0.8
HEADING_GAIN_PER_S = 1.0
BANDWIDTH_PER_S = 3.0  # a slower vehicle is made as quick by feedback of its velocity
MAX_CORRECTION_M_S = 0.7
MAX_CORRECTION_RAD_S = 1.0
_MAX_STEP_S = 0.2  # after a longer gap the model starts again at the vehicle

LAG_WINDOW = 8  # ticks over which a change of speed is measured
INITIAL_LAG_S = 0.3
MAX_LAG_S = 0.7
MIN_CHANGES = (0.1, 0.1, 0.08, 0.15)  # of speed in x, y, z (m/s) and yaw (rad/s) by which lag is measured
_INITIAL_WEIGHT = 8.0  # of the initial lag, in changes of the minimum size


class LagEstimate:
    """Least squares for T in T dv/dt = commanded - v, both sides integrated over a window of ticks.

    Args:
        min_change: a smaller change of speed over a window is ignored, because it may be noise.
    """

    __slots__ = ("_integral", "_min_change", "_past", "_products", "_squares")

    def __init__(self, min_change: float) -> None:
        self._min_change = min_change
        self._squares = _INITIAL_WEIGHT * min_change * min_change
        self._products = INITIAL_LAG_S * self._squares
        self._integral = 0.0
        self._past: deque[tuple[float, float]] = deque(maxlen=LAG_WINDOW)

    def update(self, commanded: float, speed: float, step_s: float) -> None:
        """Add one step: the speed commanded since the last one, and the speed now."""
        self._integral += (commanded - speed) * step_s
        if len(self._past) == LAG_WINDOW:
            integral, before = self._past[0]
            change = speed - before
            if abs(change) > self._min_change:
                self._squares += change * change
                self._products += change * (self._integral - integral)
        self._past.append((self._integral, speed))

    def interrupt(self) -> None:
        """Keep the estimate, but measure no change across a gap."""
        self._past.clear()

    @property
    def lag_s(self) -> float:
        """The estimate, 0 to MAX_LAG_S."""
        return min(max(self._products / self._squares, 0.0), MAX_LAG_S)


@dataclass(slots=True)
class _Model:
    """An ideal drone flown by the same commands, relative to the vehicle; arena axes."""

    time_us: int  # vehicle time
    position_m: Vec3  # the vehicle's then
    yaw_rad: float  # the vehicle's then
    offset_m: Vec3 = (0.0, 0.0, 0.0)  # from the vehicle to the model
    velocity_m_s: Vec3 = (0.0, 0.0, 0.0)  # the model's
    offset_rad: float = 0.0  # from the vehicle's heading to the model's
    yaw_rate_rad_s: float = 0.0  # the model's
    measured_yaw_rate_rad_s: float = 0.0  # the vehicle's
    recent_speed_m_s: float = 0.0  # highest commanded speed, decaying


class CommandTracker:
    """Adds to velocity commands what makes the vehicle follow the model.

    Attributes:
        active: the vehicle has been off the model by so much that its commands are corrected.
    """

    def __init__(self) -> None:
        self._commanded = self._sent = VelocityFluCommand()
        self.reset()

    def reset(self) -> None:
        """Start again at the next state, without correction."""
        self.active = False
        self._model: _Model | None = None
        self._lags = tuple(map(LagEstimate, MIN_CHANGES))

    def correct(self, command: VelocityFluCommand, state: DroneState) -> VelocityFluCommand:
        """The command to send, from the mission's command and the vehicle's state now; once a tick."""
        model, commanded, sent = self._model, self._commanded, self._sent
        self._commanded = self._sent = command
        step_s = 0.0 if model is None else (state.time_us - model.time_us) * 1e-6
        if model is None or not 0.0 <= step_s <= _MAX_STEP_S:
            self._model = _Model(state.time_us, (state.x, state.y, state.z), state.yaw)
            for lag in self._lags:
                lag.interrupt()
            return command
        if step_s > 0.0:
            _advance(model, commanded, state, step_s)
            self._measure_lags(sent, model, state, step_s)
        offset_m = hypot(*model.offset_m) - MIN_OFFSET_S * model.recent_speed_m_s
        if offset_m > MIN_OFFSET_M or abs(model.offset_rad) > MIN_OFFSET_RAD:
            self.active = True
        if self.active:
            self._sent = _corrected(command, model, [lag.lag_s for lag in self._lags], state)
        return self._sent

    def _measure_lags(
        self, sent: VelocityFluCommand, model: _Model, state: DroneState, step_s: float
    ) -> None:
        commanded = (*turned(sent.forward_m_s, sent.left_m_s, state.yaw), sent.up_m_s, sent.yaw_rate_rad_s)
        measured = (*state.velocity_arena_m_s, model.measured_yaw_rate_rad_s)
        for lag, command, speed in zip(self._lags, commanded, measured, strict=True):
            lag.update(command, speed, step_s)


def _advance(model: _Model, commanded: VelocityFluCommand, state: DroneState, step_s: float) -> None:
    """Fly the model by the command of the last step, at most MAX_OFFSET_M away from the vehicle."""
    speed_m_s = hypot(commanded.forward_m_s, commanded.left_m_s, commanded.up_m_s)
    model.recent_speed_m_s = max(speed_m_s, exp(-step_s / SPEED_MEMORY_S) * model.recent_speed_m_s)
    wanted_x, wanted_y = turned(commanded.forward_m_s, commanded.left_m_s, state.yaw)
    x_m, velocity_x = _lag_step(model.velocity_m_s[0], wanted_x, step_s)
    y_m, velocity_y = _lag_step(model.velocity_m_s[1], wanted_y, step_s)
    z_m, velocity_z = _lag_step(model.velocity_m_s[2], commanded.up_m_s, step_s)
    model.velocity_m_s = (velocity_x, velocity_y, velocity_z)
    (off_x, off_y, off_z), (at_x, at_y, at_z) = model.offset_m, model.position_m
    x, y, z = off_x + at_x - state.x + x_m, off_y + at_y - state.y + y_m, off_z + at_z - state.z + z_m
    distance_m = hypot(x, y, z)
    scale = MAX_OFFSET_M / distance_m if distance_m > MAX_OFFSET_M else 1.0
    direction = (commanded.forward_m_s, commanded.left_m_s)
    x, y = _forget_across((scale * x, scale * y), direction, state.yaw, exp(-step_s / FORGET_S))
    model.offset_m, model.position_m = (x, y, scale * z), (state.x, state.y, state.z)
    turn_rad, model.yaw_rate_rad_s = _lag_step(model.yaw_rate_rad_s, commanded.yaw_rate_rad_s, step_s)
    turned_rad = remainder(state.yaw - model.yaw_rad, 2 * pi)
    model.measured_yaw_rate_rad_s = turned_rad / step_s
    model.offset_rad = max(-MAX_OFFSET_RAD, min(MAX_OFFSET_RAD, model.offset_rad + turn_rad - turned_rad))
    model.yaw_rad = state.yaw
    model.time_us = state.time_us


def _lag_step(speed: float, wanted: float, step_s: float) -> tuple[float, float]:
    """Distance and speed after a step of a first-order lag of MODEL_LAG_S, exact."""
    kept = exp(-step_s / MODEL_LAG_S)
    return wanted * step_s + (speed - wanted) * MODEL_LAG_S * (1.0 - kept), wanted + kept * (speed - wanted)


def _forget_across(
    offset_m: tuple[float, float], commanded_m_s: tuple[float, float], yaw_rad: float, kept: float
) -> tuple[float, float]:
    """Keep the offset along the command and a share of the offset across it; all of it in a hover.

    A mission that steers by the camera has seen where it is and aims from there. A vehicle pushed back to its
    old line meanwhile would pass the aim on the other side.
    """
    speed_m_s = hypot(*commanded_m_s)
    if speed_m_s < HOVER_M_S:
        return offset_m
    along_x, along_y = turned(commanded_m_s[0] / speed_m_s, commanded_m_s[1] / speed_m_s, yaw_rad)
    along_m = offset_m[0] * along_x + offset_m[1] * along_y
    return (
        along_m * along_x + kept * (offset_m[0] - along_m * along_x),
        along_m * along_y + kept * (offset_m[1] - along_m * along_y),
    )


def _corrected(
    command: VelocityFluCommand, model: _Model, lags_s: list[float], state: DroneState
) -> VelocityFluCommand:
    wanted_x, wanted_y = turned(command.forward_m_s, command.left_m_s, state.yaw)
    x_s, y_s, up_s, yaw_s = lags_s
    level_s = max(x_s, y_s)
    add = [
        _velocity_correction(wanted, speed, measured, lag_s) + POSITION_GAIN_PER_S * offset
        for wanted, speed, measured, lag_s, offset in zip(
            (wanted_x, wanted_y, command.up_m_s),
            model.velocity_m_s,
            state.velocity_arena_m_s,
            (level_s, level_s, up_s),
            model.offset_m,
            strict=True,
        )
    ]
    size = hypot(*add)
    scale = MAX_CORRECTION_M_S / size if size > MAX_CORRECTION_M_S else 1.0
    turn = HEADING_GAIN_PER_S * model.offset_rad + _velocity_correction(
        wanted=command.yaw_rate_rad_s,
        speed=model.yaw_rate_rad_s,
        measured=model.measured_yaw_rate_rad_s,
        lag_s=yaw_s,
    )
    c, s = cos(state.yaw), sin(state.yaw)
    return VelocityFluCommand(
        command.forward_m_s + scale * (c * add[0] + s * add[1]),
        command.left_m_s + scale * (c * add[1] - s * add[0]),
        command.up_m_s + scale * add[2],
        command.yaw_rate_rad_s + max(-MAX_CORRECTION_RAD_S, min(MAX_CORRECTION_RAD_S, turn)),
    )


def _velocity_correction(wanted: float, speed: float, measured: float, lag_s: float) -> float:
    """What to add to a wanted speed so that a vehicle of this lag has the model's speed.

    One of first order, lag_s dv/dt = sent - v, has it when speed + lag_s dspeed/dt is sent.
    """
    ahead = (lag_s / MODEL_LAG_S - 1.0) * (wanted - speed)
    return ahead + max(0.0, BANDWIDTH_PER_S * lag_s - 1.0) * (speed - measured)
