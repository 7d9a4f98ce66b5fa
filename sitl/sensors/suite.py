"""Sensor suites: the files that declare them, and all sensors of a drone together."""

from __future__ import annotations

from pathlib import Path

from framerunner.errors import UserError
from framerunner.files.yaml_file import FileKind
from framerunner.vehicle.airframe import Airframe
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import ExternalPose, Readings
from sitl.sensors.battery_monitor import BatterySensor
from sitl.sensors.environment import Barometer, Gps, Magnetometer
from sitl.sensors.ground import OpticalFlow, RangeFinder
from sitl.sensors.imu import ImuSensor
from sitl.sensors.motion_capture import MotionCapture
from sitl.sensors.specs import SuiteSpec
from sitl.sensors.truth import TrueMotion


class SuiteError(UserError):
    """A sensor suite that cannot be used; the message is one line for people."""


SUITE_FILES = FileKind(
    "suite", SuiteSpec, SuiteError, folder="suites", package="sitl.sensors", extension="sensors"
)


def load_suite(name_or_path: str | Path) -> SuiteSpec:
    """Load an installed suite or any YAML file.

    Args:
        name_or_path: a name of `SUITE_FILES`, or a path: it has a directory or ends in .yaml or .yml.

    Raises:
        SuiteError: there is no such suite, or the file is not a valid one; the message names line, field,
            value and what to do.
    """
    suite = SUITE_FILES.load(name_or_path)
    if suite is None:
        raise SUITE_FILES.unknown(str(name_or_path))
    return suite


class SensorSuite:
    """All sensors of a drone. An ideal suite has no models, and delivers the battery's values only.

    Each sensor draws from its own streams of random numbers, so a suite with one sensor less gives the same
    samples of all others.

    Args:
        spec: which sensors there are, and their figures.
        airframe: of the drone.
        origin: where on Earth the scenario is.
        seed: of all random numbers, 0 to `scenarios.random_numbers.MAX_SEED`.
    """

    def __init__(self, spec: SuiteSpec, airframe: Airframe, origin: GeodeticPoint, seed: int) -> None:
        self._imu = ImuSensor(spec.imu, airframe, seed) if spec.imu else None
        self._magnetometer = Magnetometer(spec.magnetometer, origin, seed) if spec.magnetometer else None
        self._barometer = Barometer(spec.barometer, origin, seed) if spec.barometer else None
        self._gps = Gps(spec.gps, origin, seed) if spec.gps else None
        self._range_finder = RangeFinder(spec.range_finder, seed) if spec.range_finder else None
        self._optical_flow = OpticalFlow(spec.optical_flow, seed) if spec.optical_flow else None
        pose = spec.external_pose
        simulated = pose is not None and pose.source == "simulated"
        self._motion_capture = MotionCapture(pose, seed) if pose is not None and simulated else None
        self._battery = BatterySensor(spec.battery, seed) if spec.battery else None

    def read(
        self, motion: TrueMotion, battery_voltage_v: float, battery_current_a: float
    ) -> tuple[Readings, ExternalPose | None]:
        """Measure once in each control tick.

        Args:
            motion: of this tick.
            battery_voltage_v: the true one.
            battery_current_a: the true one.

        Returns:
            What has arrived in this tick, and the pose of motion capture if one has.
        """
        if self._battery is not None:
            battery_voltage_v, battery_current_a = self._battery.measure(battery_voltage_v, battery_current_a)
        readings = Readings(
            motion.time_us,
            self._imu.sample(motion) if self._imu else None,
            self._magnetometer.sample(motion) if self._magnetometer else None,
            self._barometer.sample(motion) if self._barometer else None,
            self._gps.sample(motion) if self._gps else None,
            self._range_finder.sample(motion) if self._range_finder else None,
            self._optical_flow.sample(motion) if self._optical_flow else None,
            battery_voltage_v,
            battery_current_a,
        )
        return readings, self._motion_capture.sample(motion) if self._motion_capture else None
