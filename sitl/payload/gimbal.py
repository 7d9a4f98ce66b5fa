"""A simulated gimbal: it turns at a limited rate within its limits, and levels without error or delay."""

from __future__ import annotations

from math import copysign, isfinite, remainder, tau

from firmware_py.mavlink.gimbal.model import GimbalLimits, GimbalTarget
from framerunner.geometry.rotations import yaw_of
from framerunner.geometry.vectors import Quaternion
from scenarios.models import CameraMotion, Gimbal


class SimulatedGimbal:
    """A gimbal with two axes, pitch and yaw, that levels its roll.

    Args:
        settings: limits and rate.

    Attributes:
        limits: of its angles.
        pitch_rad: to the horizon, up is positive.
        yaw_rad: to the drone's heading, clockwise from above.
        pitch_rate_rad_s: in the last step.
        yaw_rate_rad_s: of turning to another angle in the last step, without the drone's own turning.
        yaw_locked: whether the yaw stays to north when the drone turns.
    """

    def __init__(self, settings: Gimbal) -> None:
        self._max_rate_rad_s = settings.rate_max_rad_s
        self.limits = GimbalLimits(settings.pitch_min_rad, settings.pitch_max_rad, settings.yaw_max_rad)
        self._target = GimbalTarget(0.0, 0.0)
        self._heading_rad = self._turn_rate_rad_s = 0.0
        self.pitch_rad = self.yaw_rad = 0.0
        self.pitch_rate_rad_s = self.yaw_rate_rad_s = 0.0

    @property
    def yaw_locked(self) -> bool:
        """Whether the yaw stays to north when the drone turns."""
        return self._target.yaw_locked

    @property
    def motion(self) -> CameraMotion:
        """Of the camera on it, as of the last step."""
        yaw_ned_rad = self._heading_rad + self.yaw_rad
        return CameraMotion(self.pitch_rad, yaw_ned_rad, self.pitch_rate_rad_s, self._turn_rate_rad_s)

    def turn(self, target: GimbalTarget) -> None:
        """Take a new target; angles beyond the limits are limited."""
        self._target = target

    def step(self, step_s: float, attitude_ned: Quaternion) -> None:
        """Advance by a time; the drone's attitude is that at its end."""
        target, limits = self._target, self.limits
        heading_rad = yaw_of(attitude_ned)
        turned_rad = remainder(heading_rad - self._heading_rad, tau)
        self._heading_rad = heading_rad

        pitch_rad = self._moved(self.pitch_rad, target.pitch_rad, target.pitch_rate_rad_s, step_s)
        pitch_rad = min(max(pitch_rad, limits.pitch_min_rad), limits.pitch_max_rad)
        self.pitch_rate_rad_s = (pitch_rad - self.pitch_rad) / step_s
        self.pitch_rad = pitch_rad

        held_rad = self.yaw_rad - turned_rad if target.yaw_locked else self.yaw_rad
        wanted_rad = target.yaw_rad - heading_rad if target.yaw_locked else target.yaw_rad
        if isfinite(wanted_rad):  # what it cannot reach it approaches on the nearer side
            wanted_rad = min(max(remainder(wanted_rad, tau), -limits.yaw_max_rad), limits.yaw_max_rad)
        yaw_rad = self._moved(held_rad, wanted_rad, target.yaw_rate_rad_s, step_s)
        yaw_rad = min(max(yaw_rad, -limits.yaw_max_rad), limits.yaw_max_rad)
        self.yaw_rate_rad_s = (yaw_rad - held_rad) / step_s
        self._turn_rate_rad_s = (yaw_rad - self.yaw_rad + turned_rad) / step_s
        self.yaw_rad = yaw_rad

    def _moved(self, angle_rad: float, wanted_rad: float, rate_rad_s: float, step_s: float) -> float:
        """An angle after a step towards another or, if that is not given, at a rate."""
        furthest_rad = self._max_rate_rad_s * step_s
        if isfinite(wanted_rad):
            change_rad = wanted_rad - angle_rad
        elif isfinite(rate_rad_s):
            change_rad = rate_rad_s * step_s
        else:
            return angle_rad
        if abs(change_rad) > furthest_rad:
            change_rad = copysign(furthest_rad, change_rad)
        return angle_rad + change_rad
