"""Aiding by what surrounds the vehicle everywhere: air pressure and Earth's magnetic field."""

from __future__ import annotations

from math import isfinite

from firmware_py.estimation.aiding.aid import Aid
from firmware_py.estimation.aiding.target import UNKNOWN_M2, Target
from firmware_py.estimation.error_state import ATTITUDE, POSITION
from firmware_py.estimation.settings import EstimatorSettings
from framerunner.geometry.rotations import rotation, to_body
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.atmosphere import metres_per_pascal, pressure_altitude_m
from framerunner.vehicle.measurements import BarometerSample, MagnetometerSample


class BarometerAiding:
    """The height by air pressure, which drifts; it starts from the height that is known by others.

    Args:
        target: that is aided.
        settings: gate and noise.

    Attributes:
        height: of the pressure altitude.
    """

    def __init__(self, target: Target, settings: EstimatorSettings) -> None:
        self._target = target
        self._variance_pa2 = (settings.barometer_sigma_pa or 0.0) ** 2
        self.height = Aid("pressure altitude", 1, settings.gate, settings.reset_us)
        self._zero_m = 0.0  # pressure altitude where the height is 0
        self._height_resets = -1

    def fuse(self, sample: BarometerSample) -> None:
        """Correct by a pressure."""
        if not (isfinite(sample.pressure_pa) and sample.pressure_pa > 0.0):
            return
        target, index, aid = self._target, self._target.layout.barometer, self.height
        into = target.filter
        altitude_m = pressure_altitude_m(sample.pressure_pa)
        height_m = -into.state.position_ned_m[2]
        if self._height_resets != target.height_resets or aid.is_needed(into.time_us):
            self._height_resets = target.height_resets
            self._zero_m = altitude_m - height_m
            target.set_drift(index, 0.0, UNKNOWN_M2)  # fusing relates it to the height
            aid.accept_any()
        row = target.rows(1)
        row[0, POSITION + 2], row[0, index] = -1.0, 1.0
        predicted_m = height_m + target.drift(index) + self._zero_m
        variance_m2 = self._variance_pa2 * metres_per_pascal(sample.pressure_pa) ** 2
        aid.fuse_rows(into, row, (altitude_m - predicted_m,), (variance_m2,))


class MagnetometerAiding:
    """The attitude by Earth's magnetic field, with a constant error of the magnetometer.

    Args:
        target: that is aided.
        settings: gate and noise.
        field_ned_gauss: Earth's field here, shape (3,).

    Attributes:
        field: of the three components.
    """

    def __init__(self, target: Target, settings: EstimatorSettings, field_ned_gauss: Vec3) -> None:
        self._target = target
        self._variance = (settings.magnetometer_sigma_gauss or 0.0) ** 2
        self._earth = field_ned_gauss
        self.field = Aid("magnetic field", 3, settings.gate, settings.reset_us)

    def fuse(self, sample: MagnetometerSample) -> None:
        """Correct by the field in body axes, R' m + hard iron; an error t of attitude adds R' (m x t)."""
        target, index, scale = self._target, self._target.layout.hard_iron, self._target.layout.field_scale
        into = target.filter
        m = rotation(into.state.attitude)
        n, e, d = self._earth
        predicted = to_body(m, n, e, d)
        rows, innovations = target.rows(3), []
        for axis, row in enumerate(rows):
            x, y, z = m[axis], m[axis + 3], m[axis + 6]  # the body's axis in the world
            row[ATTITUDE : ATTITUDE + 3] = (y * d - z * e, z * n - x * d, x * e - y * n)
            row[index + axis] = 1.0
            if scale >= 0:
                row[scale + axis] = predicted[axis]
            innovations.append(sample.field_frd_gauss[axis] - predicted[axis] - target.drift(index + axis))
        self.field.fuse_rows(into, rows, innovations, (self._variance,) * 3)
