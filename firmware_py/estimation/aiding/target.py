"""What all kinds of aiding work on: the filter, where its slow errors are, and jumps of its state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from firmware_py.estimation.error_state import (
    ACCEL_BIAS,
    ATTITUDE,
    GYRO_BIAS,
    INERTIAL_STATES,
    POSITION,
    VELOCITY,
    Drift,
    Matrix,
)
from firmware_py.estimation.navigation_filter import NavigationFilter
from firmware_py.estimation.settings import EstimatorSettings
from framerunner.geometry.vectors import ZERO3, Vec3

MAX_RESETS = 2
"""So often within 10 s an estimate is set to a source's measurements that do not fit."""
UNKNOWN_M2 = 1e4
"""Variance of a coordinate of which nothing is known; fusing a measurement follows."""
_UNKNOWN_RAD2 = 1.0
_DOUBT = ((ATTITUDE, 0.1), (VELOCITY, 1.0), (GYRO_BIAS, 0.1), (ACCEL_BIAS, 0.5))
_CONSTANT = Drift()


@dataclass(slots=True)
class TargetLayout:
    """Indices of the slow errors in the error state; -1: there is none.

    Place and turn of markers, and scale factors, are only considered: in flight, what little a filter could
    learn of them comes from the vehicle's own reactions to noise.
    """

    offset: int = -1
    turn: int = -1
    gyro_scale: int = -1
    accel_scale: int = -1
    field_scale: int = -1
    flow_scale: int = -1
    flow_gyro: int = -1
    hard_iron: int = -1
    barometer: int = -1
    gps: int = -1
    ground: int = -1


class Target:
    """The filter that is aided.

    Args:
        settings: which slow errors there are.

    Attributes:
        filter: nominal state and covariance.
        layout: indices of the slow errors.
        resets: counts jumps of the state.
        height_resets: counts jumps of the height.
    """

    def __init__(self, settings: EstimatorSettings) -> None:
        self.layout = layout = TargetLayout()
        drifts: list[Drift] = []
        sigmas: list[float] = []

        def add(count: int, sigma: float, drift: Drift = _CONSTANT) -> int:
            index = INERTIAL_STATES + len(drifts)
            drifts.extend([drift] * count)
            sigmas.extend([sigma] * count)
            return index

        if settings.external and settings.external_offset_sigma_m > 0.0:
            layout.offset = add(3, settings.external_offset_sigma_m)
        if settings.external and settings.external_turn_sigma_rad > 0.0:
            layout.turn = add(1, settings.external_turn_sigma_rad)
        if settings.noise.gyro_scale_sigma > 0.0:
            layout.gyro_scale = add(3, settings.noise.gyro_scale_sigma)
        if settings.noise.accel_scale_sigma > 0.0:
            layout.accel_scale = add(3, settings.noise.accel_scale_sigma)
        if settings.magnetometer_sigma_gauss is not None and settings.magnetometer_scale_sigma > 0.0:
            layout.field_scale = add(3, settings.magnetometer_scale_sigma)
        if settings.flow_sigma_rad_s is not None and settings.flow_scale_sigma > 0.0:
            layout.flow_scale = add(1, settings.flow_scale_sigma)
        if settings.flow_sigma_rad_s is not None and settings.flow_gyro_bias_sigma_rad_s > 0.0:
            layout.flow_gyro = add(2, settings.flow_gyro_bias_sigma_rad_s)
        considered = len(drifts)
        if settings.magnetometer_sigma_gauss is not None:
            layout.hard_iron = add(3, settings.hard_iron_sigma_gauss)
        if settings.barometer_sigma_pa is not None:
            slow = settings.barometer_drift
            layout.barometer = add(1, 0.0, Drift(slow.noise_density))
        if settings.gps:
            level, upright = settings.gps_drift
            layout.gps = add(2, 0.0, Drift(level.noise_density))
            add(1, 0.0, Drift(upright.noise_density))
        if settings.range_sigma_m is not None or settings.flow_sigma_rad_s is not None:
            layout.ground = add(1, 0.0)
        self.filter = NavigationFilter(
            settings.noise,
            tuple(drifts),
            considered,
            gyro_scale=layout.gyro_scale,
            accel_scale=layout.accel_scale,
        )
        for index, sigma in enumerate(sigmas, start=INERTIAL_STATES):
            self.filter.covariance.set_variance(index, sigma * sigma)
        self.resets = 0
        self.height_resets = 0

    def rows(self, count: int) -> Matrix:
        """Derivatives of measured numbers by the error state, all zero, shape (count, n)."""
        return np.zeros((count, self.filter.covariance.size))

    def drift(self, index: int) -> float:
        """The estimated slow error at an index of the error state."""
        return self.filter.drifts[index - INERTIAL_STATES]

    def set_drift(self, index: int, value: float, variance: float) -> None:
        """Set a slow error, and how well it is known."""
        self.filter.drifts[index - INERTIAL_STATES] = value
        self.filter.covariance.set_variance(index, variance)

    def move(self, axes: tuple[int, ...], position: Vec3) -> None:
        """Set coordinates to measured ones, and forget what was known of them; fusing them follows."""
        into = self.filter
        place = list(into.state.position_ned_m)
        for axis in axes:
            place[axis] = position[axis]
            into.covariance.set_variance(POSITION + axis, UNKNOWN_M2)
        into.state.position_ned_m = (place[0], place[1], place[2])
        self.resets += 1
        if 2 in axes:
            self.height_resets += 1

    def doubt(self) -> None:
        """Take attitude, velocity and biases for less certain: measurements do not fit the estimate.

        A position that was reset alone would drift away again if the cause is, say, a gyroscope whose bias
        has jumped.
        """
        p = self.filter.covariance.p
        for index, sigma in _DOUBT:
            for at in range(index, index + 3):
                p[at, at] += sigma * sigma

    def turn(self, angle_rad: float) -> None:
        """Turn the heading, and forget what was known of it; fusing it follows."""
        into = self.filter
        into.state.correct((0.0, 0.0, angle_rad), ZERO3, ZERO3)
        into.covariance.set_variance(ATTITUDE + 2, _UNKNOWN_RAD2)
        self.resets += 1
