"""The state of the present: the filter's, integrated from there with the IMU's samples since.

When the filter is corrected, the correction is carried to the present by the linear error model, and now and
then everything is integrated again, so that nothing adds up.
"""

from __future__ import annotations

from collections import deque

from firmware_py.estimation.error_state import ACCEL_BIAS, ATTITUDE, GYRO_BIAS, POSITION, VELOCITY
from firmware_py.estimation.navigation_filter import NavigationFilter
from firmware_py.estimation.strapdown import GRAVITY_M_S2, NavigationState
from framerunner.geometry.rotations import rotation, to_world
from framerunner.geometry.vectors import Vec3

ImuRecord = tuple[int, float, Vec3, Vec3]
"""End (us) and length (s) of a sample of the IMU, its rate and specific force."""

_CORRECTIONS_TO_REPEAT = 50
_MAX_LINEAR = 0.01  # a turn in rad or a velocity in m/s; beyond, everything is integrated again


class OutputPredictor:
    """Integrates the present state.

    Attributes:
        state: of the present.
        recent: samples of the IMU that the filter has not taken yet, oldest first.
    """

    def __init__(self) -> None:
        self.state = NavigationState()
        self.recent: deque[ImuRecord] = deque()
        self._corrections = 0

    def add(self, record: ImuRecord, filtered: NavigationFilter) -> None:
        """Integrate the newest sample."""
        self.recent.append(record)
        self._integrate(record, filtered)

    def correct(self, error: list[float], filtered: NavigationFilter) -> None:
        """Carry the filter's correction to the present.

        Args:
            error: that was added to the filter's state, shape (n,).
            filtered: the filter after it, at its own time.
        """
        self._corrections += 1
        large = max(map(abs, error[ATTITUDE:POSITION])) > _MAX_LINEAR
        if large or self._corrections >= _CORRECTIONS_TO_REPEAT:
            self.repeat(filtered)
            return
        state, before = self.state, filtered.state
        span_s = sum([record[1] for record in self.recent])
        vn, ve, vd = state.velocity_ned_m_s
        bn, be, bd = before.velocity_ned_m_s
        pn, pe, pd = vn - bn, ve - be, vd - bd - GRAVITY_M_S2 * span_s  # by the specific force since
        m = rotation(state.attitude)
        gn, ge, gd = to_world(m, *error[GYRO_BIAS:ACCEL_BIAS])
        an, ae, ad = to_world(m, *error[ACCEL_BIAS : ACCEL_BIAS + 3])
        tn, te, td = error[ATTITUDE:VELOCITY]
        dn, de, dd = error[VELOCITY:POSITION]
        xn, xe, xd = error[POSITION:GYRO_BIAS]
        half_s = 0.5 * span_s
        kn = te * pd - td * pe - an * span_s
        ke = td * pn - tn * pd - ae * span_s
        kd = tn * pe - te * pn - ad * span_s
        state.correct(
            (tn - gn * span_s, te - ge * span_s, td - gd * span_s),
            (dn + kn, de + ke, dd + kd),
            (xn + dn * span_s + kn * half_s, xe + de * span_s + ke * half_s, xd + dd * span_s + kd * half_s),
        )

    def repeat(self, filtered: NavigationFilter) -> None:
        """Integrate everything since the filter's time again."""
        self._corrections = 0
        self.state.copy_from(filtered.state)
        for record in self.recent:
            self._integrate(record, filtered)

    def _integrate(self, record: ImuRecord, filtered: NavigationFilter) -> None:
        _, period_s, (p, q, r), (x, y, z) = record
        bp, bq, br = filtered.gyro_bias_frd_rad_s
        bx, by, bz = filtered.accel_bias_frd_m_s2
        half_s = 0.5 * period_s
        p, q, r = (p - bp) * half_s, (q - bq) * half_s, (r - br) * half_s  # turn to the sample's middle
        x, y, z = (x - bx) * period_s, (y - by) * period_s, (z - bz) * period_s
        self.state.integrate(
            (p + p, q + q, r + r),
            (x + q * z - r * y, y + r * x - p * z, z + p * y - q * x),
            period_s,
        )
