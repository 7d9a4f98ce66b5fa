"""A multicopter's motion in plan: acceleration by tilt, by drag, and by disturbances such as wind."""

from __future__ import annotations

from math import atan2, cos, hypot, sin, tan

from framerunner.geometry.vectors import Vec3, turned
from offboard.drone import DroneState
from offboard.response.tilt_loop import GRAVITY_M_S2, STEP_S, Plan

_DRAG_PER_M = (0.5, 1.0)  # prior of drag by mass: mean, standard deviation
_DRAG_WANDER = 0.01  # by the root of a second
_DISTURBANCE_M_S2 = 0.15  # standard deviation at first
_DISTURBANCE_WANDER = 0.03  # m/s^2 by the root of a second
_NOISE_M_S2 = 0.35  # of a velocity's change over a step
_REST_S = 0.7  # time constant of what drag and disturbance leave unexplained, which is taken to go on
_LONGEST_S = 0.15  # between two velocities that are compared
_SQUARE_S = 1.0  # time constant of the disturbance's mean square; a gust passes through zero twice a period


class LevelMotion:
    """What changes of velocity show beside tilts: drag and a disturbance; call `update` at ticks.

    Estimated by a Kalman filter. Drag is quadratic along the body's axes forward and to the left.

    Attributes:
        velocity_m_s: at the time of the last state, arena axes.
        drag_per_m: by mass.
        disturbance_m_s2: arena axes.
        disturbed_square: mean square of the latest disturbances, m^2/s^4.
    """

    def __init__(self) -> None:
        self.velocity_m_s: Plan = (0.0, 0.0)
        self.drag_per_m, self.disturbed_square = _DRAG_PER_M[0], 0.0
        self._steady_m_s2: Plan = (0.0, 0.0)
        self._rest_m_s2: Plan = (0.0, 0.0)
        variances = (_DRAG_PER_M[1] ** 2, _DISTURBANCE_M_S2**2, _DISTURBANCE_M_S2**2)
        self._covariance = [[v if i == j else 0.0 for j in range(3)] for i, v in enumerate(variances)]
        self._measured: Plan = (0.0, 0.0)
        self._measured_s: float | None = None
        self._tilts: Plan = (0.0, 0.0)
        self._up_m_s = 0.0

    @property
    def disturbance_m_s2(self) -> Plan:
        """What drag does not explain now."""
        (x, y), (rest_x, rest_y) = self._steady_m_s2, self._rest_m_s2
        return x + rest_x, y + rest_y

    def update(self, state: DroneState, tilts_rad: Plan, up_m_s2: float) -> None:
        """Take in a state; upwards the drone accelerates as given."""
        x, y, self._up_m_s = state.velocity_arena_m_s
        measured_s, last_s = state.time_us * 1e-6 - state.position_age_s, self._measured_s
        if last_s is not None and 0.0 < (step_s := measured_s - last_s) < _LONGEST_S and in_air(state):
            before_x, before_y = self._measured
            tilts = (0.5 * (tilts_rad[0] + self._tilts[0]), 0.5 * (tilts_rad[1] + self._tilts[1]))
            by_x, by_y = _by_tilt(tilts, state.yaw, up_m_s2)
            rest = ((x - before_x) / step_s - by_x, (y - before_y) / step_s - by_y)
            middle = (0.5 * (x + before_x), 0.5 * (y + before_y))
            self._learn(rest, _squares(middle, self._up_m_s, tilts, state.yaw), step_s)
        self._measured, self._measured_s, self._tilts = (x, y), measured_s, tilts_rad
        ax, ay = self.acceleration(tilts_rad, state.yaw, (x, y), up_m_s2)
        self.velocity_m_s = (x + state.position_age_s * ax, y + state.position_age_s * ay)

    def _learn(self, rest_m_s2: Plan, squares_m2_s2: Plan, step_s: float) -> None:
        """Take in what tilt does not explain of a change of velocity."""
        p = self._covariance
        noise = (_NOISE_M_S2 * STEP_S / step_s) ** 2
        for i, wander in enumerate((_DRAG_WANDER, _DISTURBANCE_WANDER, _DISTURBANCE_WANDER)):
            p[i][i] += wander * wander * step_s
        x, rests, share = [self.drag_per_m, *self._steady_m_s2], [0.0, 0.0], min(step_s / _REST_S, 1.0)
        for axis, square in enumerate(squares_m2_s2):
            row = -square
            spread = [row * p[i][0] + p[i][1 + axis] for i in range(3)]
            variance = row * spread[0] + spread[1 + axis] + noise
            error = rest_m_s2[axis] - row * x[0] - x[1 + axis]
            rests[axis] = self._rest_m_s2[axis] + share * (error - self._rest_m_s2[axis])
            x = [was + each / variance * error for was, each in zip(x, spread, strict=True)]
            p = [[p[i][j] - spread[i] * spread[j] / variance for j in range(3)] for i in range(3)]
        self._covariance = p
        self.drag_per_m, self._steady_m_s2 = max(x[0], 0.0), (x[1], x[2])
        self._rest_m_s2 = (rests[0], rests[1])
        dx, dy = self.disturbance_m_s2
        self.disturbed_square += step_s / _SQUARE_S * (dx * dx + dy * dy - self.disturbed_square)

    def acceleration(self, tilts_rad: Plan, yaw_rad: float, velocity_m_s: Plan, up_m_s2: float) -> Plan:
        """In plan, arena axes, m/s^2; upwards it is as given."""
        x, y = _by_tilt(tilts_rad, yaw_rad, up_m_s2)
        (along_x, along_y), drag = _squares(velocity_m_s, self._up_m_s, tilts_rad, yaw_rad), self.drag_per_m
        dx, dy = self.disturbance_m_s2
        return x - drag * along_x + dx, y - drag * along_y + dy

    def tilts_for(self, acceleration_m_s2: Vec3, yaw_rad: float, velocity_m_s: Plan, tilts_rad: Plan) -> Plan:
        """The tilts for an acceleration, arena axes, whatever the disturbance; rad.

        Args:
            acceleration_m_s2: that the drone should have.
            yaw_rad: its heading then.
            velocity_m_s: in plan, then.
            tilts_rad: about then, for the drag.
        """
        (along_x, along_y), drag = _squares(velocity_m_s, self._up_m_s, tilts_rad, yaw_rad), self.drag_per_m
        dx, dy = self.disturbance_m_s2
        x, y = acceleration_m_s2[0] + drag * along_x - dx, acceleration_m_s2[1] + drag * along_y - dy
        forward, left = turned(x, y, -yaw_rad)
        over = GRAVITY_M_S2 + acceleration_m_s2[2]
        return atan2(forward, over), atan2(left, hypot(forward, over))


def in_air(state: DroneState) -> bool:
    """The vehicle flies: it does not stand, and nobody carries it."""
    return state.armed and not state.landed


def _by_tilt(tilts_rad: Plan, yaw_rad: float, up_m_s2: float) -> Plan:
    """The acceleration by tilts, arena axes; what is along the thrust, its drag too, is in `up_m_s2`."""
    over = GRAVITY_M_S2 + up_m_s2
    forward = over * tan(tilts_rad[0])
    return turned(forward, hypot(forward, over) * tan(tilts_rad[1]), yaw_rad)


def _squares(velocity_m_s: Plan, up_m_s: float, tilts_rad: Plan, yaw_rad: float) -> Plan:
    """What drag by mass decelerates with in plan, m^2/s^2, arena axes.

    It is the square of the velocity along a body axis, with its sign, by the cosine of its tilt: the thrust,
    which holds the height, makes up for the part upwards.
    """
    forward, left = (
        along * abs(along) / cos(tilt)
        for tilt, v in zip(tilts_rad, turned(*velocity_m_s, -yaw_rad), strict=True)
        for along in (v * cos(tilt) - up_m_s * sin(tilt),)
    )
    return turned(forward, left, yaw_rad)
