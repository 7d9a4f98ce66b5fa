"""How faults read and change the samples of each sensor: what its numbers are, and what is added to them."""

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
from scenarios.faults.declaration import FaultPart

Numbers = tuple[float, ...]
T = TypeVar("T")
Timed = TypeVar(
    "Timed", MagnetometerSample, BarometerSample, GpsSample, RangeSample, FlowSample, ExternalPose
)
_METRES_PER_DEGREE = 111_320.0  # of latitude; a fault needs no more digits


@dataclass(frozen=True, slots=True)
class Channel(Generic[T]):
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


_VECTOR: Channel[Vec3] = Channel(3, _add_vector, _scale_vector, _first)

CHANNELS: dict[FaultPart, Channel[Any]] = {
    FaultPart.GYROSCOPE: _VECTOR,
    FaultPart.ACCELEROMETER: _VECTOR,
    FaultPart.MAGNETOMETER: Channel(
        3,
        lambda sample, by: MagnetometerSample(sample.time_us, _add_vector(sample.field_frd_gauss, by)),
        lambda sample, factor: MagnetometerSample(
            sample.time_us, _scale_vector(sample.field_frd_gauss, factor)
        ),
        _with_time,
    ),
    FaultPart.BAROMETER: Channel(
        1,
        lambda sample, by: BarometerSample(sample.time_us, sample.pressure_pa + by[0], sample.temperature_k),
        _unscaled,
        _with_time,
    ),
    FaultPart.GPS: Channel(2, _add_to_fix, _unscaled, _with_time),
    FaultPart.RANGE_FINDER: Channel(
        1,
        lambda sample, by: RangeSample(sample.time_us, sample.distance_m + by[0]),
        lambda sample, factor: RangeSample(sample.time_us, sample.distance_m * factor),
        _with_time,
    ),
    FaultPart.OPTICAL_FLOW: Channel(2, _add_to_flow, _scale_flow, _with_time),
    FaultPart.EXTERNAL_POSE: Channel(
        3,
        lambda sample, by: replace(sample, position_ned_m=_add_vector(sample.position_ned_m, by)),
        _unscaled,
        _with_time,
    ),
    FaultPart.BATTERY_MONITOR: Channel(
        1,
        lambda sample, by: (max(0.0, sample[0] + by[0]), sample[1]),
        _unscaled,
        _first,
    ),
}
"""Of each sensor. Gyroscope, accelerometer and battery monitor deliver tuples, the others samples."""

IDEAL_POSITION: Channel[tuple[Vec3, Vec3]] = Channel(
    3, lambda sample, by: (_add_vector(sample[0], by), sample[1]), _unscaled, _first
)
"""Position and velocity of ideal sensors."""
