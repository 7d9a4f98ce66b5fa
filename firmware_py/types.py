"""The data that goes into and out of the autopilot. World NED, body FRD, SI units, radians."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

Vec3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
MotorSpeeds = tuple[float, ...]

NAN3: Vec3 = (nan, nan, nan)


@dataclass(slots=True)
class Sensors:
    """One sample of all sensors.

    Attributes:
        time_us: sampling time, microseconds since boot.
        position_ned_m: position relative to the geodetic origin given to the autopilot, shape (3,).
        velocity_ned_m_s: shape (3,).
        attitude: unit quaternion (w, x, y, z), body FRD to world NED.
        angular_rate_frd_rad_s: shape (3,).
        specific_force_frd_m_s2: what an accelerometer reads, shape (3,); at rest (0, 0, -g).
    """

    time_us: int
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3
    attitude: Quaternion
    angular_rate_frd_rad_s: Vec3
    specific_force_frd_m_s2: Vec3


@dataclass(slots=True)
class VehicleState:
    """What the autopilot believes about the vehicle.

    Attributes:
        time_us: time of the sample, microseconds since boot.
        position_ned_m: relative to where the vehicle booted (PX4's local frame), shape (3,).
        velocity_ned_m_s: shape (3,).
        attitude: unit quaternion (w, x, y, z), body FRD to world NED.
        roll_rad: aerospace Euler angles of the attitude (Z-Y-X).
        pitch_rad: see roll_rad.
        yaw_rad: see roll_rad; clockwise from north, -pi..pi.
        angular_rate_frd_rad_s: shape (3,).
        specific_force_frd_m_s2: shape (3,).
    """

    time_us: int = 0
    position_ned_m: Vec3 = (0.0, 0.0, 0.0)
    velocity_ned_m_s: Vec3 = (0.0, 0.0, 0.0)
    attitude: Quaternion = (1.0, 0.0, 0.0, 0.0)
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    angular_rate_frd_rad_s: Vec3 = (0.0, 0.0, 0.0)
    specific_force_frd_m_s2: Vec3 = (0.0, 0.0, -9.80665)


@dataclass(frozen=True, slots=True)
class Setpoint:
    """What an offboard controller asks for; NaN in a component means "not controlled" (PX4's convention).

    Attributes:
        time_us: vehicle time of reception, microseconds.
        position_ned_m: in the local frame, shape (3,).
        velocity_ned_m_s: shape (3,). Used alone or as feed-forward beside a position.
        acceleration_ned_m_s2: shape (3,).
        yaw_rad: clockwise from north.
        yaw_rate_rad_s: clockwise.
        velocity_level_m_s: forward, right, down in level axes that turn with the yaw, shape (3,), if the
            velocity was given so; then it is flown, and velocity_ned_m_s is what it was at reception.
    """

    time_us: int
    position_ned_m: Vec3 = NAN3
    velocity_ned_m_s: Vec3 = NAN3
    acceleration_ned_m_s2: Vec3 = NAN3
    yaw_rad: float = nan
    yaw_rate_rad_s: float = nan
    velocity_level_m_s: Vec3 = NAN3


@dataclass(frozen=True, slots=True)
class RateCommand:
    """What the stabiliser follows: velocity in level axes turned with the yaw, and a yaw rate.

    Attributes:
        velocity_level_m_s: forward, right, down; shape (3,).
        yaw_rate_rad_s: clockwise seen from above.
    """

    velocity_level_m_s: Vec3 = (0.0, 0.0, 0.0)
    yaw_rate_rad_s: float = 0.0


@dataclass(frozen=True, slots=True)
class GeodeticPoint:
    """A place on Earth: degrees (WGS 84) and metres above mean sea level."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float


@dataclass(frozen=True, slots=True)
class StatusText:
    """A message to people; severity is MAV_SEVERITY (3 error, 4 warning, 6 info)."""

    severity: int
    text: str


@dataclass(slots=True)
class MotorOutput:
    """What the last step sent to the motors.

    Attributes:
        speeds_rad_s: one per rotor, in the airframe's order.
        throttle: mean of (speed / maximum)^2, 0..1.
        thrust_high: less thrust than asked for.
        thrust_low: more thrust than asked for.
        yaw_cut: less yaw moment than asked for.
    """

    speeds_rad_s: MotorSpeeds = (0.0, 0.0, 0.0, 0.0)
    throttle: float = 0.0
    thrust_high: bool = False
    thrust_low: bool = False
    yaw_cut: bool = False
