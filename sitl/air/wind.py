"""The velocity of the air at the drone: mean wind, turbulence and gusts, in steps of time.

Turbulence is the Dryden model of MIL-F-8785C, section 3.7.1.2, discretised exactly. White noise passes
through one filter for each component of the air's velocity. With its length scale L and standard
deviation s, the airspeed V and T = L / V:

    along:         s sqrt(2 T / pi) / (1 + T p)
    across, down:  s sqrt(T / pi) (1 + sqrt(3) T p) / (1 + T p)^2

(p: Laplace variable; spectra are one-sided, per rad/s). Each step uses the exact transition matrix, and noise
of the covariance that keeps the states' stationary one; so standard deviation and spectrum do not depend on
the step. The component down has the model's ratios at the ground: half of the standard deviation, an eighth
of the length scale.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import cos, exp, hypot, log1p, pi, sin, sqrt, tau
from typing import TYPE_CHECKING

import numpy as np

from framerunner.geometry.axes import flip_vector
from framerunner.geometry.vectors import Vec3
from scenarios.air import Wind
from scenarios.random_numbers import random_stream

if TYPE_CHECKING:
    from numpy.random import Generator


DOWN_DEVIATION = 0.177**0.4  # sigma_w / sigma_u at the ground
DOWN_LENGTH = 0.177**1.2  # L_w / L_u at the ground
MIN_AIRSPEED_M_S = 1.0
"""In the model an aircraft flies through turbulence that is constant in time, so a drone at rest in the mean
wind would feel no change. Below this airspeed, turbulence changes as it does at this airspeed."""
_BLOCK = 512  # numbers drawn at once
_SQRT_3 = sqrt(3.0)


class Turbulence:
    """The three filters, in their stationary distribution from the beginning.

    Args:
        deviation_m_s: standard deviation of the components along and across.
        length_m: length scale along and across.
        period_s: time between calls of `step`.
        seed: of the noise; each component has its own stream.
    """

    def __init__(self, deviation_m_s: float, length_m: float, period_s: float, seed: int) -> None:
        self._along = _FirstOrder(deviation_m_s, length_m, period_s, random_stream(seed, "air.along"))
        self._across = _SecondOrder(deviation_m_s, length_m, period_s, random_stream(seed, "air.across"))
        self._down = _SecondOrder(
            deviation_m_s * DOWN_DEVIATION, length_m * DOWN_LENGTH, period_s, random_stream(seed, "air.down")
        )

    def set_airspeed(self, airspeed_m_s: float) -> None:
        """Set the speed of the drone through the mean wind, with which turbulence passes by."""
        airspeed_m_s = max(airspeed_m_s, MIN_AIRSPEED_M_S)
        for component in (self._along, self._across, self._down):
            component.set_airspeed(airspeed_m_s)

    def step(self) -> Vec3:
        """Advance by one period; returns the air's velocity along the mean wind, right of it, down, m/s."""
        return (self._along.step(), self._across.step(), self._down.step())


class _FirstOrder:
    """The filter of the component along: x+ = a x + sqrt(1 - a^2) w, of unit variance."""

    def __init__(self, deviation_m_s: float, length_m: float, period_s: float, stream: Generator) -> None:
        self._deviation_m_s = deviation_m_s
        self._steps_m = period_s / length_m
        self._noise = _normal_numbers(stream)
        self._x = next(self._noise)
        self.set_airspeed(MIN_AIRSPEED_M_S)

    def set_airspeed(self, airspeed_m_s: float) -> None:
        """Compute the coefficients for an airspeed."""
        self._decay = exp(-airspeed_m_s * self._steps_m)
        self._share = sqrt(1.0 - self._decay**2)

    def step(self) -> float:
        """Advance by one period; returns the component, m/s."""
        self._x = x = self._decay * self._x + self._share * next(self._noise)
        return self._deviation_m_s * x


class _SecondOrder:
    """The filter of a component across or down.

    Its states are noise after one lag and after both: T x' = w - x, T y' = x - y, with x of unit variance.
    Then their stationary covariance is [[1, 1/2], [1/2, 1/2]], and the component is proportional to
    sqrt(3) x + (1 - sqrt(3)) y, of variance 2. A step has the transition matrix e [[1, 0], [h, 1]] with
    h = period / T and e = exp(-h). [[a, 0], [b, c]] is the Cholesky factor of the noise's covariance.
    """

    def __init__(self, deviation_m_s: float, length_m: float, period_s: float, stream: Generator) -> None:
        scale_m_s = deviation_m_s / sqrt(2.0)
        self._gain_x, self._gain_y = _SQRT_3 * scale_m_s, (1.0 - _SQRT_3) * scale_m_s
        self._steps_m = period_s / length_m
        self._noise = _normal_numbers(stream)
        self._x = next(self._noise)
        self._y = (self._x + next(self._noise)) / 2.0
        self.set_airspeed(MIN_AIRSPEED_M_S)

    def set_airspeed(self, airspeed_m_s: float) -> None:
        """Compute the coefficients for an airspeed."""
        self._h = h = airspeed_m_s * self._steps_m
        self._decay = decay = exp(-h)
        square = decay * decay
        self._a = a = sqrt(1.0 - square)
        self._b = b = (0.5 - square * (h + 0.5)) / a
        self._c = sqrt(max(0.0, 0.5 - square * (h * h + h + 0.5) - b * b))  # rounding may make it negative

    def step(self) -> float:
        """Advance by one period; returns the component, m/s."""
        noise, decay, x = self._noise, self._decay, self._x
        first = next(noise)
        self._y = y = decay * (self._h * x + self._y) + self._b * first + self._c * next(noise)
        self._x = x = decay * x + self._a * first
        return self._gain_x * x + self._gain_y * y


def _normal_numbers(stream: Generator) -> Iterator[float]:
    """Independent numbers of the standard normal distribution, by Box and Muller's transformation."""
    while True:
        uniform = stream.random((2, _BLOCK))
        radius, angle = np.sqrt(-2.0 * np.log1p(-uniform[0])), 2.0 * pi * uniform[1]
        yield from (radius * np.cos(angle)).tolist()
        yield from (radius * np.sin(angle)).tolist()


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
