"""Aiding by GPS: velocity, and a position that has a slow error of its own.

The local frame's origin is where the vehicle started, so its place in that frame is known well; where that
is on Earth is known as well as the first good solution was. The slow error counts from that solution on, as a
random walk. So the estimate of the place in the local frame does not follow the slow error of GPS.
"""

from __future__ import annotations

from math import isfinite

from firmware_py.estimation.aiding.aid import NEVER_US, Aid
from firmware_py.estimation.aiding.target import MAX_RESETS, UNKNOWN_M2, Target
from firmware_py.estimation.error_state import POSITION, VELOCITY
from firmware_py.estimation.settings import EstimatorSettings
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.geodesy import GeodeticPoint, LocalProjection
from framerunner.vehicle.measurements import FixType, GpsSample

_SETTLING_US = 1_000_000  # of good solutions before the first is used
_MAX_ACCURACY_M = (3.0, 5.0)  # horizontal and vertical; PX4: EKF2_REQ_EPH, EKF2_REQ_EPV
_MAX_SPEED_ACCURACY_M_S = 0.5  # PX4: EKF2_REQ_SACC
_MIN_SATELLITES = 6  # PX4: EKF2_REQ_NSATS


class GpsAiding:
    """Position and velocity on Earth.

    Args:
        target: that is aided.
        settings: gates and noise.
        origin: of the local frame, if it is known; None: the first good position.

    Attributes:
        horizontal: of the horizontal position.
        vertical: of the height.
        velocity: of the velocity.
        origin: of the local frame on Earth; None: not known yet.
    """

    def __init__(self, target: Target, settings: EstimatorSettings, origin: GeodeticPoint | None) -> None:
        self._target = target
        self._sigma_m = settings.gps_sigma_m
        gate, reset_us = settings.gate, settings.reset_us
        self.horizontal = Aid("GPS position", 2, gate, reset_us, MAX_RESETS)
        self.vertical = Aid("GPS height", 1, gate, reset_us, MAX_RESETS)
        self.velocity = Aid("GPS velocity", 3, gate, reset_us, MAX_RESETS)
        self.origin = origin
        self._projection: LocalProjection | None = None
        self._good_us = NEVER_US

    def fuse(self, sample: GpsSample) -> None:
        """Correct by a solution, if it is good enough."""
        if not _is_good(sample):
            self._good_us = NEVER_US
            return
        if self._good_us == NEVER_US:
            self._good_us = sample.time_us
        if sample.time_us - self._good_us < _SETTLING_US and self.horizontal.fused_us == NEVER_US:
            return
        place = GeodeticPoint(sample.latitude_deg, sample.longitude_deg, sample.altitude_m)
        into = self._target.filter
        if self._projection is None:
            self._projection = self._projection_at(place, into.state.position_ned_m)
            for axis in range(3):  # of the first solution, white noise counts as part of the slow error
                self._target.set_drift(self._target.layout.gps + axis, 0.0, UNKNOWN_M2)
        late_s = (sample.time_us - into.time_us) / 1e6
        vn, ve, vd = into.state.velocity_ned_m_s
        n, e, d = self._projection.to_local(place)
        self._fuse_velocity(sample)
        self._fuse_position((n - vn * late_s, e - ve * late_s, d - vd * late_s))

    def _projection_at(self, place: GeodeticPoint, position_ned_m: Vec3) -> LocalProjection:
        """The local frame's projection, if a place on Earth is at a position in that frame."""
        if self.origin is None:
            north_m, east_m, down_m = position_ned_m
            self.origin = LocalProjection(place).to_geodetic((-north_m, -east_m, -down_m))
        return LocalProjection(self.origin)

    def _fuse_velocity(self, sample: GpsSample) -> None:
        into, variance = self._target.filter, sample.speed_accuracy_m_s**2
        if self.velocity.is_overdue(into.time_us):
            self._target.doubt()
            into.state.velocity_ned_m_s = sample.velocity_ned_m_s
            into.covariance.set_variance(VELOCITY, variance, variance, variance)
            self.velocity.accept_any()
            self._target.resets += 1
        own = into.state.velocity_ned_m_s
        innovations = tuple(
            [measured - known for measured, known in zip(sample.velocity_ned_m_s, own, strict=True)]
        )
        self.velocity.fuse_states(into, VELOCITY, innovations, (variance, variance, variance))

    def _fuse_position(self, position: Vec3) -> None:
        target, index = self._target, self._target.layout.gps
        into = target.filter
        level_m, upright_m = self._sigma_m
        for aid, axes, sigma_m in ((self.horizontal, (0, 1), level_m), (self.vertical, (2,), upright_m)):
            if aid.is_overdue(into.time_us):
                target.doubt()
                target.move(axes, position)
                aid.accept_any()
            rows, innovations = target.rows(len(axes)), []
            for row, axis in zip(rows, axes, strict=True):
                row[POSITION + axis] = row[index + axis] = 1.0
                known_m = into.state.position_ned_m[axis] + target.drift(index + axis)
                innovations.append(position[axis] - known_m)
            variance_m2 = aid.variance(tuple(innovations), sigma_m * sigma_m, into.time_us)
            aid.fuse_rows(into, rows, innovations, (variance_m2,) * len(axes))


def _is_good(sample: GpsSample) -> bool:
    horizontal_m, vertical_m = _MAX_ACCURACY_M
    return (
        sample.fix_type >= FixType.FIX_3D
        and sample.satellites >= _MIN_SATELLITES
        and sample.horizontal_accuracy_m <= horizontal_m
        and sample.vertical_accuracy_m <= vertical_m
        and sample.speed_accuracy_m_s <= _MAX_SPEED_ACCURACY_M_S
        and isfinite(sample.latitude_deg + sample.longitude_deg + sample.altitude_m)
        and isfinite(sum(sample.velocity_ned_m_s))
    )
