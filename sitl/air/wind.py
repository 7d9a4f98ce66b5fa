"""The velocity of the air at the drone: mean wind, turbulence and gusts, in steps of time."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, hypot, log1p, pi, sin, tau

from framerunner.geometry.axes import flip_vector
from framerunner.geometry.vectors import Vec3
from scenarios.air import Wind
from scenarios.random_numbers import random_stream
from sitl.air.turbulence import Turbulence

_AIRSPEED_STEPS = 25  # between updates of the turbulence's airspeed: 0.1 s


class SimulatedWind:
    """The moving air of a scenario, the same for the same seed and the same velocities of the drone.

    The mean wind is the same everywhere, also close to the floor and behind obstacles.

    Args:
        wind: as declared.
        seed: of turbulence and gusts.
        period_s: time between calls of `step`.
    """

    def __init__(self, wind: Wind, seed: int, period_s: float) -> None:
        forward, left = cos(wind.direction_rad), sin(wind.direction_rad)
        self._forward, self._right = forward, -left  # the wind's direction in north and east
        mean_ned = flip_vector((wind.speed_m_s * forward, wind.speed_m_s * left, 0.0))
        self._mean_ned_m_s: Vec3 = mean_ned
        self._turbulence = (
            Turbulence(wind.turbulence_m_s, wind.length_m, period_s, seed)
            if wind.turbulence_m_s > 0
            else None
        )
        self._gusts = _Gusts(wind, seed) if wind.gust_m_s > 0 else None
        self._period_s = period_s
        self._steps = 0

    def step(self, velocity_ned_m_s: Callable[[], Vec3]) -> Vec3:
        """Advance by one period.

        Args:
            velocity_ned_m_s: called for the drone's velocity over ground when it is needed.

        Returns:
            The air's velocity over ground during the period: north, east, down, m/s.
        """
        north, east, down = self._mean_ned_m_s
        turbulence = self._turbulence
        if turbulence is not None:
            if self._steps % _AIRSPEED_STEPS == 0:
                own_north, own_east, own_down = velocity_ned_m_s()
                turbulence.set_airspeed(hypot(own_north - north, own_east - east, own_down - down))
            along, across, sinking = turbulence.step()
            north += along * self._forward - across * self._right
            east += along * self._right + across * self._forward
            down += sinking
        if self._gusts is not None:
            gust_north, gust_east = self._gusts.velocity_m_s(self._steps * self._period_s)
            north += gust_north
            east += gust_east
        self._steps += 1
        return (north, east, down)


class _Gusts:
    """Gusts of one length, one after another, each v/2 (1 - cos(2 pi t / length)) in a random direction.

    The shape is that of MIL-F-8785C, section 3.7.1.3, followed by its mirror image. Pauses between gusts are
    distributed exponentially, so gusts do not overlap and none can be foreseen.
    """

    def __init__(self, wind: Wind, seed: int) -> None:
        self._stream = random_stream(seed, "air.gusts")
        self._half_m_s = wind.gust_m_s / 2
        self._length_s = wind.gust_s
        self._mean_pause_s = wind.gust_period_s - wind.gust_s
        self._end_s = 0.0
        self._draw()

    def velocity_m_s(self, time_s: float) -> tuple[float, float]:
        """The gusts' velocity, north and east; times must not decrease."""
        while time_s >= self._end_s:
            self._draw()
        since_s = time_s - self._begin_s
        if since_s <= 0.0:
            return (0.0, 0.0)
        speed_m_s = self._half_m_s * (1.0 - cos(2.0 * pi * since_s / self._length_s))
        return (speed_m_s * self._north, speed_m_s * self._east)

    def _draw(self) -> None:
        """Draw the next gust."""
        pause_s = -self._mean_pause_s * log1p(-self._stream.random())
        self._begin_s = self._end_s + pause_s
        self._end_s = self._begin_s + self._length_s
        direction_rad = tau * self._stream.random()
        self._north, self._east = cos(direction_rad), sin(direction_rad)
