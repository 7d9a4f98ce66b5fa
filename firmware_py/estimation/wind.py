"""The wind, from the drag that the accelerometer feels.

Thrust acts along the body's down axis, so across it the accelerometer feels only drag, which depends on the
velocity through the air: f = -(k w + c |a|) a / m, with the linear drag of the rotors at their speed w and
the quadratic drag of the body (as PX4's EKF2 fuses multicopter drag). An extended Kalman filter of filterpy
follows the horizontal wind as a random walk; it runs five times a second.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, sqrt
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from firmware_py.estimation.strapdown import GRAVITY_M_S2
from framerunner.geometry.rotations import rotation, to_body

if TYPE_CHECKING:
    from firmware_py.types import VehicleState
    from framerunner.vehicle.airframe import Airframe

_TICKS = 50  # averaged for an update: 0.2 s
_WALK_M_S = 0.2  # by which the wind changes in a second, 1 sigma
_START_SIGMA_M_S = 3.0
_FORCE_SIGMA_M_S2 = 0.06  # of a mean: vibration of 0.4 m/s^2 in a sample
_BIAS_SIGMA_M_S2 = 0.03  # of the accelerometer's bias, of which hovering shows nothing
_MIN_AIRSPEED_M_S = 0.5  # of linearisation: below, quadratic drag tells too little
_MAX_SIGMA_M_S = 1.5  # of an estimate that is published


@dataclass(frozen=True, slots=True)
class WindEstimate:
    """The air's velocity over ground.

    Attributes:
        velocity_ned_m_s: north and east, shape (2,).
        sigma_m_s: standard deviation of each.
        airspeed_m_s: horizontal speed of the vehicle through the air.
    """

    velocity_ned_m_s: tuple[float, float]
    sigma_m_s: float
    airspeed_m_s: float


class WindEstimator:
    """Estimates the horizontal wind in flight.

    Args:
        airframe: with its drag.
        period_s: time between calls of `step`.
    """

    def __init__(self, airframe: Airframe, period_s: float) -> None:
        from filterpy.kalman import ExtendedKalmanFilter  # noqa: PLC0415 - imports matplotlib: half a second

        forward, right, _ = airframe.drag.force_n_s2_m2
        self._quadratic = (forward / airframe.mass_kg, right / airframe.mass_kg)
        rotors_rad_s = len(airframe.rotors) * airframe.hover_speed_rad_s
        self._linear = airframe.air.rotor_drag_n_s2_m_rad * rotors_rad_s / airframe.mass_kg
        self._filter = kalman = ExtendedKalmanFilter(dim_x=2, dim_z=2)
        kalman.P *= _START_SIGMA_M_S**2
        kalman.Q *= _WALK_M_S**2 * _TICKS * period_s
        kalman.R *= _FORCE_SIGMA_M_S2**2
        self._rotor_speed = self._slope = 1.0
        self._airspeed_m_s = 0.0
        self._turn: npt.NDArray[np.float64] = np.eye(2)
        self._own: npt.NDArray[np.float64] = np.zeros((2, 1))
        self._x = self._y = self._z = 0.0  # sums of the specific force
        self._count = 0

    @property
    def estimate(self) -> WindEstimate | None:
        """The wind; None: not known, because the drag is too small, or before the first flight."""
        kalman = self._filter
        variance = float(max(kalman.P[0, 0], kalman.P[1, 1])) + (_BIAS_SIGMA_M_S2 / self._slope) ** 2
        if variance > _MAX_SIGMA_M_S**2:
            return None
        north, east = kalman.x[:, 0].tolist()
        return WindEstimate((north, east), sqrt(variance), self._airspeed_m_s)

    def step(self, state: VehicleState, *, flying: bool) -> None:
        """Take one tick's estimate of the vehicle; on the ground nothing is learnt."""
        if not flying:
            self._clear()
            return
        x, y, z = state.specific_force_frd_m_s2
        self._x, self._y, self._z = self._x + x, self._y + y, self._z + z
        self._count += 1
        if self._count == _TICKS:
            self._update(state)
            self._clear()

    def _clear(self) -> None:
        self._x = self._y = self._z = 0.0
        self._count = 0

    def _update(self, state: VehicleState) -> None:
        force = np.array([[self._x], [self._y]]) / _TICKS
        self._rotor_speed = sqrt(max(-self._z / _TICKS, 0.0) / GRAVITY_M_S2)  # relative to hover
        m = rotation(state.attitude)
        self._turn = np.array([[m[0], m[3]], [m[1], m[4]]])  # from NED to body axes, horizontal winds only
        self._own = np.array(to_body(m, *state.velocity_ned_m_s)).reshape(3, 1)[:2]
        kalman = self._filter
        kalman.predict()
        kalman.update(force, self._jacobian, self._force)
        through = self._own - self._turn @ kalman.x
        self._airspeed_m_s = hypot(*through[:, 0].tolist())

    def _shares(self, through: npt.NDArray[np.float64], power: float) -> npt.NDArray[np.float64]:
        """Drag per mass and velocity along forward and right, times the power of the quadratic part."""
        speeds = np.maximum(np.abs(through[:, 0]), _MIN_AIRSPEED_M_S)
        return self._linear * self._rotor_speed + power * np.array(self._quadratic) * speeds

    def _force(self, wind: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """The specific force across the body's down axis in a wind, shape (2, 1)."""
        through = self._own - self._turn @ wind
        return -self._shares(through, 1.0)[:, None] * through

    def _jacobian(self, wind: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        slopes = self._shares(self._own - self._turn @ wind, 2.0)
        self._slope = float(max(slopes.min(), 1e-6))
        return slopes[:, None] * self._turn
