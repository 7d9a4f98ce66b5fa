"""What the flight loop needs of an estimator, and what that tells of itself and of its sensors.

The report is for telemetry, logs and the checks before arming.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from math import nan
from typing import Protocol

from firmware_py.types import VehicleState
from framerunner.geometry.vectors import NAN3, Vec3
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import ExternalPose, ImuSample, Readings, Sensors


class Sensor(Enum):
    """A kind of sensor, by its name for people."""

    GYROSCOPE = "gyroscope"
    ACCELEROMETER = "accelerometer"
    MAGNETOMETER = "magnetometer"
    BAROMETER = "barometer"
    GPS = "GPS"
    EXTERNAL_POSE = "external pose"
    RANGE_FINDER = "range finder"
    OPTICAL_FLOW = "optical flow"


IMU = frozenset({Sensor.GYROSCOPE, Sensor.ACCELEROMETER})

NOT_ALIGNED = "attitude is not known yet: keep the vehicle still"
NO_HEIGHT = "no height estimate"
NO_FIX = "GPS fix too low"


def stuck(name: str) -> str:
    """A sensor delivers always the same."""
    return f"{name} is stuck"


def silent(name: str) -> str:
    """A sensor delivers nothing."""
    return f"no valid data from {name}"


_NAMES = ("IMU", *(sensor.value for sensor in Sensor if sensor not in IMU))
PROBLEMS = (
    NOT_ALIGNED,
    NO_HEIGHT,
    NO_FIX,
    *(words(name) for name in _NAMES for words in (stuck, silent)),
)
"""What `EstimatorReport.problem` can say."""


@dataclass(frozen=True, slots=True)
class Ratios:
    """Innovations of the last measurements, as shares of what the gate lets pass; above 1: rejected.

    Zero: none yet, or no such measurement.
    """

    velocity: float = 0.0
    position_horizontal: float = 0.0
    position_vertical: float = 0.0
    heading: float = 0.0
    height_above_ground: float = 0.0


@dataclass(frozen=True, slots=True)
class EstimatorReport:
    """The estimator's condition in one tick.

    Attributes:
        present: sensors that the vehicle has.
        healthy: of those, the ones that deliver what can be used.
        relied_on: of those, the ones whose measurements are fused now.
        has_attitude: the attitude is known.
        has_velocity: the horizontal velocity is known.
        has_position: the horizontal position is known.
        has_height: the height is known.
        position_variance_m2: of north, east and down, shape (3,).
        velocity_variance_m2_s2: of north, east and down, shape (3,).
        attitude_variance_rad2: about north, east and down, shape (3,).
        ratios: of the innovations.
        height_above_ground_m: by range finder; NaN: not measured.
        vibration_rad_s: standard deviation of the gyroscope's noise, per axis and sample.
        vibration_m_s2: standard deviation of the accelerometer's noise.
        gyro_bias_frd_rad_s: estimated, shape (3,).
        accel_bias_frd_m_s2: estimated, shape (3,).
        resets: counts jumps of the estimate.
        latest: the newest sample of each sensor.
        problem: why the vehicle should not be armed, in words; empty: nothing is wrong.
    """

    present: frozenset[Sensor] = frozenset()
    healthy: frozenset[Sensor] = frozenset()
    relied_on: frozenset[Sensor] = frozenset()
    has_attitude: bool = False
    has_velocity: bool = False
    has_position: bool = False
    has_height: bool = False
    position_variance_m2: Vec3 = NAN3
    velocity_variance_m2_s2: Vec3 = NAN3
    attitude_variance_rad2: Vec3 = NAN3
    ratios: Ratios = Ratios()
    height_above_ground_m: float = nan
    vibration_rad_s: float = 0.0
    vibration_m_s2: float = 0.0
    gyro_bias_frd_rad_s: Vec3 = (0.0, 0.0, 0.0)
    accel_bias_frd_m_s2: Vec3 = (0.0, 0.0, 0.0)
    resets: int = 0
    latest: Readings = field(default_factory=lambda: Readings(0))
    problem: str = ""


class StateEstimator(Protocol):
    """Estimates the vehicle state from what the sensors deliver in each control tick.

    Attributes:
        state: the estimate, updated in place.
        stands: set by the flight loop: the vehicle is disarmed.
    """

    state: VehicleState
    stands: bool

    @property
    def has_position(self) -> bool:
        """Whether the horizontal position is measured, or was until a short while ago."""

    @property
    def origin(self) -> GeodeticPoint | None:
        """Where on Earth the local frame's origin is; None before it is known."""

    @property
    def imu(self) -> ImuSample | None:
        """The newest sample of the IMU, less its estimated biases; None if there is no IMU, or none yet."""

    def report(self) -> EstimatorReport:
        """The condition now."""

    def update(self, sensors: Sensors | Readings) -> bool:
        """Take one tick's sensors; return whether they give an estimate of this tick."""

    def take_external_pose(self, pose: ExternalPose) -> None:
        """Take a pose of motion capture or visual odometry."""
