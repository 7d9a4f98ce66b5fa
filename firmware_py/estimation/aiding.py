"""Measurements from outside the IMU, and how each corrects the filter.

A measurement is fused when the filter's state has the time at which it was true. What is left of that
difference, less than a control tick, is bridged with the estimated velocity.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, isfinite, pi, remainder, sin, tan

import numpy as np

from firmware_py.estimation.aid import NEVER_US, Aid
from firmware_py.estimation.error_state import (
    ATTITUDE,
    INERTIAL_STATES,
    POSITION,
    VELOCITY,
    Drift,
    Matrix,
)
from firmware_py.estimation.navigation_filter import NavigationFilter
from firmware_py.estimation.settings import EstimatorSettings
from firmware_py.geodesy import LocalProjection
from firmware_py.measurements import (
    BarometerSample,
    ExternalPose,
    FixType,
    GpsSample,
    MagnetometerSample,
)
from firmware_py.types import GeodeticPoint
from geometry.rotations import Rotation, euler_from_quaternion, rotation, to_body, yaw_of
from geometry.vectors import ZERO3, Vec3

_GPS_SETTLING_US = 1_000_000  # of good solutions before the first is used
_MAX_GPS_ACCURACY_M = (3.0, 5.0)  # horizontal and vertical; PX4: EKF2_REQ_EPH, EKF2_REQ_EPV
_MAX_GPS_SPEED_ACCURACY_M_S = 0.5  # PX4: EKF2_REQ_SACC
_MAX_PITCH_RAD = 1.3
_UNKNOWN_M2 = 1e4
_UNKNOWN_RAD2 = 1.0
_MIN_SATELLITES = 6  # PX4: EKF2_REQ_NSATS

Sample = ExternalPose | GpsSample | MagnetometerSample | BarometerSample


@dataclass(slots=True)
class _Layout:
    """Indices of the slow errors in the error state; -1: there is none.

    Place and turn of markers are only considered: in flight, what little a filter could learn of them comes
    from the vehicle's own reactions to noise.
    """

    offset: int = -1
    turn: int = -1
    considered: int = 0
    hard_iron: int = -1
    barometer: int = -1
    gps: int = -1


class Aiding:
    """All measurements that aid the filter.

    Args:
        settings: which are fused.
        field_ned_gauss: Earth's magnetic field here, shape (3,).
        origin: where on Earth the local frame is, if that is known; None: GPS gives it.

    Attributes:
        filter: that is aided.
        horizontal: positions from outside or GPS.
        vertical: heights from outside or GPS.
        velocity: of GPS.
        heading: headings from outside.
        magnetometer: of the field's three components.
        barometer: of the height.
        origin: of the local frame on Earth; None: not known yet.
        resets: counts jumps of the estimated position.
    """

    def __init__(
        self, settings: EstimatorSettings, field_ned_gauss: Vec3, origin: GeodeticPoint | None
    ) -> None:
        self._settings = settings
        self._field = field_ned_gauss
        self._layout, drifts = _layout(settings)
        self.filter = NavigationFilter(settings.noise, drifts, self._layout.considered)
        self._know_constants()
        gate, reset_us = settings.gate, settings.reset_us
        self.horizontal = Aid("horizontal position", 2, gate, reset_us)
        self.vertical = Aid("height", 1, gate, reset_us)
        self.velocity = Aid("velocity", 3, gate, reset_us)
        self.heading = Aid("heading", 1, gate, reset_us)
        self.magnetometer = Aid("magnetic field", 3, gate, reset_us)
        self.barometer = Aid("pressure altitude", 1, gate, reset_us)
        self.origin = origin
        self.resets = 0
        self._projection: LocalProjection | None = None
        self._gps_good_us = NEVER_US
        self._barometer_zero_m = 0.0  # pressure altitude where the height is 0
        self._row: Matrix = np.zeros(self.filter.covariance.size)

    @property
    def aids(self) -> tuple[Aid, ...]:
        """All of them."""
        return (
            self.horizontal,
            self.vertical,
            self.velocity,
            self.heading,
            self.magnetometer,
            self.barometer,
        )

    def _know_constants(self) -> None:
        """What is known of constant errors at boot."""
        settings, layout, covariance = self._settings, self._layout, self.filter.covariance
        for index, count, sigma in (
            (layout.offset, 3, settings.external_offset_sigma_m),
            (layout.turn, 1, settings.external_turn_sigma_rad),
            (layout.hard_iron, 3, settings.hard_iron_sigma_gauss),
            (layout.gps, 2, settings.gps_drift[0].sigma),
            (layout.gps + 2, 1, settings.gps_drift[1].sigma),
        ):
            if index >= INERTIAL_STATES:
                covariance.set_variance(index, *[sigma * sigma] * count)

    def fuse(self, sample: Sample) -> list[float]:
        """Correct the filter by a measurement of its time; return the errors found, shape (n,)."""
        self.filter.predict()
        if type(sample) is ExternalPose:
            self._fuse_pose(sample)
        elif type(sample) is BarometerSample:
            self._fuse_barometer(sample)
        elif type(sample) is MagnetometerSample:
            self._fuse_magnetometer(sample)
        elif type(sample) is GpsSample:
            self._fuse_gps(sample)
        return self.filter.correct()

    def stand(self) -> list[float]:
        """Use that the vehicle stands still, while nothing else tells its position; see `fuse`."""
        self.filter.predict()
        covariance, state = self.filter.covariance, self.filter.state
        for axis, velocity in enumerate(state.velocity_ned_m_s):
            covariance.fuse_state(VELOCITY + axis, -velocity, 0.01)
        for axis in (0, 1):
            covariance.fuse_state(POSITION + axis, -state.position_ned_m[axis], 0.25)
        return self.filter.correct()

    def _fuse_pose(self, pose: ExternalPose) -> None:
        into = self.filter
        late_s = (pose.time_us - into.time_us) / 1e6
        vn, ve, vd = into.state.velocity_ned_m_s
        n, e, d = pose.position_ned_m
        m = rotation(into.state.attitude)
        position = (n - vn * late_s, e - ve * late_s, d - vd * late_s)
        variance = pose.position_variance_m2
        for aid, axes in ((self.horizontal, (0, 1)), (self.vertical, (2,))):
            if aid.is_needed(into.time_us):
                self._move(axes, position)
                aid.accept_any()
            if not self._fuse_position(aid, axes, position, variance, m):
                return  # what else the pose says is not believed either
        if pose.attitude is not None:
            self._fuse_heading(yaw_of(pose.attitude), pose.attitude_variance_rad2[2])

    def _fuse_position(
        self, aid: Aid, axes: tuple[int, ...], position: Vec3, variance: Vec3, m: Rotation
    ) -> bool:
        """Correct by coordinates of the markers, whose place on the vehicle is not known exactly."""
        into, index = self.filter, self._layout.offset
        own = into.state.position_ned_m
        innovations = tuple([position[axis] - own[axis] for axis in axes])
        variances = tuple([variance[axis] for axis in axes])
        if index < 0:
            return aid.fuse_states(into, POSITION + axes[0], innovations, variances)
        rows = []
        for axis in axes:
            row: Matrix = np.zeros(into.covariance.size)
            row[POSITION + axis] = 1.0
            row[index : index + 3] = m[3 * axis : 3 * axis + 3]
            rows.append(row)
        return aid.fuse_rows(into, tuple(rows), innovations, variances)

    def _fuse_heading(self, yaw_rad: float, variance: float) -> None:
        """Correct by a heading: its change by the error of attitude is (cos y tan p, sin y tan p, 1)."""
        into, row, index = self.filter, self._row, self._layout.turn
        _, pitch_rad, estimated_rad = euler_from_quaternion(into.state.attitude)
        if abs(pitch_rad) > _MAX_PITCH_RAD:
            return  # there is no heading
        slope = tan(pitch_rad)
        row[:] = 0.0
        row[ATTITUDE : ATTITUDE + 3] = (cos(estimated_rad) * slope, sin(estimated_rad) * slope, 1.0)
        innovation = remainder(yaw_rad - estimated_rad, 2.0 * pi)
        if index >= 0:
            row[index] = 1.0
        if self.heading.is_overdue(into.time_us):
            self._turn(innovation)
            innovation = 0.0
            self.heading.accept_any()
        self.heading.fuse_rows(into, (row,), (innovation,), (variance,))

    def _fuse_barometer(self, sample: BarometerSample) -> None:
        sigma_m = self._settings.barometer_sigma_m
        if sigma_m is None or not sample.pressure_pa > 0.0:
            return
        into, index = self.filter, self._layout.barometer
        altitude_m = pressure_altitude_m(sample.pressure_pa)
        height_m = -into.state.position_ned_m[2]
        if self.barometer.fused_us == NEVER_US:
            self._barometer_zero_m = altitude_m - height_m
            into.drifts[index - INERTIAL_STATES] = 0.0
            into.covariance.set_variance(index, _UNKNOWN_M2)  # fusing relates it to the height
        row = self._row
        row[:] = 0.0
        row[POSITION + 2], row[index] = -1.0, 1.0
        predicted_m = height_m + into.drifts[index - INERTIAL_STATES] + self._barometer_zero_m
        self.barometer.fuse_rows(into, (row,), (altitude_m - predicted_m,), (sigma_m * sigma_m,))

    def _fuse_magnetometer(self, sample: MagnetometerSample) -> None:
        """Correct by the field in body axes, R' m + hard iron; an error t of attitude adds R' (m x t)."""
        sigma = self._settings.magnetometer_sigma_gauss
        if sigma is None:
            return
        into, index = self.filter, self._layout.hard_iron
        m = rotation(into.state.attitude)
        n, e, d = self._field
        predicted = to_body(m, n, e, d)
        rows, innovations = [], []
        for axis in range(3):
            row: Matrix = np.zeros(into.covariance.size)
            x, y, z = m[axis], m[axis + 3], m[axis + 6]  # the body's axis in the world
            row[ATTITUDE : ATTITUDE + 3] = (y * d - z * e, z * n - x * d, x * e - y * n)
            row[index + axis] = 1.0
            hard_iron = into.drifts[index + axis - INERTIAL_STATES]
            innovations.append(sample.field_frd_gauss[axis] - predicted[axis] - hard_iron)
            rows.append(row)
        variance = sigma * sigma
        self.magnetometer.fuse_rows(into, tuple(rows), tuple(innovations), (variance, variance, variance))

    def _fuse_gps(self, sample: GpsSample) -> None:
        into = self.filter
        if not self._settings.gps or not self._is_good(sample):
            self._gps_good_us = NEVER_US
            return
        if self._gps_good_us == NEVER_US:
            self._gps_good_us = sample.time_us
        if sample.time_us - self._gps_good_us < _GPS_SETTLING_US and self.horizontal.fused_us == NEVER_US:
            return
        place = GeodeticPoint(sample.latitude_deg, sample.longitude_deg, sample.altitude_m)
        if self.origin is None:
            self.origin = place
        if self._projection is None:
            self._projection = LocalProjection(self.origin)
        late_s = (sample.time_us - into.time_us) / 1e6
        vn, ve, vd = into.state.velocity_ned_m_s
        n, e, d = self._projection.to_local(place)
        position = (n - vn * late_s, e - ve * late_s, d - vd * late_s)
        self._fuse_gps_velocity(sample)
        self._fuse_gps_position(position)

    def _is_good(self, sample: GpsSample) -> bool:
        horizontal_m, vertical_m = _MAX_GPS_ACCURACY_M
        return (
            sample.fix_type >= FixType.FIX_3D
            and sample.satellites >= _MIN_SATELLITES
            and sample.horizontal_accuracy_m <= horizontal_m
            and sample.vertical_accuracy_m <= vertical_m
            and sample.speed_accuracy_m_s <= _MAX_GPS_SPEED_ACCURACY_M_S
            and isfinite(sample.latitude_deg + sample.longitude_deg + sample.altitude_m)
        )

    def _fuse_gps_velocity(self, sample: GpsSample) -> None:
        into, variance = self.filter, sample.speed_accuracy_m_s**2
        state = into.state
        if self.velocity.is_overdue(into.time_us):
            state.velocity_ned_m_s = sample.velocity_ned_m_s
            into.covariance.set_variance(VELOCITY, variance, variance, variance)
            self.velocity.accept_any()
            self.resets += 1
        innovations = tuple(
            measured - own
            for measured, own in zip(sample.velocity_ned_m_s, state.velocity_ned_m_s, strict=True)
        )
        self.velocity.fuse_states(into, VELOCITY, innovations, (variance, variance, variance))

    def _fuse_gps_position(self, position: Vec3) -> None:
        """Correct by a position that has a slow error of its own."""
        into, settings, first_index = self.filter, self._settings, self._layout.gps
        level, upright = settings.gps_sigma_m
        for aid, axes, sigma in ((self.horizontal, (0, 1), level), (self.vertical, (2,), upright)):
            if aid.is_needed(into.time_us):
                self._move(axes, position)
                aid.accept_any()
            rows, innovations = [], []
            for axis in axes:
                row: Matrix = np.zeros(into.covariance.size)
                row[POSITION + axis] = row[first_index + axis] = 1.0
                drift = into.drifts[first_index + axis - INERTIAL_STATES]
                rows.append(row)
                innovations.append(position[axis] - into.state.position_ned_m[axis] - drift)
            aid.fuse_rows(into, tuple(rows), tuple(innovations), (sigma * sigma,) * len(axes))

    def _move(self, axes: tuple[int, ...], position: Vec3) -> None:
        """Set coordinates to measured ones, and forget what was known of them; fusing them follows."""
        into = self.filter
        place = list(into.state.position_ned_m)
        for axis in axes:
            place[axis] = position[axis]
            into.covariance.set_variance(POSITION + axis, _UNKNOWN_M2)
        into.state.position_ned_m = (place[0], place[1], place[2])
        if 2 in axes:
            self.barometer.fused_us = NEVER_US  # its zero moves with the height
        self.resets += 1

    def _turn(self, angle_rad: float) -> None:
        """Turn the heading, and forget what was known of it."""
        into = self.filter
        into.state.correct((0.0, 0.0, angle_rad), ZERO3, ZERO3)
        into.covariance.set_variance(ATTITUDE + 2, _UNKNOWN_RAD2)
        self.resets += 1


def _layout(settings: EstimatorSettings) -> tuple[_Layout, tuple[Drift, ...]]:
    """The slow errors that are estimated, and where in the error state they are."""
    layout, drifts = _Layout(), list[Drift]()
    if settings.external and settings.external_offset_sigma_m > 0.0:
        layout.offset = INERTIAL_STATES
        drifts += [Drift()] * 3
    if settings.external and settings.external_turn_sigma_rad > 0.0:
        layout.turn = INERTIAL_STATES + len(drifts)
        drifts.append(Drift())
    layout.considered = len(drifts)
    if settings.magnetometer_sigma_gauss is not None:
        layout.hard_iron = INERTIAL_STATES + len(drifts)
        drifts += [Drift()] * 3
    if settings.barometer_sigma_m is not None:
        layout.barometer = INERTIAL_STATES + len(drifts)
        slow = settings.barometer_drift
        drifts.append(Drift(slow.noise_density, slow.time_constant_s))
    if settings.gps:
        layout.gps = INERTIAL_STATES + len(drifts)
        level, upright = settings.gps_drift
        drifts += [Drift(slow.noise_density, slow.time_constant_s) for slow in (level, level, upright)]
    return (layout, tuple(drifts))


def pressure_altitude_m(pressure_pa: float) -> float:
    """Altitude of a pressure in the International Standard Atmosphere below 11 km (ISO 2533)."""
    return float(288.15 / 0.0065 * (1.0 - (pressure_pa / 101_325.0) ** (1.0 / 5.25588)))
