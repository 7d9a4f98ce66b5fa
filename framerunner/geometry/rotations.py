"""Quaternions, Euler angles and rotation matrices as plain scalars, as the per-tick path needs them.

Quaternions are (w, x, y, z) of unit length; an attitude turns body vectors into world vectors. Euler angles
are the aerospace sequence Z-Y-X (yaw, then pitch, then roll) that MAVLink's ATTITUDE has. The formulas are
from J. Diebel, "Representing Attitude: Euler Angles, Unit Quaternions, and Rotation Vectors", Stanford, 2006.
The formulas hold for NED with FRD and for arena axes with FLU alike.
"""

from __future__ import annotations

from math import asin, atan2, copysign, cos, hypot, pi, sin, sqrt

from framerunner.geometry.vectors import Quaternion, Vec3

Rotation = tuple[float, float, float, float, float, float, float, float, float]
"""Rows of the matrix from body to world, one after the other. From FRD to NED, the last row is world down in
body axes."""
RotationRows = tuple[Vec3, Vec3, Vec3]

MAX_MOUNTING_RAD = 0.8
"""Of a camera's roll, pitch and yaw on the body: it looks ahead."""


def rotation(attitude: Quaternion) -> Rotation:
    """The matrix of a unit quaternion, body to world."""
    w, x, y, z = attitude
    xx, yy, zz = x * x, y * y, z * z
    xy, xz, yz = x * y, x * z, y * z
    wx, wy, wz = w * x, w * y, w * z
    return (
        1.0 - 2.0 * (yy + zz),
        2.0 * (xy - wz),
        2.0 * (xz + wy),
        2.0 * (xy + wz),
        1.0 - 2.0 * (xx + zz),
        2.0 * (yz - wx),
        2.0 * (xz - wy),
        2.0 * (yz + wx),
        1.0 - 2.0 * (xx + yy),
    )


def rotation_rows(m: Rotation) -> RotationRows:
    """The matrix row by row."""
    return (m[0:3], m[3:6], m[6:9])


def to_body(m: Rotation, n: float, e: float, d: float) -> Vec3:
    """A vector in world axes, in body axes."""
    return (
        m[0] * n + m[3] * e + m[6] * d,
        m[1] * n + m[4] * e + m[7] * d,
        m[2] * n + m[5] * e + m[8] * d,
    )


def to_world(m: Rotation, x: float, y: float, z: float) -> Vec3:
    """A vector in body axes, in world axes."""
    return (
        m[0] * x + m[1] * y + m[2] * z,
        m[3] * x + m[4] * y + m[5] * z,
        m[6] * x + m[7] * y + m[8] * z,
    )


def tilt_error(m: Rotation, down_ned: Vec3) -> tuple[float, float]:
    """The shortest rotation that turns the body's down axis to a wanted direction.

    A reduced attitude error (Chaturvedi, Sanyal & McClamroch, "Rigid-Body Attitude Control", IEEE Control
    Systems Magazine, 2011): it is independent of the rotation about that axis, and singular only at the half
    turn, where it takes one of the possible axes.

    Args:
        m: attitude now.
        down_ned: unit vector that body down should point along, world NED.

    Returns:
        Angles about body forward and right, rad; their length is the angle between the axes.
    """
    x, y, z = to_body(m, *down_ned)
    sine = sqrt(x * x + y * y)
    if sine < 1e-9:
        return (0.0, 0.0) if z > 0.0 else (pi, 0.0)
    scale = atan2(sine, z) / sine
    return (-y * scale, x * scale)


def euler_from_quaternion(attitude: Quaternion) -> Vec3:
    """Euler angles of an attitude.

    Returns:
        Roll, pitch, yaw in radians; roll and yaw in -pi..pi, pitch in -pi/2..pi/2. If rounding makes the
        sine of the pitch larger than 1, the pitch is a right angle.
    """
    w, x, y, z = attitude
    sin_pitch = 2.0 * (w * y - z * x)
    roll_rad = atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch_rad = asin(sin_pitch) if -1.0 < sin_pitch < 1.0 else copysign(0.5 * pi, sin_pitch)
    return (roll_rad, pitch_rad, yaw_of(attitude))


def quaternion_from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """Attitude from Euler angles: the product of the three half-angle quaternions, yaw first."""
    half_roll, half_pitch, half_yaw = roll_rad / 2, pitch_rad / 2, yaw_rad / 2
    cr, sr = cos(half_roll), sin(half_roll)
    cp, sp = cos(half_pitch), sin(half_pitch)
    cy, sy = cos(half_yaw), sin(half_yaw)
    crcp, srsp, srcp, crsp = cr * cp, sr * sp, sr * cp, cr * sp
    return (crcp * cy + srsp * sy, srcp * cy - crsp * sy, crsp * cy + srcp * sy, crcp * sy - srsp * cy)


def mounting_flu(angles_frd_rad: Vec3) -> Quaternion:
    """How a sensor is turned on the body, from its axes forward, left, up to the body's.

    Args:
        angles_frd_rad: roll, pitch and yaw of the sensor on the body, axes forward, right, down: to the
            right, up and to the right are positive.
    """
    roll_rad, pitch_rad, yaw_rad = angles_frd_rad
    return quaternion_from_euler(roll_rad, -pitch_rad, -yaw_rad)


def quaternion_from_yaw(yaw_rad: float) -> Quaternion:
    """A level attitude with a heading."""
    return (cos(yaw_rad / 2), 0.0, 0.0, sin(yaw_rad / 2))


def yaw_of(attitude: Quaternion) -> float:
    """Heading of an attitude, from the world's first axis towards its second, radians in -pi..pi."""
    w, x, y, z = attitude
    return atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """The rotation b, then a: Hamilton's product."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def normalized(q: Quaternion) -> Quaternion:
    """A quaternion other than zero at unit length."""
    norm = hypot(*q)
    return (q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm)


def rotated_by_rate(attitude: Quaternion, rate_rad_s: Vec3, step_s: float) -> Quaternion:
    """The attitude after a time with constant body rates: q times exp(rate step / 2)."""
    rate = hypot(*rate_rad_s)
    half = rate * step_s / 2
    scale = sin(half) / rate if rate > 1e-9 else step_s / 2
    dx, dy, dz = (component * scale for component in rate_rad_s)
    return normalized(multiply(attitude, (cos(half), dx, dy, dz)))


def interpolated(a: Quaternion, b: Quaternion, share: float) -> Quaternion:
    """Between `a` (share 0) and `b` (share 1) by the shortest rotation: normalised linear interpolation.

    Accurate for small angles.
    """
    # The two quaternions of one attitude differ in sign.
    sign = 1.0 if sum(p * q for p, q in zip(a, b, strict=True)) >= 0.0 else -1.0
    w, x, y, z = ((1.0 - share) * p + sign * share * q for p, q in zip(a, b, strict=True))
    return normalized((w, x, y, z))
