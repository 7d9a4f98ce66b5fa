"""Whether sensors deliver: their time-outs, and values that never change.

Real sensors are noisy, so a value that is the same to the last bit again and again comes from one that hangs
(PX4 calls that a stale or stuck sensor).
"""

from __future__ import annotations

from firmware_py.estimation.aiding.aid import NEVER_US
from firmware_py.estimation.report import Sensor, silent, stuck
from firmware_py.estimation.settings import EstimatorSettings
from framerunner.vehicle.measurements import ImuSample

_TIMEOUTS_US = {
    Sensor.GYROSCOPE: 50_000,
    Sensor.ACCELEROMETER: 50_000,
    Sensor.MAGNETOMETER: 500_000,
    Sensor.BAROMETER: 500_000,
    Sensor.GPS: 1_000_000,
    Sensor.EXTERNAL_POSE: 300_000,
    Sensor.RANGE_FINDER: 500_000,
    Sensor.OPTICAL_FLOW: 300_000,
}
"""Without a new sample, or with the same value, for so long, a sensor has failed."""


class SensorWatch:
    """Watches one sensor.

    Args:
        timeout_us: without a new sample, or with the same value, for so long, it has failed.
    """

    def __init__(self, timeout_us: int) -> None:
        self._timeout_us = timeout_us
        self._value: object = None
        self._arrived_us = NEVER_US
        self._changed_us = NEVER_US

    def note(self, value: object, now_us: int) -> bool:
        """Note a sample's value; return whether it may be used: it has not hung."""
        self._arrived_us = now_us
        if value != self._value:  # NaN differs from itself, but is no measurement
            self._value = value
            self._changed_us = now_us
            return True
        return now_us - self._changed_us < self._timeout_us

    def delivers(self, now_us: int) -> bool:
        """Whether it delivers usable samples."""
        return now_us - self._arrived_us < self._timeout_us and not self.is_stuck(now_us)

    def is_stuck(self, now_us: int) -> bool:
        """Whether it delivers always the same."""
        arrives = now_us - self._arrived_us < self._timeout_us
        return arrives and now_us - self._changed_us >= self._timeout_us


class SensorWatches:
    """Watches all sensors of a vehicle.

    Args:
        settings: of the estimator, which say what sensors there are.

    Attributes:
        present: sensors that it has.
    """

    def __init__(self, settings: EstimatorSettings) -> None:
        has = {
            Sensor.GYROSCOPE: True,
            Sensor.ACCELEROMETER: True,
            Sensor.MAGNETOMETER: settings.magnetometer_sigma_gauss is not None,
            Sensor.BAROMETER: settings.barometer_sigma_pa is not None,
            Sensor.GPS: settings.gps,
            Sensor.EXTERNAL_POSE: settings.external,
            Sensor.RANGE_FINDER: settings.range_sigma_m is not None,
            Sensor.OPTICAL_FLOW: settings.flow_sigma_rad_s is not None,
        }
        self._watches = {each: SensorWatch(_TIMEOUTS_US[each]) for each, present in has.items() if present}
        self._gyroscope = self._watches[Sensor.GYROSCOPE]  # noted in each tick
        self._accelerometer = self._watches[Sensor.ACCELEROMETER]
        self.present = frozenset(self._watches)

    def note(self, sensor: Sensor, value: object, now_us: int) -> bool:
        """Note a sample; return whether it may be used: it has not hung, and the vehicle should have it."""
        watch = self._watches.get(sensor)
        return watch is not None and watch.note(value, now_us)

    def note_imu(self, imu: ImuSample) -> bool:
        """Note a sample of the IMU; return whether it may be used: neither part of it has hung."""
        turns = self._gyroscope.note(imu.angular_rate_frd_rad_s, imu.time_us)
        return self._accelerometer.note(imu.specific_force_frd_m_s2, imu.time_us) and turns

    def healthy(self, now_us: int) -> frozenset[Sensor]:
        """Sensors that deliver."""
        return frozenset(sensor for sensor, watch in self._watches.items() if watch.delivers(now_us))

    def problem(self, now_us: int) -> str:
        """What is wrong, in words; empty: nothing."""
        for sensor, watch in self._watches.items():
            if watch.is_stuck(now_us):
                return stuck(sensor.value)
            if not watch.delivers(now_us):
                return silent(sensor.value)
        return ""
