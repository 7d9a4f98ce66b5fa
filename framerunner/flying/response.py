"""Lets the simulated vehicle answer commands late, as many real ones do, and wander in height.

A command is turned into the vehicle's local frame when it arrives, as PX4 does; after the dead time it is the
aim of a first-order lag. The autopilot's own delay comes on top: for the abejorro 0.43 s horizontally, 0.1 s
in height and heading. In the air, a slow vertical velocity is added, so that the height wanders while a
velocity of zero is commanded. Nothing is random but the wander's periods and phases, which a seed determines.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import cos, exp, tau
from random import Random

from framerunner.geometry.vectors import ZERO3, Vec3, turned

WANDER_PERIODS_S = (8.0, 15.0)
"""Between these, each of the two sine waves of the height has its period."""


@dataclass(frozen=True, slots=True)
class ResponseDelay:
    """How late a vehicle answers.

    Attributes:
        lag_s: time constant of its velocity and yaw rate.
        dead_time_s: before anything of a command is seen.
        height_wander_m: greatest deviation of the height from its mean.
    """

    lag_s: float = 0.0
    dead_time_s: float = 0.0
    height_wander_m: float = 0.0

    def __str__(self) -> str:
        """As on the command line, without what is zero."""
        values = {"lag": self.lag_s, "dead-time": self.dead_time_s, "height-wander": self.height_wander_m}
        return ",".join(f"{name}={value:g}" for name, value in values.items() if value)


class LateResponse:
    """What a vehicle that answers late makes of its commands: what the autopilot is to fly now.

    Args:
        response: how late.
        seed: of the wander in height.
    """

    def __init__(self, response: ResponseDelay, seed: int) -> None:
        self._lag_s = response.lag_s
        self._dead_us = round(response.dead_time_s * 1e6)
        random = Random(seed)
        # The velocity of a sine wave of half the deviation: amplitude (m/s), angular rate and phase.
        self._waves = []
        for _ in range(2):
            rate_rad_s = tau / random.uniform(*WANDER_PERIODS_S)
            phase_rad = random.uniform(0.0, tau)
            self._waves.append((0.5 * response.height_wander_m * rate_rad_s, rate_rad_s, phase_rad))
        self._waiting: deque[tuple[int, Vec3, float]] = deque()
        self._aim: tuple[Vec3, float] = (ZERO3, 0.0)
        self._now: tuple[Vec3, float] = (ZERO3, 0.0)
        self._last_us: int | None = None

    def take(self, velocity_level_m_s: Vec3, yaw_rate_rad_s: float, yaw_rad: float, time_us: int) -> None:
        """Take a command.

        Args:
            velocity_level_m_s: forward, right, down.
            yaw_rate_rad_s: clockwise.
            yaw_rad: the vehicle's now, clockwise from north.
            time_us: vehicle time now.
        """
        forward, right, down = velocity_level_m_s
        velocity_ned_m_s = (*turned(forward, right, yaw_rad), down)
        self._waiting.append((time_us + self._dead_us, velocity_ned_m_s, yaw_rate_rad_s))

    def step(self, yaw_rad: float, time_us: int, *, airborne: bool) -> tuple[Vec3, float]:
        """What is flown from now on: velocity forward, right, down (m/s), and yaw rate (rad/s, clockwise)."""
        while self._waiting and self._waiting[0][0] <= time_us:
            _, velocity_ned_m_s, yaw_rate_rad_s = self._waiting.popleft()
            self._aim = (velocity_ned_m_s, yaw_rate_rad_s)
        step_s = 0.0 if self._last_us is None else (time_us - self._last_us) * 1e-6
        self._last_us = time_us
        kept = exp(-step_s / self._lag_s) if self._lag_s > 0.0 else 0.0
        (aim_n, aim_e, aim_d), aim_turn = self._aim
        (north, east, down), turn = self._now
        north, east = aim_n + kept * (north - aim_n), aim_e + kept * (east - aim_e)
        down, turn = aim_d + kept * (down - aim_d), aim_turn + kept * (turn - aim_turn)
        self._now = ((north, east, down), turn)
        if airborne:
            time_s = time_us * 1e-6
            down += sum([m_s * cos(rate * time_s + phase) for m_s, rate, phase in self._waves])
        return (*turned(north, east, -yaw_rad), down), turn

    def reset(self) -> None:
        """Forget all commands: commanding has ended."""
        self._waiting.clear()
        self._aim = self._now = (ZERO3, 0.0)
        self._last_us = None
