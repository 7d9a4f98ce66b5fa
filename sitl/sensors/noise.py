"""What all sensor models share: normal random numbers, slow errors, sampling times and delays."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from math import exp, sqrt
from typing import Generic, TypeVar

from framerunner.geometry.vectors import Vec3
from scenarios.random_numbers import random_stream

_BLOCK = 256  # rows drawn at once; a call of numpy costs as much as many numbers

Sample = TypeVar("Sample")


def normal_numbers(seed: int, name: str, width: int) -> Iterator[list[float]]:
    """Independent numbers from the standard normal distribution, without end.

    Args:
        seed: of all random numbers.
        name: of the stream; see `scenarios.random_numbers.random_stream`.
        width: numbers in each list.
    """
    stream = random_stream(seed, name)
    while True:
        yield from stream.standard_normal((_BLOCK, width)).tolist()


def normal_vector(seed: int, name: str, sigma: float) -> Vec3:
    """Draw a constant error once: three independent normal numbers with this standard deviation."""
    x, y, z = next(normal_numbers(seed, name, 3))
    return (sigma * x, sigma * y, sigma * z)


class GaussMarkov:
    """First-order Gauss-Markov process: a slow error with zero mean and exponential autocorrelation.

    Its autocorrelation is sigma^2 exp(-|t| / time constant), for any steps (Gelb, "Applied Optimal
    Estimation", MIT Press, 1974). It begins in its steady state.

    Args:
        seed: of all random numbers.
        name: of its stream.
        sigma: standard deviation of each component, which gives the process its unit.
        time_constant_s: of the autocorrelation.

    Attributes:
        values: the components now, shape (n,).
    """

    def __init__(self, seed: int, name: str, width: int, sigma: float, time_constant_s: float) -> None:
        self._numbers = normal_numbers(seed, name, width)
        self._sigma, self._time_constant_s = sigma, time_constant_s
        self._step_s, self._decay, self._step_sigma = 0.0, 1.0, 0.0
        self.values = [sigma * number for number in next(self._numbers)]

    def advance(self, step_s: float) -> list[float]:
        """Go on in time and return the components."""
        if step_s != self._step_s:
            self._step_s = step_s
            self._decay = exp(-step_s / self._time_constant_s)
            self._step_sigma = self._sigma * sqrt(1.0 - self._decay * self._decay)
        decay, sigma = self._decay, self._step_sigma
        pairs = zip(self.values, next(self._numbers), strict=True)
        self.values = values = [decay * value + sigma * number for value, number in pairs]
        return values


class SamplingTimes:
    """When a sensor samples: at the first control tick of each of its periods.

    So the mean rate is exact, also where a period is not a whole number of ticks.

    Args:
        rate_hz: samples a second.
    """

    def __init__(self, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._samples = 0
        self._due_us = 0

    def due(self, time_us: int) -> bool:
        """Whether there is a sample at this tick; counts it."""
        if time_us < self._due_us:
            return False
        self._samples = max(self._samples + 1, int(time_us * self._rate_hz / 1e6 + 1e-6) + 1)
        self._due_us = round(self._samples * 1e6 / self._rate_hz)
        return True


class Delay(Generic[Sample]):
    """Samples on their way from the sensor to the autopilot.

    Args:
        delay_s: from when a sample is true to its arrival.
    """

    def __init__(self, delay_s: float) -> None:
        self._delay_us = round(delay_s * 1e6)
        self._waiting: deque[tuple[int, Sample]] = deque()

    def send(self, time_us: int, sample: Sample) -> None:
        """Send a sample that is true now."""
        self._waiting.append((time_us + self._delay_us, sample))

    def all(self, time_us: int) -> Iterator[Sample]:
        """The samples that have arrived since the call before, oldest first."""
        while self._waiting and self._waiting[0][0] <= time_us:
            yield self._waiting.popleft()[1]

    def newest(self, time_us: int) -> Sample | None:
        """The newest of the samples that have arrived since the call before; None: there is none."""
        arrived = None
        while self._waiting and self._waiting[0][0] <= time_us:
            arrived = self._waiting.popleft()[1]
        return arrived
