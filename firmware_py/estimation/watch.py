"""Whether sensors deliver: their time-outs, and values that never change.

Real sensors are noisy, so a value that is the same to the last bit again and again comes from one that hangs
(PX4 calls that a stale or stuck sensor).
"""

from __future__ import annotations

from firmware_py.estimation.aiding.aid import NEVER_US
from firmware_py.estimation.report import IMU, Sensor, silent, stuck
from firmware_py.estimation.settings import EstimatorSettings
from framerunner.vehicle.measurements import ImuSample

_TIMEOUTS_US = {
    Sensor.MAGNETOMETER: 500_000,
    Sensor.BAROMETER: 500_000,
    Sensor.GPS: 1_000_000,
    Sensor.EXTERNAL_POSE: 300_000,
    Sensor.RANGE_FINDER: 500_000,
    Sensor.OPTICAL_FLOW: 300_000,
}
"""Without a sample for so long, a sensor has failed."""
_IMU_TIMEOUT_US = 50_000


class SensorWatch:
    """Watches one sensor.

    Args:
        timeout_us: without a new sample for so long, it has failed.
        stuck_us: with the same value for so long, it has failed, too.

    Attributes:
        arrived_us: when a sample with a new value arrived last.
    """

    __slots__ = ("_stuck_us", "_timeout_us", "_value", "arrived_us", "changed_us")

    def __init__(self, timeout_us: int, stuck_us: int) -> None:
        self._timeout_us = timeout_us
        self._stuck_us = stuck_us
        self._value: object = None
        self.arrived_us = NEVER_US
        self.changed_us = NEVER_US

    def note(self, value: object, now_us: int) -> bool:
        """Note a sample's value; return whether it may be used: it has not hung."""
        self.arrived_us = now_us
        if value != self._value:  # NaN differs from itself, but is no measurement
            self._value = value
            self.changed_us = now_us
            return True
        return now_us - self.changed_us < self._stuck_us

    def delivers(self, now_us: int) -> bool:
        """Whether it delivers usable samples."""
        return now_us - self.arrived_us < self._timeout_us and not self.is_stuck(now_us)

    def is_stuck(self, now_us: int) -> bool:
        """Whether it delivers always the same."""
        return now_us - self.arrived_us < self._timeout_us and now_us - self.changed_us >= self._stuck_us


class SensorWatches:
    """Watches all sensors of a vehicle.

    Args:
        watches: of the slower sensors that it has.

    Attributes:
        present: sensors that it has.
    """

    def __init__(self, watches: dict[Sensor, SensorWatch]) -> None:
        self._watches = watches
        self._gyroscope = SensorWatch(_IMU_TIMEOUT_US, _IMU_TIMEOUT_US)
        self._accelerometer = SensorWatch(_IMU_TIMEOUT_US, _IMU_TIMEOUT_US)
        self.present = IMU | frozenset(watches)

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
        slow = frozenset(sensor for sensor, watch in self._watches.items() if watch.delivers(now_us))
        if self._gyroscope.delivers(now_us):
            slow |= {Sensor.GYROSCOPE}
        return slow | {Sensor.ACCELEROMETER} if self._accelerometer.delivers(now_us) else slow

    def problem(self, now_us: int) -> str:
        """What is wrong, in words; empty: nothing."""
        imu = [(Sensor.GYROSCOPE, self._gyroscope), (Sensor.ACCELEROMETER, self._accelerometer)]
        named = [(sensor.value, watch) for sensor, watch in (*imu, *self._watches.items())]
        for name, watch in named:
            if watch.is_stuck(now_us):
                return stuck(name)
            if not watch.delivers(now_us):
                return silent(name)
        return ""


def watch_sensors(settings: EstimatorSettings) -> SensorWatches:
    """Watches for the sensors that an estimator is set up for."""
    sensors = {
        Sensor.MAGNETOMETER: settings.magnetometer_sigma_gauss is not None,
        Sensor.BAROMETER: settings.barometer_sigma_pa is not None,
        Sensor.GPS: settings.gps,
        Sensor.EXTERNAL_POSE: settings.external,
        Sensor.RANGE_FINDER: settings.range_sigma_m is not None,
        Sensor.OPTICAL_FLOW: settings.flow_sigma_rad_s is not None,
    }
    return SensorWatches(
        {
            sensor: SensorWatch(_TIMEOUTS_US[sensor], _TIMEOUTS_US[sensor])
            for sensor, present in sensors.items()
            if present
        }
    )
