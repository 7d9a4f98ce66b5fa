"""What each kind of fault does to a stream of samples."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from scenarios.faults.declaration import Fault, FaultKind
from scenarios.random_numbers import random_stream
from sitl.faults.channels import Channel
from sitl.sensors.noise import Delay, normal_numbers

T = TypeVar("T")
Effect = Callable[[int, Any], Any]
"""From vehicle time in microseconds and what the sensor delivers (None: nothing) to what arrives."""


def new_effect(fault: Fault, channel: Channel, seed: int) -> Effect:
    """The effect of a fault from now on.

    Args:
        fault: of a sensor.
        channel: of its samples.
        seed: of the flight; noise and losses have streams of their own.
    """
    name, size = f"faults.{fault.part}.{fault.kind}", fault.amount
    if fault.kind is FaultKind.OFF:
        return _off
    if fault.kind is FaultKind.STUCK:
        return _Stuck(channel)
    if fault.kind is FaultKind.WRONG:
        by = (size,) * channel.width
        return lambda _now_us, sample: None if sample is None else channel.add(sample, by)
    if fault.kind is FaultKind.SCALED:
        return lambda _now_us, sample: None if sample is None else channel.scale(sample, size)
    if fault.kind is FaultKind.NOISY:
        return _Noisy(channel, size, normal_numbers(seed, name, channel.width))
    if fault.kind is FaultKind.DELAYED:
        return _Delayed(size)
    if fault.kind is FaultKind.LOSSY:
        return Lossy(size, seed, name)
    raise ValueError(f"{fault.kind} is no fault of samples")


def _off(_now_us: int, _sample: Any) -> None:
    return None


class _Stuck:
    """Repeats the first sample, with the time of each new one."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._first: Any = None

    def __call__(self, _now_us: int, sample: Any) -> Any:
        if sample is None:
            return None
        if self._first is None:
            self._first = sample
        return self._channel.freeze(self._first, sample)


class _Noisy:
    """Adds white noise."""

    def __init__(self, channel: Channel, sigma: float, numbers: Iterator[list[float]]) -> None:
        self._channel, self._sigma, self._numbers = channel, sigma, numbers

    def __call__(self, _now_us: int, sample: Any) -> Any:
        if sample is None:
            return None
        sigma = self._sigma
        return self._channel.add(sample, tuple([sigma * number for number in next(self._numbers)]))


class _Delayed:
    """Delivers each sample later; its time stays that at which it was true."""

    def __init__(self, delay_s: float) -> None:
        self._delay: Delay[Any] = Delay(delay_s)

    def __call__(self, now_us: int, sample: Any) -> Any:
        if sample is not None:
            self._delay.send(now_us, sample)
        return self._delay.newest(now_us)


class Lossy:
    """Loses a share of all samples, at random.

    Args:
        share: that is lost, 0..1.
        seed: of the flight.
        name: of the stream of random numbers.
    """

    def __init__(self, share: float, seed: int, name: str) -> None:
        self._share, self._stream = share, random_stream(seed, name)

    def __call__(self, _now_us: int, sample: T | None) -> T | None:
        """The sample, or None: it is lost."""
        if sample is None or self._stream.random() < self._share:
            return None
        return sample
