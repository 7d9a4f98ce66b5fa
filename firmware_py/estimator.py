"""Sensors to vehicle state. For ideal sensors it passes values through; it refuses samples it cannot use."""

from __future__ import annotations

from math import asin, atan2, copysign, isfinite, pi

from firmware_py.types import Quaternion, Sensors, Vec3, VehicleState

_NORM_TOLERANCE = 0.05  # of the attitude quaternion's squared length; more than rounding, so it is a fault


class Estimator:
    """Keeps the vehicle state, with positions relative to the first usable sample (PX4's local frame).

    Attributes:
        state: the estimate, updated in place; it keeps its last value while samples are unusable.
        origin_ned_m: the local frame's origin in the sensors' frame, shape (3,); None before a first sample.
    """

    __slots__ = ("origin_ned_m", "state")

    def __init__(self) -> None:
        self.state = VehicleState()
        self.origin_ned_m: Vec3 | None = None

    def update(self, sensors: Sensors) -> bool:
        """Take one sample.

        Returns:
            Whether it was usable: all values finite, the attitude a unit quaternion and newer than the last.
        """
        state = self.state
        origin = self.origin_ned_m
        if not _is_sound(sensors) or (origin is not None and sensors.time_us <= state.time_us):
            return False
        position = sensors.position_ned_m
        if origin is None:
            origin = self.origin_ned_m = position
        state.time_us = sensors.time_us
        state.position_ned_m = (position[0] - origin[0], position[1] - origin[1], position[2] - origin[2])
        state.velocity_ned_m_s = sensors.velocity_ned_m_s
        state.attitude = sensors.attitude
        state.roll_rad, state.pitch_rad, state.yaw_rad = euler_angles(sensors.attitude)
        state.angular_rate_frd_rad_s = sensors.angular_rate_frd_rad_s
        state.specific_force_frd_m_s2 = sensors.specific_force_frd_m_s2
        return True


def euler_angles(attitude: Quaternion) -> Vec3:
    """Aerospace Euler angles (Z-Y-X) of an attitude.

    Args:
        attitude: unit quaternion (w, x, y, z), body FRD to world NED.

    Returns:
        Roll, pitch, yaw in radians, shape (3,); roll and yaw in -pi..pi, pitch in -pi/2..pi/2.
    """
    w, x, y, z = attitude
    sin_pitch = 2.0 * (w * y - z * x)
    roll_rad = atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch_rad = asin(sin_pitch) if -1.0 < sin_pitch < 1.0 else copysign(0.5 * pi, sin_pitch)
    yaw_rad = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return (roll_rad, pitch_rad, yaw_rad)


def _is_sound(sensors: Sensors) -> bool:
    px, py, pz = sensors.position_ned_m
    vx, vy, vz = sensors.velocity_ned_m_s
    w, x, y, z = sensors.attitude
    p, q, r = sensors.angular_rate_frd_rad_s
    ax, ay, az = sensors.specific_force_frd_m_s2
    # A sum is finite only if every term is: one check instead of sixteen on the per-tick path.
    if not isfinite(px + py + pz + vx + vy + vz + p + q + r + ax + ay + az):
        return False
    return abs(w * w + x * x + y * y + z * z - 1.0) < _NORM_TOLERANCE  # false for NaN too
