"""Makes a vehicle move as the project's own would, whatever its own velocity control lets slip.

A mission flies by velocities: 0.3 m/s for four seconds are 1.2 m through a frame, and none are a stand. The
simulated drone of this project does just that. An ordinary one lags by half a second and more, stays behind
against drag, and drifts in height while it is told to stand, as PX4 does under velocity setpoints. So here a
model of a drone that obeys is flown by the same commands, and the vehicle is made to follow the model: by the
model's acceleration, as far ahead as the vehicle was seen to lag, and by what it is off the model's speed and
place. That begins once the vehicle has been off by so much that it cannot be one that obeys: until then, and
for one that obeys for ever, commands are sent to the last bit as the mission wants them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, exp, hypot, pi, remainder, sin

from geometry.vectors import Vec3
from offboard.drone import DroneState, VelocityCommand
from offboard.link.lag import LagEstimate

LAG_S = 0.15  # of the model, as of the simulated drone
MEMORY_S = 0.5  # in telling whether a vehicle obeys, a command counts for so long after it has changed
FORGET_S = 1.0  # what is off beside the way is given up so quickly: the mission sees it, and steers anew
HELP_FROM_M = 0.14  # off the model by more in a stand, it needs help; the simulated drone: 0.04
HELP_FROM_S = 0.3  # so much more for each metre a second of late
HELP_FROM_RAD = 0.2  # likewise for its heading; the simulated drone: 0.13
LEASH_M = 0.5  # how far the place may be from the vehicle
LEASH_RAD = 0.5
STAND_M_S = 0.05  # a slower command is a stand, which has no sides
PULL_PER_S = 0.8
TURN_PER_S = 1.0
BANDWIDTH_PER_S = 3.0  # a vehicle slower than that is made as quick by feeding back its speed
MOST_M_S = 0.7
MOST_RAD_S = 1.0
_LONGEST_STEP_S = 0.2  # after a longer gap the vehicle is taken from where it is


@dataclass(slots=True)
class _Model:
    """A drone that obeys, flown by the same commands.

    Attributes:
        time_us: vehicle time.
        at_m: the vehicle's place then, arena axes.
        yaw_rad: the vehicle's heading then.
        off_m: from the vehicle to the model, arena axes.
        velocity_m_s: the model's, arena axes.
        off_rad: from the vehicle's heading to the model's.
        turn_rad_s: the model's yaw rate.
        turned_rad_s: the vehicle's.
        speed_m_s: commanded of late, at most.
    """

    time_us: int
    at_m: Vec3
    yaw_rad: float
    off_m: Vec3 = (0.0, 0.0, 0.0)
    velocity_m_s: Vec3 = (0.0, 0.0, 0.0)
    off_rad: float = 0.0
    turn_rad_s: float = 0.0
    turned_rad_s: float = 0.0
    speed_m_s: float = 0.0


@dataclass(slots=True)
class _Lags:
    """How late the vehicle is: over the ground (x and y), upwards, in turning."""

    x: LagEstimate = field(default_factory=lambda: LagEstimate(0.1))
    y: LagEstimate = field(default_factory=lambda: LagEstimate(0.1))
    up: LagEstimate = field(default_factory=lambda: LagEstimate(0.08))
    turn: LagEstimate = field(default_factory=lambda: LagEstimate(0.15))

    def interrupt(self) -> None:
        """What comes next does not follow what came before."""
        for lag in (self.x, self.y, self.up, self.turn):
            lag.interrupt()


class CommandTracker:
    """Adds to velocity commands what makes the vehicle follow the model.

    Attributes:
        helps: the vehicle has shown that it needs it.
    """

    def __init__(self) -> None:
        self.helps = False
        self._model: _Model | None = None
        self._lags = _Lags()
        self._flown = self._sent = VelocityCommand()

    def reset(self) -> None:
        """Begin anew at the next state, with a vehicle that obeys."""
        self._model = None
        self._lags = _Lags()
        self.helps = False

    def correct(self, command: VelocityCommand, state: DroneState) -> VelocityCommand:
        """The command to send.

        Args:
            command: as the mission wants it from now on.
            state: of the vehicle now; once a tick.
        """
        model, flown, sent = self._model, self._flown, self._sent
        self._flown = self._sent = command
        step_s = 0.0 if model is None else (state.time_us - model.time_us) * 1e-6
        if model is None or not 0.0 <= step_s <= _LONGEST_STEP_S:
            self._model = _Model(state.time_us, (state.x, state.y, state.z), state.yaw)
            self._lags.interrupt()
            return command
        if step_s > 0.0:
            _advance(model, flown, state, step_s)
            self._learn(sent, model, state, step_s)
        off_m = hypot(*model.off_m) - HELP_FROM_S * model.speed_m_s
        if off_m > HELP_FROM_M or abs(model.off_rad) > HELP_FROM_RAD:
            self.helps = True
        if self.helps:
            self._sent = _following(command, model, self._lags, state)
        return self._sent

    def _learn(self, sent: VelocityCommand, model: _Model, state: DroneState, step_s: float) -> None:
        lags = self._lags
        sent_x, sent_y = _turned(sent.forward_m_s, sent.left_m_s, state.yaw)
        velocity_x, velocity_y, velocity_z = state.velocity_arena_m_s
        lags.x.see(sent_x, velocity_x, step_s)
        lags.y.see(sent_y, velocity_y, step_s)
        lags.up.see(sent.up_m_s, velocity_z, step_s)
        lags.turn.see(sent.yaw_rate_rad_s, model.turned_rad_s, step_s)


def _advance(model: _Model, flown: VelocityCommand, state: DroneState, step_s: float) -> None:
    """Fly the model by the command of the last step, but not farther from the vehicle than the leash."""
    speed_m_s = hypot(flown.forward_m_s, flown.left_m_s, flown.up_m_s)
    model.speed_m_s = max(speed_m_s, exp(-step_s / MEMORY_S) * model.speed_m_s)
    wanted_x, wanted_y = _turned(flown.forward_m_s, flown.left_m_s, state.yaw)
    x_m, velocity_x = _gone(model.velocity_m_s[0], wanted_x, step_s)
    y_m, velocity_y = _gone(model.velocity_m_s[1], wanted_y, step_s)
    z_m, velocity_z = _gone(model.velocity_m_s[2], flown.up_m_s, step_s)
    model.velocity_m_s = (velocity_x, velocity_y, velocity_z)
    (off_x, off_y, off_z), (at_x, at_y, at_z) = model.off_m, model.at_m
    x, y, z = off_x + at_x - state.x + x_m, off_y + at_y - state.y + y_m, off_z + at_z - state.z + z_m
    distance_m = hypot(x, y, z)
    scale = LEASH_M / distance_m if distance_m > LEASH_M else 1.0
    way = (flown.forward_m_s, flown.left_m_s)
    x, y = _forget_beside((scale * x, scale * y), way, state.yaw, exp(-step_s / FORGET_S))
    model.off_m, model.at_m = (x, y, scale * z), (state.x, state.y, state.z)
    turn_rad, model.turn_rad_s = _gone(model.turn_rad_s, flown.yaw_rate_rad_s, step_s)
    turned_rad = remainder(state.yaw - model.yaw_rad, 2 * pi)
    model.turned_rad_s = turned_rad / step_s
    model.off_rad = max(-LEASH_RAD, min(LEASH_RAD, model.off_rad + turn_rad - turned_rad))
    model.yaw_rad = state.yaw
    model.time_us = state.time_us


def _gone(speed: float, wanted: float, step_s: float) -> tuple[float, float]:
    """Way and speed after a step of a first-order lag of LAG_S, exactly."""
    kept = exp(-step_s / LAG_S)
    return wanted * step_s + (speed - wanted) * LAG_S * (1.0 - kept), wanted + kept * (speed - wanted)


def _turned(forward: float, left: float, yaw_rad: float) -> tuple[float, float]:
    c, s = cos(yaw_rad), sin(yaw_rad)
    return c * forward - s * left, s * forward + c * left


def _forget_beside(
    off_m: tuple[float, float], flown_m_s: tuple[float, float], yaw_rad: float, kept: float
) -> tuple[float, float]:
    """Keep all of what is off along the command and a share of what is off beside it; all in a stand.

    A mission that steers by sight has seen where it is and aims from there. A vehicle pushed back to the
    old way meanwhile would come past its aim on the other side.
    """
    speed_m_s = hypot(*flown_m_s)
    if speed_m_s < STAND_M_S:
        return off_m
    along_x, along_y = _turned(flown_m_s[0] / speed_m_s, flown_m_s[1] / speed_m_s, yaw_rad)
    along_m = off_m[0] * along_x + off_m[1] * along_y
    return (
        along_m * along_x + kept * (off_m[0] - along_m * along_x),
        along_m * along_y + kept * (off_m[1] - along_m * along_y),
    )


def _following(command: VelocityCommand, model: _Model, lags: _Lags, state: DroneState) -> VelocityCommand:
    wanted_x, wanted_y = _turned(command.forward_m_s, command.left_m_s, state.yaw)
    wanted = (wanted_x, wanted_y, command.up_m_s)
    level_s = max(lags.x.lag_s, lags.y.lag_s)
    add = [
        _help(want, speed, measured, lag_s) + PULL_PER_S * off
        for want, speed, measured, lag_s, off in zip(
            wanted,
            model.velocity_m_s,
            state.velocity_arena_m_s,
            (level_s, level_s, lags.up.lag_s),
            model.off_m,
            strict=True,
        )
    ]
    size = hypot(*add)
    scale = MOST_M_S / size if size > MOST_M_S else 1.0
    turn = _help(command.yaw_rate_rad_s, model.turn_rad_s, model.turned_rad_s, lags.turn.lag_s)
    turn = max(-MOST_RAD_S, min(MOST_RAD_S, turn + TURN_PER_S * model.off_rad))
    c, s = cos(state.yaw), sin(state.yaw)
    return VelocityCommand(
        command.forward_m_s + scale * (c * add[0] + s * add[1]),
        command.left_m_s + scale * (c * add[1] - s * add[0]),
        command.up_m_s + scale * add[2],
        command.yaw_rate_rad_s + turn,
    )


def _help(wanted: float, speed: float, measured: float, lag_s: float) -> float:
    """What to add to a wanted speed, so that a vehicle of this lag has the model's speed.

    One of first order, lag_s dv/dt = sent - v, has it when speed + lag_s dspeed/dt is sent.
    """
    ahead = (lag_s / LAG_S - 1.0) * (wanted - speed)
    return ahead + max(0.0, BANDWIDTH_PER_S * lag_s - 1.0) * (speed - measured)
