"""Measurements as sensors deliver them. World NED, body FRD, SI units, radians.

Each sample carries the vehicle time at which it was true, which for some sensors is long before it arrives;
the estimator fuses it at that time. A sensor that has nothing new delivers nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from framerunner.geometry.vectors import Quaternion, Vec3

MotorSpeeds = tuple[float, ...]
"""Of each rotor, in the airframe's order, in radians a second: what an autopilot answers."""


@dataclass(frozen=True, slots=True)
class ImuSample:
    """One sample of gyroscope and accelerometer: means over the interval that ends now.

    Attributes:
        time_us: end of the interval.
        period_us: its length.
        angular_rate_frd_rad_s: rotation over the interval, divided by its length, shape (3,).
        specific_force_frd_m_s2: change of velocity over the interval without gravity, divided by its length,
            shape (3,); at rest (0, 0, -g).
    """

    time_us: int
    period_us: int
    angular_rate_frd_rad_s: Vec3
    specific_force_frd_m_s2: Vec3

    def less(self, gyro_bias_frd_rad_s: Vec3, accel_bias_frd_m_s2: Vec3) -> ImuSample:
        """The sample without biases."""
        (p, q, r), (x, y, z) = self.angular_rate_frd_rad_s, self.specific_force_frd_m_s2
        (bp, bq, br), (bx, by, bz) = gyro_bias_frd_rad_s, accel_bias_frd_m_s2
        return ImuSample(self.time_us, self.period_us, (p - bp, q - bq, r - br), (x - bx, y - by, z - bz))


@dataclass(frozen=True, slots=True)
class MagnetometerSample:
    """The magnetic field, gauss, shape (3,)."""

    time_us: int
    field_frd_gauss: Vec3


@dataclass(frozen=True, slots=True)
class BarometerSample:
    """Static pressure (Pa) and air temperature (K)."""

    time_us: int
    pressure_pa: float
    temperature_k: float


class FixType(IntEnum):
    """GPS_FIX_TYPE of MAVLink, as far as used."""

    NO_FIX = 1
    FIX_2D = 2
    FIX_3D = 3
    DGPS = 4
    RTK_FLOAT = 5
    RTK_FIXED = 6


@dataclass(frozen=True, slots=True)
class GpsSample:
    """A GNSS receiver's solution.

    Attributes:
        time_us: when it was true; it arrives later.
        fix_type: without a 3D fix, the other fields are not usable.
        latitude_deg: WGS 84, north positive.
        longitude_deg: WGS 84, east positive.
        altitude_m: above mean sea level.
        velocity_ned_m_s: shape (3,).
        horizontal_accuracy_m: one standard deviation, as the receiver reports it.
        vertical_accuracy_m: one standard deviation.
        speed_accuracy_m_s: one standard deviation.
        satellites: used.
    """

    time_us: int
    fix_type: FixType
    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    velocity_ned_m_s: Vec3
    horizontal_accuracy_m: float
    vertical_accuracy_m: float
    speed_accuracy_m_s: float
    satellites: int


@dataclass(frozen=True, slots=True)
class RangeSample:
    """A range finder's distance along body down, metres; NaN out of its range."""

    time_us: int
    distance_m: float


@dataclass(frozen=True, slots=True)
class FlowSample:
    """An optical flow sensor that looks along body down.

    Attributes:
        time_us: end of the integration.
        integration_us: its length.
        flow_rad: angle that the image of the ground has turned about body forward and right, shape (2,): with
            the gyroscope's signs, so for a drone that only turns it equals `gyro_rad`.
        gyro_rad: angle that the sensor's own gyroscope measured about the same axes, shape (2,).
        quality: 0 (unusable) to 255.
    """

    time_us: int
    integration_us: int
    flow_rad: tuple[float, float]
    gyro_rad: tuple[float, float]
    quality: int


@dataclass(frozen=True, slots=True)
class ExternalPose:
    """A pose from motion capture or visual odometry.

    Attributes:
        time_us: when it was true, in vehicle time; it arrives later.
        position_ned_m: in the source's frame, whose origin becomes that of the local frame, shape (3,).
        attitude: unit quaternion (w, x, y, z), body FRD to that frame; None: the source measures none.
        velocity_ned_m_s: shape (3,); None: the source measures none.
        position_variance_m2: of each axis, shape (3,).
        attitude_variance_rad2: about north, east, down, shape (3,).
        velocity_variance_m2_s2: of each axis, shape (3,).
        reset_counter: changes when the source's frame has jumped.
    """

    time_us: int
    position_ned_m: Vec3
    attitude: Quaternion | None
    velocity_ned_m_s: Vec3 | None
    position_variance_m2: Vec3
    attitude_variance_rad2: Vec3
    velocity_variance_m2_s2: Vec3
    reset_counter: int = 0


@dataclass(slots=True)
class Readings:
    """What the sensors deliver in one control tick; None: nothing new.

    Attributes:
        time_us: of the tick, microseconds since boot.
        imu: normally in every tick.
        magnetometer: newest sample.
        barometer: newest sample.
        gps: newest solution.
        range_finder: newest sample.
        optical_flow: newest sample.
        battery_voltage_v: at the battery's terminals.
        battery_current_a: drawn from the battery.
    """

    time_us: int
    imu: ImuSample | None = None
    magnetometer: MagnetometerSample | None = None
    barometer: BarometerSample | None = None
    gps: GpsSample | None = None
    range_finder: RangeSample | None = None
    optical_flow: FlowSample | None = None
    battery_voltage_v: float = 16.2
    battery_current_a: float = 0.0


@dataclass(slots=True)
class Sensors:
    """One sample of all sensors.

    Attributes:
        time_us: sampling time, microseconds since boot.
        position_ned_m: position relative to the geodetic origin given to the autopilot, shape (3,).
        velocity_ned_m_s: shape (3,).
        attitude: unit quaternion (w, x, y, z), body FRD to world NED.
        angular_rate_frd_rad_s: shape (3,).
        specific_force_frd_m_s2: as an accelerometer measures it, shape (3,); at rest (0, 0, -g).
        battery_voltage_v: at the battery's terminals.
        battery_current_a: drawn from the battery.
    """

    time_us: int
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3
    attitude: Quaternion
    angular_rate_frd_rad_s: Vec3
    specific_force_frd_m_s2: Vec3
    battery_voltage_v: float = 16.2
    battery_current_a: float = 0.0


@dataclass(slots=True)
class BatteryState:
    """The state of the battery.

    Attributes:
        voltage_v: at its terminals.
        current_a: drawn now.
        used_mah: since boot.
        remaining: share of the full charge, 0..1.
        cells: in series.
        warning: MAV_BATTERY_CHARGE_STATE: 1 ok, 2 low, 3 critical, 4 emergency.
    """

    voltage_v: float = 16.2
    current_a: float = 0.0
    used_mah: float = 0.0
    remaining: float = 1.0
    cells: int = 4
    warning: int = 1
