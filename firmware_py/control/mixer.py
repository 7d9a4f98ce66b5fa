"""Turns thrust and moments into rotor speeds; what cannot be had is given up in order: yaw first."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from firmware_py.airframe import Airframe
from firmware_py.control.linear_model import allocation
from firmware_py.types import MotorSpeeds


@dataclass(slots=True)
class Mixed:
    """Rotor speeds and what had to be given up for them.

    Attributes:
        speeds_rad_s: one per rotor, in the airframe's order.
        thrust_high: less thrust than asked for.
        thrust_low: more thrust than asked for.
        yaw_cut: less yaw moment than asked for.
    """

    speeds_rad_s: MotorSpeeds
    thrust_high: bool = False
    thrust_low: bool = False
    yaw_cut: bool = False


class Mixer:
    """Least-squares allocation of [thrust, roll, pitch, yaw] to squared rotor speeds, within their limits.

    Args:
        airframe: rotor positions, coefficients and limits.
        idle_fraction: slowest speed in flight as a part of hover speed; motors must not stop in the air.
    """

    def __init__(self, airframe: Airframe, idle_fraction: float = 0.25) -> None:
        inverse = np.linalg.pinv(allocation(airframe))
        self._thrust = float(inverse[0, 0])  # symmetric rotors share the thrust evenly
        self._roll_pitch = [(float(r), float(p)) for _, r, p, _ in inverse]
        self._yaw = [float(y) for _, _, _, y in inverse]
        self._maximum = airframe.motor.max_speed_rad_s**2
        self._minimum = (idle_fraction * airframe.hover_speed_rad_s) ** 2

    def mix(self, thrust_n: float, roll_nm: float, pitch_nm: float, yaw_nm: float) -> Mixed:
        """Return speeds that give this wrench, or the nearest that keeps roll and pitch longest.

        Args:
            thrust_n: positive upwards.
            roll_nm: body FRD, as the other moments.
            pitch_nm: see roll_nm.
            yaw_nm: see roll_nm.
        """
        low, high = self._minimum, self._maximum
        tilt = [r * roll_nm + p * pitch_nm for r, p in self._roll_pitch]
        least, most = min(tilt), max(tilt)
        if most - least > high - low:  # roll and pitch alone are too much: scale them
            scale = (high - low) / (most - least)
            tilt = [value * scale for value in tilt]
            least, most = least * scale, most * scale
        base = self._thrust * thrust_n
        mixed = Mixed(())
        if base + most > high:
            base, mixed.thrust_high = high - most, True
        if base + least < low:
            base, mixed.thrust_low = low - least, True
        share = 1.0
        for value, yaw in zip(tilt, self._yaw, strict=True):
            asked = yaw * yaw_nm
            room = high - base - value if asked > 0 else base + value - low
            if asked and abs(asked) > room:
                share = min(share, max(room, 0.0) / abs(asked))
        mixed.yaw_cut = share < 1.0
        yaw_nm *= share
        mixed.speeds_rad_s = tuple(
            [sqrt(base + value + yaw * yaw_nm) for value, yaw in zip(tilt, self._yaw, strict=True)]
        )
        return mixed
