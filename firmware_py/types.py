"""What the autopilot knows, is told and puts out. World NED, body FRD, SI units, radians."""

from __future__ import annotations

from dataclasses import dataclass

from framerunner.geometry.vectors import Quaternion, Vec3
from framerunner.vehicle.measurements import MotorSpeeds


@dataclass(slots=True)
class VehicleState:
    """The estimate of the vehicle's state.

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
class ManualInput:
    """An operator's sticks, from MANUAL_CONTROL or RC channels.

    Attributes:
        time_us: vehicle time of reception.
        forward: right stick upwards, -1..1 (pitch: nose down).
        right: right stick to the right, -1..1 (roll).
        up: left stick upwards, -1..1; -1 is no thrust.
        yaw: left stick to the right, -1..1 (clockwise).
    """

    time_us: int
    forward: float = 0.0
    right: float = 0.0
    up: float = 0.0
    yaw: float = 0.0


@dataclass(slots=True)
class FlightRecord:
    """Times of the present or last flight, vehicle time in microseconds; 0: not yet.

    Attributes:
        armed_us: of arming.
        takeoff_us: of take-off.
        landed_us: of landing.
        number: counts armings from 1; 0 before the first.
        failsafes: status texts of the failsafes that changed the state, each with its time; oldest first.
    """

    armed_us: int = 0
    takeoff_us: int = 0
    landed_us: int = 0
    number: int = 0
    failsafes: tuple[tuple[int, str], ...] = ()


CRITICAL, WARNING, INFO = 2, 4, 6
"""MAV_SEVERITY of a `StatusText`."""


@dataclass(frozen=True, slots=True)
class StatusText:
    """A message to people, with MAV_SEVERITY."""

    severity: int
    text: str


@dataclass(slots=True)
class MotorOutput:
    """Output of one step to the motors.

    Attributes:
        speeds_rad_s: one per rotor, in the airframe's order.
        throttle: mean of (speed / maximum)^2, 0..1.
        thrust_high: the commanded thrust was too high and is reduced.
        thrust_low: the commanded thrust was too low and is raised.
        yaw_cut: the yaw moment is reduced.
    """

    speeds_rad_s: MotorSpeeds = (0.0, 0.0, 0.0, 0.0)
    throttle: float = 0.0
    thrust_high: bool = False
    thrust_low: bool = False
    yaw_cut: bool = False
