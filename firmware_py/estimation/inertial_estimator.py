"""The vehicle state from honest sensors: an error-state Kalman filter that runs a little behind the present.

Measurements arrive later than they were true, each by its own delay. So the filter's state is that of some
hundredths of a second ago, where all of them can be fused in their order; from there the state of the present
is integrated from the IMU's samples since (as PX4's EKF2 with its delayed time horizon and output predictor).
"""

from __future__ import annotations

from heapq import heappop, heappush
from math import atan2, isfinite, sqrt

from firmware_py.estimation.aiding.aid import NEVER_US
from firmware_py.estimation.aiding.all import Aiding, Sample
from firmware_py.estimation.alignment import ImuAlignment, is_still
from firmware_py.estimation.error_state import ATTITUDE, POSITION, VELOCITY
from firmware_py.estimation.output import OutputPredictor
from firmware_py.estimation.report import IMU, NO_FIX, NO_HEIGHT, NOT_ALIGNED, EstimatorReport, Sensor
from firmware_py.estimation.settings import EstimatorSettings
from firmware_py.estimation.watch import SensorWatches
from firmware_py.types import VehicleState
from framerunner.geometry.rotations import euler_from_quaternion, yaw_of
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import ExternalPose, FixType, ImuSample, Readings, Sensors

_MAX_WAITING = 64
_MAX_LATE_US = 100_000
_MAX_GAP_US = 100_000  # between samples of the IMU
_RELIED_ON_US = 1_000_000
_STAND_PERIOD_US = 100_000
_NOISE_TICKS = 4
_NEW_SHARE = 0.016  # of a new sample of the noise in its mean: one second
_QUICK_SHARE = (
    0.25  # the same in a mean over some hundredths of a second, which shows that motors have started
)
_CHANGE = 3.0  # quick means that differ from the slow ones by this factor are taken for right
_SECOND_DIFFERENCE = 1.0 / 18.0  # of white noise in three axes: its square is six variances each


class InertialEstimator:
    """Estimates the state from `Readings` and external poses.

    Args:
        settings: of the filter.
        field_ned_gauss: Earth's magnetic field here, shape (3,).
        origin: where on Earth the frame of external poses is; None: GPS gives the local frame's origin.

    Attributes:
        state: the estimate of the present, updated in place.
        aiding: the filter and its measurements.
        stands: set by the owner: the vehicle is disarmed on the ground.
        latest: the newest sample of each sensor.
    """

    def __init__(
        self, settings: EstimatorSettings, field_ned_gauss: Vec3, origin: GeodeticPoint | None
    ) -> None:
        self.state = VehicleState()
        self.aiding = Aiding(settings, field_ned_gauss, origin)
        self.stands = True
        self._settings = settings
        self._field = field_ned_gauss
        self._alignment: ImuAlignment | None = ImuAlignment()
        self._output = OutputPredictor()
        self._waiting: list[tuple[int, int, Sample]] = []
        self._arrivals = 0
        self._resets = 0
        self.latest = Readings(0)
        self._watches = SensorWatches(settings)
        self._now_us = self._imu_us = 0
        self._ticks = 0
        noise = settings.noise
        self._floor = (noise.gyro_density**2, noise.accel_density**2)  # times the sampling rate
        self._vibration = self._quick = (0.0, 0.0)  # mean squares of the IMU's noise

    @property
    def origin(self) -> GeodeticPoint | None:
        """Where on Earth the local frame's origin is; None before it is known."""
        return self.aiding.origin if self._alignment is None else None

    @property
    def has_position(self) -> bool:
        """Whether the horizontal position is measured, or was until a short while ago."""
        return self._is_recent(self.aiding.position_us)

    def take_external_pose(self, pose: ExternalPose) -> None:
        """Take a pose from outside; it is fused at the time at which it was true."""
        numbers = (*pose.position_ned_m, *pose.position_variance_m2, *(pose.attitude or ()))
        if not self._settings.external or not all(map(isfinite, numbers)):
            return
        if not self._watches.note(Sensor.EXTERNAL_POSE, pose.position_ned_m, self._now_us):
            return
        if self._alignment is None:
            self._queue(pose)
        elif pose.attitude is not None:
            self._alignment.heading_rad = yaw_of(pose.attitude)

    def update(self, sensors: Sensors | Readings) -> bool:
        """Take what the sensors deliver in one control tick.

        Returns:
            Whether there is an estimate of this tick: the filter is aligned and the IMU has delivered.
        """
        if type(sensors) is not Readings:
            raise TypeError("this estimator needs Readings; ideal Sensors need an IdealEstimator")
        self._now_us = sensors.time_us
        self._take_slow(sensors)
        imu = sensors.imu
        if imu is None or not _is_usable(imu, self._imu_us) or not self._watches.note_imu(imu):
            return False
        self.latest.imu = imu
        since_us, self._imu_us = imu.time_us - self._imu_us, imu.time_us
        if self._alignment is not None:
            self._align(imu)
            return False
        # After lost samples, the next one stands for all of them.
        period_us = since_us if since_us < _MAX_GAP_US else imu.period_us
        rate, force = imu.angular_rate_frd_rad_s, imu.specific_force_frd_m_s2
        self._output.add((imu.time_us, period_us / 1e6, rate, force), self.aiding.target.filter)
        self._ticks += 1
        if self._ticks % _NOISE_TICKS == 0:
            self._measure_noise()
        self._advance_filter(imu)
        self._publish(imu)
        return _is_finite(self.state)

    @property
    def imu(self) -> ImuSample | None:
        """The newest sample, less the estimated biases."""
        sample, filtered = self.latest.imu, self.aiding.target.filter
        if sample is None:
            return None
        return sample.less(filtered.gyro_bias_frd_rad_s, filtered.accel_bias_frd_m_s2)

    def report(self) -> EstimatorReport:
        """The condition now."""
        aiding, watches, now_us = self.aiding, self._watches, self._now_us
        healthy = watches.healthy(now_us)
        if _has_no_fix(self.latest):
            healthy -= {Sensor.GPS}
        relied_on = aiding.relied_on(now_us - _RELIED_ON_US)
        known = self._alignment is None
        has_height = known and self._is_recent(aiding.height_us)
        return EstimatorReport(
            present=watches.present,
            healthy=healthy,
            relied_on=relied_on | IMU if known else frozenset(),
            has_attitude=known,
            has_velocity=known and self._is_recent(aiding.velocity_us),
            has_position=known and self.has_position,
            has_height=has_height,
            position_variance_m2=self._position_variance_m2(),
            velocity_variance_m2_s2=self._variances(VELOCITY),
            attitude_variance_rad2=self._variances(ATTITUDE),
            ratios=aiding.ratios(),
            height_above_ground_m=aiding.height_above_ground_m(),
            vibration_rad_s=sqrt(self._vibration[0]),
            vibration_m_s2=sqrt(self._vibration[1]),
            gyro_bias_frd_rad_s=aiding.target.filter.gyro_bias_frd_rad_s,
            accel_bias_frd_m_s2=aiding.target.filter.accel_bias_frd_m_s2,
            resets=aiding.target.resets,
            latest=self.latest,
            problem=self._problem(known=known, has_height=has_height),
        )

    def _problem(self, *, known: bool, has_height: bool) -> str:
        problem = self._watches.problem(self._now_us)
        if problem:
            return problem
        if _has_no_fix(self.latest):
            return NO_FIX
        if not known:
            return NOT_ALIGNED
        return "" if has_height else NO_HEIGHT

    def _is_recent(self, fused_us: int) -> bool:
        return fused_us != NEVER_US and self._now_us - fused_us <= self._settings.no_aid_us

    def _variances(self, index: int) -> Vec3:
        p = self.aiding.target.filter.covariance.p
        return (float(p[index, index]), float(p[index + 1, index + 1]), float(p[index + 2, index + 2]))

    def _position_variance_m2(self) -> Vec3:
        """Variances of the position on Earth, or in the frame of external poses."""
        north, east, down = self._variances(POSITION)
        if not self._settings.gps:
            return (north, east, down)
        level, upright = self._settings.gps_drift
        return (north + level.sigma**2, east + level.sigma**2, down + upright.sigma**2)

    def _take_slow(self, sensors: Readings) -> None:
        """Keep and queue what the slower sensors deliver."""
        latest = self.latest
        latest.time_us = self._now_us
        if (field := sensors.magnetometer) is not None:
            latest.magnetometer = field
            finite = isfinite(sum(field.field_frd_gauss))
            self._take_one(Sensor.MAGNETOMETER, field, field.field_frd_gauss, finite=finite)
        if (pressure := sensors.barometer) is not None:
            latest.barometer = pressure
            finite = isfinite(pressure.pressure_pa)
            self._take_one(Sensor.BAROMETER, pressure, pressure.pressure_pa, finite=finite)
        if (fix := sensors.gps) is not None:
            latest.gps = fix
            value: object = (fix.latitude_deg, fix.longitude_deg, fix.altitude_m, fix.velocity_ned_m_s)
            if fix.fix_type < FixType.FIX_3D:
                value = fix.time_us  # it has not hung
            self._take_one(Sensor.GPS, fix, value)
        if (distance := sensors.range_finder) is not None:
            latest.range_finder = distance
            self._take_one(Sensor.RANGE_FINDER, distance, distance.distance_m)
        if (flow := sensors.optical_flow) is not None:
            latest.optical_flow = flow
            finite = isfinite(sum(flow.flow_rad) + sum(flow.gyro_rad))
            self._take_one(Sensor.OPTICAL_FLOW, flow, flow.gyro_rad, finite=finite)

    def _take_one(self, sensor: Sensor, sample: Sample, value: object, *, finite: bool = True) -> None:
        """Queue a sample that may be used; a sensor has hung if `value` stays the same."""
        if finite and self._watches.note(sensor, value, self._now_us):
            self._queue(sample)

    def _queue(self, sample: Sample) -> None:
        """Keep a measurement until the filter reaches its time; one that comes too late is dropped."""
        earliest_us = self.aiding.target.filter.time_us - _MAX_LATE_US
        is_late = sample.time_us < earliest_us or len(self._waiting) >= _MAX_WAITING
        if self._alignment is None and not is_late:
            self._arrivals += 1
            heappush(self._waiting, (sample.time_us, self._arrivals, sample))

    def _align(self, imu: ImuSample) -> None:
        alignment, magnetometer = self._alignment, self.latest.magnetometer
        assert alignment is not None
        if not alignment.take(imu):
            return
        if magnetometer is not None and self._settings.magnetometer_sigma_gauss is not None:
            ahead, right = alignment.level(magnetometer.field_frd_gauss)
            alignment.heading_rad = atan2(self._field[1], self._field[0]) - atan2(right, ahead)
        if alignment.heading_rad is None:
            return
        into = self.aiding.target.filter
        alignment.start(into, self._settings.noise, alignment.heading_rad)
        into.start(imu.time_us)
        self._output.repeat(into)
        self._alignment = None
        self._publish(imu)

    def _measure_noise(self) -> None:
        """Estimate the IMU's white noise from second differences, which slow motion hardly changes."""
        recent = self._output.recent
        if len(recent) < 3:
            return
        (_, _, (p2, q2, r2), (x2, y2, z2)) = recent[-3]
        (_, _, (p1, q1, r1), (x1, y1, z1)) = recent[-2]
        (_, period_s, (p, q, r), (x, y, z)) = recent[-1]
        p, q, r = p - 2.0 * p1 + p2, q - 2.0 * q1 + q2, r - 2.0 * r1 + r2
        x, y, z = x - 2.0 * x1 + x2, y - 2.0 * y1 + y2, z - 2.0 * z1 + z2
        new_turn = (p * p + q * q + r * r) * _SECOND_DIFFERENCE
        new_push = (x * x + y * y + z * z) * _SECOND_DIFFERENCE
        (turn, push), (quick_turn, quick_push) = self._vibration, self._quick
        quick_turn += _QUICK_SHARE * (new_turn - quick_turn)
        quick_push += _QUICK_SHARE * (new_push - quick_push)
        self._quick = (quick_turn, quick_push)
        if turn < quick_turn * _CHANGE and quick_turn < turn * _CHANGE:
            turn += _NEW_SHARE * (new_turn - turn)
        else:
            turn = quick_turn
        if push < quick_push * _CHANGE and quick_push < push * _CHANGE:
            push += _NEW_SHARE * (new_push - push)
        else:
            push = quick_push
        self._vibration = (turn, push)
        gyro, accel = self._floor
        self.aiding.target.filter.white_noise = (max(turn, gyro / period_s), max(push, accel / period_s))

    def _advance_filter(self, imu: ImuSample) -> None:
        """Let the filter follow at its distance, and carry its corrections to the present."""
        recent, waiting, into = self._output.recent, self._waiting, self.aiding.target.filter
        while recent and recent[0][0] <= imu.time_us - self._settings.delay_us:
            time_us, period_s, rate, force = recent.popleft()
            into.add(time_us, period_s, rate, force)
            due_us = time_us + int(period_s * 5e5)
            while waiting and waiting[0][0] <= due_us:
                sample = heappop(waiting)[2]
                if not self.aiding.is_redundant(sample):
                    self._correct(self.aiding.fuse(sample))
            if self.stands and self._is_unaided(time_us) and is_still(imu):
                self._correct(self.aiding.stand())

    def _correct(self, error: list[float]) -> None:
        into, resets = self.aiding.target.filter, self.aiding.target.resets
        if resets == self._resets:
            self._output.correct(error, into)
        else:
            self._resets = resets
            self._output.repeat(into)

    def _is_unaided(self, now_us: int) -> bool:
        """Whether nothing but standing still tells the velocity, and that is due to be used."""
        return now_us - self.aiding.velocity_us > _STAND_PERIOD_US

    def _publish(self, imu: ImuSample) -> None:
        state, output, into = self.state, self._output.state, self.aiding.target.filter
        state.time_us = imu.time_us
        state.position_ned_m = output.position_ned_m
        state.velocity_ned_m_s = output.velocity_ned_m_s
        state.attitude = output.attitude
        state.roll_rad, state.pitch_rad, state.yaw_rad = euler_from_quaternion(output.attitude)
        p, q, r = imu.angular_rate_frd_rad_s
        bp, bq, br = into.gyro_bias_frd_rad_s
        state.angular_rate_frd_rad_s = (p - bp, q - bq, r - br)
        x, y, z = imu.specific_force_frd_m_s2
        bx, by, bz = into.accel_bias_frd_m_s2
        state.specific_force_frd_m_s2 = (x - bx, y - by, z - bz)


def _is_usable(imu: ImuSample, last_us: int) -> bool:
    """Whether a sample is finite and newer than the last."""
    p, q, r = imu.angular_rate_frd_rad_s
    x, y, z = imu.specific_force_frd_m_s2
    return imu.time_us > last_us and imu.period_us > 0 and isfinite(p + q + r + x + y + z)


def _has_no_fix(latest: Readings) -> bool:
    """Whether the receiver delivers, but has no position yet, or no longer."""
    return latest.gps is not None and latest.gps.fix_type < FixType.FIX_3D


def _is_finite(state: VehicleState) -> bool:
    """Whether every number of the estimate is finite; a sum is only if all its terms are."""
    px, py, pz = state.position_ned_m
    vx, vy, vz = state.velocity_ned_m_s
    w, x, y, z = state.attitude
    p, q, r = state.angular_rate_frd_rad_s
    return isfinite(px + py + pz + vx + vy + vz + w + x + y + z + p + q + r)
