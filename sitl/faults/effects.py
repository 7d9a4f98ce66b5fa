"""What each kind of fault does to a stream of samples, and how the samples of each sensor are changed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import cos, radians
from typing import Any, Generic, TypeVar

from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.measurements import (
    BarometerSample,
    ExternalPose,
    FlowSample,
    GpsSample,
    MagnetometerSample,
    RangeSample,
)
from scenarios.faults.declaration import Fault, FaultKind, FaultPart
from scenarios.random_numbers import random_stream
from sitl.sensors.noise import Delay, normal_numbers

Numbers = tuple[float, ...]
T = TypeVar("T")
Timed = TypeVar(
    "Timed", MagnetometerSample, BarometerSample, GpsSample, RangeSample, FlowSample, ExternalPose
)
Effect = Callable[[int, T | None], T | None]
"""From vehicle time in microseconds and what the sensor delivers (None: nothing) to what arrives."""
_METRES_PER_DEGREE = 111_320.0  # of latitude; a fault needs no more digits


@dataclass(frozen=True, slots=True)
class LinkChannel(Generic[T]):
    """The samples of one sensor.

    Attributes:
        width: of the numbers that are added.
        add: adds numbers to a sample, each in the unit in which the fault's size is declared.
        scale: multiplies what a sample measures.
        freeze: the first sample with the time of the second.
    """

    width: int
    add: Callable[[T, Numbers], T]
    scale: Callable[[T, float], T]
    freeze: Callable[[T, T], T]


def _add_vector(sample: Vec3, by: Numbers) -> Vec3:
    return (sample[0] + by[0], sample[1] + by[1], sample[2] + by[2])


def _scale_vector(sample: Vec3, factor: float) -> Vec3:
    return (sample[0] * factor, sample[1] * factor, sample[2] * factor)


def _first(sample: T, _now: T) -> T:
    return sample


def _with_time(sample: Timed, now: Timed) -> Timed:
    return replace(sample, time_us=now.time_us)


def _unscaled(sample: T, _factor: float) -> T:
    return sample


def _field(
    name: str,
    *,
    add: Callable[[Any, Numbers], Any],
    scale: Callable[[Any, float], Any] = _unscaled,
    width: int = 1,
) -> LinkChannel[Any]:
    """Samples whose fault is in one field."""
    return LinkChannel(
        width,
        lambda sample, by: replace(sample, **{name: add(getattr(sample, name), by)}),
        lambda sample, factor: replace(sample, **{name: scale(getattr(sample, name), factor)}),
        _with_time,
    )


def _add_number(value: float, by: Numbers) -> float:
    return value + by[0]


def _add_to_fix(sample: GpsSample, by: Numbers) -> GpsSample:
    return replace(
        sample,
        latitude_deg=sample.latitude_deg + by[0] / _METRES_PER_DEGREE,
        longitude_deg=sample.longitude_deg
        + by[1] / (_METRES_PER_DEGREE * max(cos(radians(sample.latitude_deg)), 1e-6)),
    )


def _add_to_flow(sample: FlowSample, by: Numbers) -> FlowSample:
    time_s = sample.integration_us * 1e-6
    return replace(
        sample, flow_rad=(sample.flow_rad[0] + by[0] * time_s, sample.flow_rad[1] + by[1] * time_s)
    )


def _scale_flow(sample: FlowSample, factor: float) -> FlowSample:
    return replace(sample, flow_rad=(sample.flow_rad[0] * factor, sample.flow_rad[1] * factor))


_VECTOR: LinkChannel[Vec3] = LinkChannel(3, _add_vector, _scale_vector, _first)

CHANNELS: dict[FaultPart, LinkChannel[Any]] = {
    FaultPart.GYROSCOPE: _VECTOR,
    FaultPart.ACCELEROMETER: _VECTOR,
    FaultPart.MAGNETOMETER: _field("field_frd_gauss", add=_add_vector, scale=_scale_vector, width=3),
    FaultPart.BAROMETER: _field("pressure_pa", add=_add_number),
    FaultPart.GPS: LinkChannel(2, _add_to_fix, _unscaled, _with_time),
    FaultPart.RANGE_FINDER: _field(
        "distance_m", add=_add_number, scale=lambda distance_m, factor: distance_m * factor
    ),
    FaultPart.OPTICAL_FLOW: LinkChannel(2, _add_to_flow, _scale_flow, _with_time),
    FaultPart.EXTERNAL_POSE: _field("position_ned_m", add=_add_vector, width=3),
    FaultPart.BATTERY_MONITOR: LinkChannel(
        1, lambda sample, by: (max(0.0, sample[0] + by[0]), sample[1]), _unscaled, _first
    ),
}
"""Of each sensor. Gyroscope, accelerometer and battery monitor deliver tuples, the others samples."""

IDEAL_POSITION: LinkChannel[tuple[Vec3, Vec3]] = LinkChannel(
    3, lambda sample, by: (_add_vector(sample[0], by), sample[1]), _unscaled, _first
)
"""Position and velocity of ideal sensors."""


def new_effect(fault: Fault, channel: LinkChannel[T], seed: int) -> Effect[T]:
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

    def __init__(self, channel: LinkChannel[T]) -> None:
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
