"""The true motion as sensors meet it: means over a control period, made from two consecutive true states."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, sqrt

from framerunner.geometry.rotations import rotation, to_body
from framerunner.geometry.vectors import ZERO3, Quaternion, Vec3
from framerunner.vehicle.airframe import GRAVITY_M_S2

_MIN_SINE = 1e-9  # of half a turn's angle, below which the angle equals its sine in double precision


@dataclass(slots=True)
class TrueMotion:
    """The true motion in one control tick.

    The world is a plane that does not turn, with standard gravity: Earth's rate (0.004 degrees/s) and the
    local difference of gravity (at most 0.03 m/s²) are not larger than the biases of small sensors.

    Attributes:
        time_us: end of the interval, now.
        period_us: length of the interval.
        position_ned_m: of the centre of mass, from the scenario's origin on the floor, shape (3,).
        velocity_ned_m_s: shape (3,).
        attitude: unit quaternion (w, x, y, z), body FRD to NED.
        angular_rate_frd_rad_s: mean over the interval: the rotation vector from the attitude before to that
            now, divided by the period, shape (3,).
        specific_force_frd_m_s2: mean over the interval: the change of velocity divided by the period, without
            gravity, in the body axes at the interval's middle, shape (3,); at rest (0, 0, -g).
        motor_speeds_rad_s: of the rotors, in the airframe's order.
        ground_z_m: height above the floor of the surface below.
    """

    time_us: int
    period_us: int
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3
    attitude: Quaternion
    angular_rate_frd_rad_s: Vec3
    specific_force_frd_m_s2: Vec3
    motor_speeds_rad_s: tuple[float, ...]
    ground_z_m: float


class MotionTracker:
    """Makes the mean motion of each control period from the true states at its ends.

    What happens between them, such as a hard contact, is so contained in the means and not lost between two
    samples: strapdown integration of the means gives the true attitude and velocity.

    Args:
        period_us: length of a control period.
    """

    def __init__(self, period_us: int) -> None:
        self._period_us = period_us
        self._rate_hz = 1e6 / period_us
        self._attitude: Quaternion | None = None
        self._velocity_ned_m_s = ZERO3

    def update(
        self,
        time_us: int,
        position_ned_m: Vec3,
        velocity_ned_m_s: Vec3,
        attitude: Quaternion,
        *,
        motor_speeds_rad_s: tuple[float, ...],
        ground_z_m: float,
    ) -> TrueMotion:
        """Take the true state at the end of the next control period.

        At the first call, velocity and attitude are taken for constant before.

        Args:
            time_us: one period after that of the call before.
            position_ned_m: shape (3,).
            velocity_ned_m_s: shape (3,).
            attitude: unit quaternion (w, x, y, z), body FRD to NED.
            motor_speeds_rad_s: of the rotors.
            ground_z_m: height above the floor of the surface below.
        """
        before = self._attitude
        if before is None:
            before, self._velocity_ned_m_s = attitude, velocity_ned_m_s
        turn, middle = _turn(before, attitude)
        rate_hz = self._rate_hz
        north, east, down = self._velocity_ned_m_s
        specific_force = to_body(
            rotation(middle),
            (velocity_ned_m_s[0] - north) * rate_hz,
            (velocity_ned_m_s[1] - east) * rate_hz,
            (velocity_ned_m_s[2] - down) * rate_hz - GRAVITY_M_S2,
        )
        self._attitude, self._velocity_ned_m_s = attitude, velocity_ned_m_s
        return TrueMotion(
            time_us,
            self._period_us,
            position_ned_m,
            velocity_ned_m_s,
            attitude,
            (turn[0] * rate_hz, turn[1] * rate_hz, turn[2] * rate_hz),
            specific_force,
            motor_speeds_rad_s,
            ground_z_m,
        )


def _turn(before: Quaternion, after: Quaternion) -> tuple[Vec3, Quaternion]:
    """The shortest rotation from one attitude to another.

    Returns:
        Its rotation vector in body axes, rad, and the attitude halfway. The first is the logarithm of
        before^-1 after (Diebel 2006), the second their normalised sum.
    """
    aw, ax, ay, az = before
    bw, bx, by, bz = after
    w = aw * bw + ax * bx + ay * by + az * bz
    if w < 0.0:  # the two quaternions of one attitude differ in sign
        bw, bx, by, bz, w = -bw, -bx, -by, -bz, -w
    x = aw * bx - ax * bw - ay * bz + az * by
    y = aw * by + ax * bz - ay * bw - az * bx
    z = aw * bz - ax * by + ay * bx - az * bw
    sine = sqrt(x * x + y * y + z * z)
    scale = 2.0 * atan2(sine, w) / sine if sine > _MIN_SINE else 2.0
    norm = sqrt(2.0 + 2.0 * w)  # length of the sum
    turn = (x * scale, y * scale, z * scale)
    return turn, ((aw + bw) / norm, (ax + bx) / norm, (ay + by) / norm, (az + bz) / norm)
