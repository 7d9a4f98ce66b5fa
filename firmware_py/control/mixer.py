"""Turns thrust and moments into rotor speeds; what exceeds their limits is cut in order, yaw first."""

from __future__ import annotations

from math import sqrt

import numpy as np
import numpy.typing as npt

from firmware_py.types import MotorOutput
from framerunner.vehicle.airframe import Airframe
from framerunner.vehicle.measurements import MotorSpeeds

_IDLE_SHARE = 0.25  # of hover speed, the slowest in flight: motors must not stop in the air
_QUAD = 4


def allocation(airframe: Airframe) -> npt.NDArray[np.float64]:
    """Return the matrix from squared rotor speeds to [thrust, roll, pitch, yaw moment].

    Returns:
        Shape (4, rotors); thrust is positive upwards, moments are FRD. A thrust f at (x, y) gives the
        moment r x F = (-y f, x f, 0) with F = (0, 0, -f).
    """
    motor = airframe.motor
    columns = [
        (
            motor.thrust_n_s2,
            -rotor.position_frd_m[1] * motor.thrust_n_s2,
            rotor.position_frd_m[0] * motor.thrust_n_s2,
            rotor.yaw_sign * motor.torque_nm_s2,
        )
        for rotor in airframe.rotors
    ]
    return np.array(columns).T


class Mixer:
    """Least-squares allocation of [thrust, roll, pitch, yaw] to squared rotor speeds, within their limits."""

    def __init__(self, airframe: Airframe) -> None:
        forward = allocation(airframe)
        inverse = np.linalg.pinv(forward)
        self._columns = [tuple(map(float, column)) for column in forward.T]
        self._thrust = float(inverse[0, 0])  # symmetric rotors share the thrust evenly
        self._roll_pitch = [(float(r), float(p)) for _, r, p, _ in inverse]
        self._yaw = [float(y) for _, _, _, y in inverse]
        self._most_yaw = max(map(abs, self._yaw))
        self._maximum = airframe.motor.max_speed_rad_s**2
        self._minimum = (_IDLE_SHARE * airframe.hover_speed_rad_s) ** 2
        self._full = len(self._yaw) * self._maximum
        self._is_quad = len(self._yaw) == _QUAD

    def mix(self, thrust_n: float, roll_nm: float, pitch_nm: float, yaw_nm: float) -> MotorOutput:
        """Return speeds for a thrust (up) and moments (FRD), or the nearest; roll and pitch are cut last."""
        if not self._is_quad:
            return self._mix_within_limits(thrust_n, roll_nm, pitch_nm, yaw_nm)
        # The usual case without a loop: four rotors, no limit reached.
        (r0, p0), (r1, p1), (r2, p2), (r3, p3) = self._roll_pitch
        y0, y1, y2, y3 = self._yaw
        base = self._thrust * thrust_n
        a = base + (r0 * roll_nm + p0 * pitch_nm)
        b = base + (r1 * roll_nm + p1 * pitch_nm)
        c = base + (r2 * roll_nm + p2 * pitch_nm)
        d = base + (r3 * roll_nm + p3 * pitch_nm)
        margin = self._most_yaw * abs(yaw_nm)
        if min(a, b, c, d) - margin < self._minimum or max(a, b, c, d) + margin > self._maximum:
            return self._mix_within_limits(thrust_n, roll_nm, pitch_nm, yaw_nm)
        a, b, c, d = a + y0 * yaw_nm, b + y1 * yaw_nm, c + y2 * yaw_nm, d + y3 * yaw_nm
        return MotorOutput((sqrt(a), sqrt(b), sqrt(c), sqrt(d)), (a + b + c + d) / self._full)

    def wrench(self, speeds_rad_s: MotorSpeeds) -> tuple[float, float, float, float]:
        """Return the thrust (N, up) and moments (N m, FRD) of rotor speeds."""
        thrust = roll = pitch = yaw = 0.0
        for (lift, about_x, about_y, about_z), speed in zip(self._columns, speeds_rad_s, strict=True):
            square = speed * speed
            thrust += lift * square
            roll += about_x * square
            pitch += about_y * square
            yaw += about_z * square
        return (thrust, roll, pitch, yaw)

    def _mix_within_limits(
        self, thrust_n: float, roll_nm: float, pitch_nm: float, yaw_nm: float
    ) -> MotorOutput:
        low, high = self._minimum, self._maximum
        tilt = [r * roll_nm + p * pitch_nm for r, p in self._roll_pitch]
        minimum, maximum = min(tilt), max(tilt)
        if maximum - minimum > high - low:  # roll and pitch alone are too much: scale them
            scale = (high - low) / (maximum - minimum)
            tilt = [value * scale for value in tilt]
            minimum, maximum = minimum * scale, maximum * scale
        base = self._thrust * thrust_n
        thrust_high = base + maximum > high
        if thrust_high:
            base = high - maximum
        thrust_low = base + minimum < low
        if thrust_low:
            base = low - minimum
        share = 1.0
        for value, yaw in zip(tilt, self._yaw, strict=True):
            wanted = yaw * yaw_nm
            room = high - base - value if wanted > 0 else base + value - low
            if wanted and abs(wanted) > room:
                share = min(share, max(room, 0.0) / abs(wanted))
        yaw_nm *= share
        squares = [base + value + yaw * yaw_nm for value, yaw in zip(tilt, self._yaw, strict=True)]
        return MotorOutput(
            tuple([sqrt(square) for square in squares]),
            sum(squares) / self._full,
            thrust_high,
            thrust_low,
            share < 1.0,
        )
