"""Strapdown inertial navigation: attitude, velocity and position from gyroscope and accelerometer.

Scalar code, as it runs several times in a control tick. Integrated as in D. H. Titterton & J. L. Weston,
"Strapdown Inertial Navigation Technology", 2nd edition, 2004, chapter 11: the attitude by the quaternion of
the rotation vector, with the coning correction; the velocity with the rotation during the interval taken to
second order (sculling); the position by the trapezoidal rule.
"""

from __future__ import annotations

from framerunner.geometry.vectors import ZERO3, Quaternion, Vec3

GRAVITY_M_S2 = 9.80665


class NavigationState:
    """Attitude, velocity and position: the nominal state of the error-state filter.

    Attributes:
        attitude: unit quaternion (w, x, y, z), body FRD to NED.
        velocity_ned_m_s: shape (3,).
        position_ned_m: shape (3,).
    """

    def __init__(self) -> None:
        self.attitude: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self.velocity_ned_m_s: Vec3 = (0.0, 0.0, 0.0)
        self.position_ned_m: Vec3 = (0.0, 0.0, 0.0)

    def copy_from(self, other: NavigationState) -> None:
        """Take the values of another state."""
        self.attitude = other.attitude
        self.velocity_ned_m_s = other.velocity_ned_m_s
        self.position_ned_m = other.position_ned_m

    def integrate(self, turn_frd_rad: Vec3, push_frd_m_s: Vec3, period_s: float) -> Vec3:
        """Advance by one interval.

        Args:
            turn_frd_rad: rotation vector over the interval, body axes at its beginning, shape (3,).
            push_frd_m_s: integral of the specific force over the interval, body axes at its beginning,
                shape (3,).
            period_s: length of the interval.

        Returns:
            The change of velocity by the specific force alone, NED, m/s.
        """
        w, x, y, z = self.attitude
        tx, ty, tz = turn_frd_rad
        fx, fy, fz = push_frd_m_s
        # v' = v + 2 w (u x v) + 2 u x (u x v), the rotation of a vector by a quaternion (w, u)
        cx = 2.0 * (y * fz - z * fy)
        cy = 2.0 * (z * fx - x * fz)
        cz = 2.0 * (x * fy - y * fx)
        push_n = fx + w * cx + y * cz - z * cy
        push_e = fy + w * cy + z * cx - x * cz
        push_d = fz + w * cz + x * cy - y * cx

        # sin(t/2)/t and cos(t/2) as series: a tick's angle is a few hundredths of a radian at most.
        square = tx * tx + ty * ty + tz * tz
        half = 0.5 - square * (1.0 / 48.0 - square / 3840.0)
        cosine = 1.0 - square * (0.125 - square / 384.0)
        tx, ty, tz = tx * half, ty * half, tz * half
        nw = w * cosine - x * tx - y * ty - z * tz
        nx = w * tx + x * cosine + y * tz - z * ty
        ny = w * ty - x * tz + y * cosine + z * tx
        nz = w * tz + x * ty - y * tx + z * cosine
        scale = 1.5 - 0.5 * (nw * nw + nx * nx + ny * ny + nz * nz)  # to unit length, to first order
        self.attitude = (nw * scale, nx * scale, ny * scale, nz * scale)

        vn, ve, vd = self.velocity_ned_m_s
        pn, pe, pd = self.position_ned_m
        new_n, new_e, new_d = vn + push_n, ve + push_e, vd + push_d + GRAVITY_M_S2 * period_s
        half_s = 0.5 * period_s
        self.velocity_ned_m_s = (new_n, new_e, new_d)
        self.position_ned_m = (
            pn + (vn + new_n) * half_s,
            pe + (ve + new_e) * half_s,
            pd + (vd + new_d) * half_s,
        )
        return (push_n, push_e, push_d)

    def correct(self, turn_ned_rad: Vec3, velocity_ned_m_s: Vec3, position_ned_m: Vec3) -> None:
        """Add an estimated error: a small rotation about the axes of NED, a velocity and a position."""
        w, x, y, z = self.attitude
        tx, ty, tz = turn_ned_rad
        square = tx * tx + ty * ty + tz * tz
        half = 0.5 - square / 48.0
        cosine = 1.0 - square * (0.125 - square / 384.0)
        tx, ty, tz = tx * half, ty * half, tz * half
        nw = cosine * w - tx * x - ty * y - tz * z
        nx = cosine * x + tx * w + ty * z - tz * y
        ny = cosine * y - tx * z + ty * w + tz * x
        nz = cosine * z + tx * y - ty * x + tz * w
        norm = (nw * nw + nx * nx + ny * ny + nz * nz) ** -0.5
        self.attitude = (nw * norm, nx * norm, ny * norm, nz * norm)
        n, e, d = self.velocity_ned_m_s
        self.velocity_ned_m_s = (n + velocity_ned_m_s[0], e + velocity_ned_m_s[1], d + velocity_ned_m_s[2])
        n, e, d = self.position_ned_m
        self.position_ned_m = (n + position_ned_m[0], e + position_ned_m[1], d + position_ned_m[2])


class Increments:
    """Sums of samples of the IMU over an interval, in body axes at its beginning.

    Attributes:
        period_s: length of the interval.
        turn_frd_rad: rotation vector, shape (3,).
        push_frd_m_s: integral of the specific force, shape (3,).
    """

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Begin a new interval."""
        self.period_s = 0.0
        self.turn_frd_rad = ZERO3
        self.push_frd_m_s = ZERO3

    def add(self, period_s: float, rate_frd_rad_s: Vec3, force_frd_m_s2: Vec3) -> None:
        """Add a sample.

        Args:
            period_s: length of its interval.
            rate_frd_rad_s: mean angular rate, shape (3,).
            force_frd_m_s2: mean specific force, in body axes at the sample's middle, shape (3,).
        """
        p, q, r = rate_frd_rad_s
        x, y, z = force_frd_m_s2
        tx, ty, tz = self.turn_frd_rad
        dx, dy, dz = 0.5 * p * period_s, 0.5 * q * period_s, 0.5 * r * period_s
        mx, my, mz = tx + dx, ty + dy, tz + dz  # turn to the sample's middle
        vx, vy, vz = self.push_frd_m_s
        cx, cy, cz = my * z - mz * y, mz * x - mx * z, mx * y - my * x
        self.push_frd_m_s = (
            vx + (x + cx + 0.5 * (my * cz - mz * cy)) * period_s,
            vy + (y + cy + 0.5 * (mz * cx - mx * cz)) * period_s,
            vz + (z + cz + 0.5 * (mx * cy - my * cx)) * period_s,
        )
        self.turn_frd_rad = (
            mx + dx + ty * dz - tz * dy,
            my + dy + tz * dx - tx * dz,
            mz + dz + tx * dy - ty * dx,
        )
        self.period_s += period_s
