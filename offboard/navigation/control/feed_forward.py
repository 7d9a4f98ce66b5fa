"""The commands that make the simulated drone fly a motion: its autopilot's velocity loops, inverted.

An axis makes a demand u (a tilt, a thrust, a moment) of its velocity v and the command r:
u = k (b r - v) + ki * (integral of r - v), beside a compensation of drag. The motion needs a certain demand,
drag in body axes included, ahead by the time in which the motors answer; r follows from it. The integral
is that of the commands sent: what a limit has cut off is made up for later.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, cos, hypot, sqrt

from geometry.vectors import Vec3
from offboard.navigation.goals import Motion

GRAVITY_M_S2 = 9.80665


@dataclass(frozen=True, slots=True)
class Loop:
    """A velocity loop: the demand by the error and its integral.

    Attributes:
        gain: k; tilts are rad, so rad s/m; thrusts and moments are accelerations, so 1/s.
        integral_gain: ki, likewise, by one second.
        weight: b, how much of the command acts at once.
    """

    gain: float
    integral_gain: float
    weight: float


@dataclass(frozen=True, slots=True)
class Drag:
    """Quadratic drag in body axes, by mass and by moment of inertia.

    Attributes:
        level_per_m: along the drone, to any side.
        up_per_m: along its thrust.
        turn: about its thrust.
    """

    level_per_m: float
    up_per_m: float
    turn: float


# Of the airframe abejorro in `firmware_py/airframes/`: gains of `firmware_py.control.design`, weights of
# `level_law`, by its mass and inertia.
TILT = Loop(0.4945, 0.6597, 0.5)
CLIMB = Loop(12.451, 29.25, 0.8)
TURN = Loop(15.95, 58.1, 0.8)
DRAG = Drag(0.635 / 0.3, 2.352 / 0.3, 0.0039 / 0.002)
TILT_RATE_S = 0.0967  # gain of the body rate, by that of the tilt
TILT_DRAG_S2 = 0.212  # drag's moment by the rate's square, likewise
TILT_INERTIA_S2 = 0.0035  # likewise
MOTOR_S = 0.03  # the motors' lag
SPREAD_S = 0.05
"""Between motions of which the tilt's rate and acceleration are taken."""


class FeedForward:
    """Commands for one motion after another; call `command` once a tick."""

    def __init__(self) -> None:
        self._loops = (TILT, TILT, CLIMB, TURN)
        self._integrals: list[float] | None = None
        self._wanted = (0.0, 0.0, 0.0, 0.0)

    def command(self, now: Motion, soon: tuple[Motion, Motion, Motion]) -> tuple[Vec3, float]:
        """Velocity in the level axes of `now`, and yaw rate.

        Args:
            now: the motion when the command acts.
            soon: those when the motors answer to it, and `SPREAD_S` before and after.
        """
        forward, left, up = now.level(now.velocity_m_s)
        (f0, l0, _), (f1, l1, lift_m_s2), (f2, l2, _) = map(_forces, soon)
        answer = soon[1]
        turn = answer.yaw_rate_rad_s
        forward_rate, left_rate = (f2 - f0) / (2.0 * SPREAD_S), (l2 - l0) / (2.0 * SPREAD_S)
        share = DRAG.level_per_m / GRAVITY_M_S2
        tilt_forward = _tilt_demand(f1, forward_rate - turn * l1, (f0 - 2.0 * f1 + f2) / SPREAD_S**2)
        tilt_left = _tilt_demand(l1, left_rate + turn * f1, (l0 - 2.0 * l1 + l2) / SPREAD_S**2)
        body = [each.yaw_rate_rad_s * cos(f1) * cos(l1) for each in (now, answer)]
        demands = (
            tilt_forward - share * forward * abs(forward) + now.yaw_rate_rad_s * left / GRAVITY_M_S2,
            tilt_left - share * left * abs(left) - now.yaw_rate_rad_s * forward / GRAVITY_M_S2,
            lift_m_s2 - DRAG.up_per_m * up * abs(up),
            answer.yaw_acceleration_rad_s2 + DRAG.turn * body[1] * abs(body[1]),
        )
        self._wanted = (forward, left, up, body[0])
        if self._integrals is None:
            self._integrals = [
                loop.gain * (1.0 - loop.weight) * value / loop.integral_gain
                for value, loop in zip(self._wanted, self._loops, strict=True)
            ]
        x, y, z, rate = (
            (demand + loop.gain * value - loop.integral_gain * integral) / (loop.gain * loop.weight)
            for demand, value, integral, loop in zip(
                demands, self._wanted, self._integrals, self._loops, strict=True
            )
        )
        return (x, y, z), rate

    def restart(self) -> None:
        """Forget the past: the drone has been flown otherwise, and its velocity is steady."""
        self._integrals = None

    def sent(self, velocity_m_s: Vec3, yaw_rate_rad_s: float, step_s: float) -> None:
        """Note what was commanded of it, until the next call: less, if a limit was reached."""
        if self._integrals is None:
            return
        commands = (*velocity_m_s, yaw_rate_rad_s)
        for i, (command, value) in enumerate(zip(commands, self._wanted, strict=True)):
            self._integrals[i] += (command - value) * step_s


def _tilt_demand(tilt_rad: float, rate_rad_s: float, acceleration_rad_s2: float) -> float:
    """The tilt to ask for so that the drone has one that changes."""
    return (
        tilt_rad
        + TILT_RATE_S * rate_rad_s
        + TILT_DRAG_S2 * rate_rad_s * abs(rate_rad_s)
        + TILT_INERTIA_S2 * acceleration_rad_s2
    )


def _forces(motion: Motion) -> Vec3:
    """Tilts forward and to the left (rad), and the thrust's upward part less the weight, by mass (m/s^2)."""
    velocity = motion.level(motion.velocity_m_s)
    forward, left, up = motion.level(motion.acceleration_m_s2)
    drag = _drag(velocity, forward, left)
    lift = up - drag[2]
    over = GRAVITY_M_S2 + lift
    return (atan((forward - drag[0]) / over), atan((left - drag[1]) / over), lift)


def _drag(velocity: Vec3, forward_m_s2: float, left_m_s2: float) -> Vec3:
    """Acceleration by drag in level axes, at the tilt that the accelerations and this drag need."""
    vx, vy, vz = velocity
    k = DRAG.level_per_m / GRAVITY_M_S2
    nx, ny = forward_m_s2 / GRAVITY_M_S2 + k * vx * abs(vx), left_m_s2 / GRAVITY_M_S2 + k * vy * abs(vy)
    size = sqrt(1.0 + nx * nx + ny * ny)
    nx, ny, nz = nx / size, ny / size, 1.0 / size  # the thrust's direction
    ahead = hypot(nx, nz)
    fx, fz = nz / ahead, -nx / ahead  # the drone's forward direction
    lx, ly, lz = ny * fz, nz * fx - nx * fz, -ny * fx  # to its left
    a, b, c = vx * fx + vz * fz, vx * lx + vy * ly + vz * lz, vx * nx + vy * ny + vz * nz
    fa, fb = -DRAG.level_per_m * a * abs(a), -DRAG.level_per_m * b * abs(b)
    fc = -DRAG.up_per_m * c * abs(c)
    return (fa * fx + fb * lx + fc * nx, fb * ly + fc * ny, fa * fz + fb * lz + fc * nz)
