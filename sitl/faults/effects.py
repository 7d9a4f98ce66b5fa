"""What each kind of fault does to a stream of samples."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from scenarios.faults.declaration import Fault, FaultKind
from scenarios.random_numbers import random_stream
from sitl.faults.channels import Channel
from sitl.sensors.noise import Delay, normal_numbers

T = TypeVar("T")
Effect = Callable[[int, T | None], T | None]
"""From vehicle time in microseconds and what the sensor delivers (None: nothing) to what arrives."""


def new_effect(fault: Fault, channel: Channel[T], seed: int) -> Effect[T]:
    """The effect of a fault from now on.

    Args:
        fault: of a sensor.
        channel: of its samples.
        seed: of the flight; noise and losses have streams of their own.
    """
    name, size = f"faults.{fault.part}.{fault.kind}", fault.amount
    by = (size,) * channel.width
    match fault.kind:
        case FaultKind.OFF:
            effect: Effect[T] = _off
        case FaultKind.STUCK:
            effect = _Stuck(channel)
        case FaultKind.WRONG:
            effect = _each(lambda sample: channel.add(sample, by))
        case FaultKind.SCALED:
            effect = _each(lambda sample: channel.scale(sample, size))
        case FaultKind.NOISY:
            numbers = normal_numbers(seed, name, channel.width)
            effect = _each(lambda sample: channel.add(sample, _times(size, next(numbers))))
        case FaultKind.DELAYED:
            late: _Delayed[T] = _Delayed(size)
            effect = late
        case FaultKind.LOSSY:
            effect = Lossy(size, seed, name)
        case _:
            raise ValueError(f"{fault.kind} is no fault of samples")
    return effect


def _off(_now_us: int, _sample: T | None) -> T | None:
    return None


def _each(change: Callable[[T], T]) -> Effect[T]:
    return lambda _now_us, sample: None if sample is None else change(sample)


def _times(sigma: float, numbers: list[float]) -> tuple[float, ...]:
    return tuple([sigma * number for number in numbers])


class _Stuck(Generic[T]):
    """Repeats the first sample, with the time of each new one."""

    def __init__(self, channel: Channel[T]) -> None:
        self._channel = channel
        self._first: T | None = None

    def __call__(self, _now_us: int, sample: T | None) -> T | None:
        if sample is None:
            return None
        if self._first is None:
            self._first = sample
        return self._channel.freeze(self._first, sample)


class _Delayed(Generic[T]):
    """Delivers each sample later; its time stays that at which it was true."""

    def __init__(self, delay_s: float) -> None:
        self._delay: Delay[T] = Delay(delay_s)

    def __call__(self, now_us: int, sample: T | None) -> T | None:
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
