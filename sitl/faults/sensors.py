"""Faults of the sensors of a drone: changes what a suite delivers in each control tick."""

from __future__ import annotations

from dataclasses import replace
from math import nan
from typing import Any, TypeVar

from framerunner.geometry.vectors import NAN3, Vec3
from framerunner.vehicle.measurements import ExternalPose, ImuSample, Readings, Sensors
from scenarios.faults.declaration import Fault, FaultPart
from sitl.faults.effects import CHANNELS, IDEAL_POSITION, Effect, new_effect

T = TypeVar("T")
_SAMPLES = (  # named as their fields of `Readings`
    FaultPart.MAGNETOMETER,
    FaultPart.BAROMETER,
    FaultPart.GPS,
    FaultPart.RANGE_FINDER,
    FaultPart.OPTICAL_FLOW,
)
_POSITION = (FaultPart.GPS, FaultPart.EXTERNAL_POSE)
IDEAL_PARTS = frozenset({FaultPart.GYROSCOPE, FaultPart.ACCELEROMETER, FaultPart.BATTERY_MONITOR, *_POSITION})
"""Sensors of an ideal suite that can fail: its position counts as that of GPS and of an external pose."""


class SensorFaults:
    """The active faults of sensors, each with its effect.

    Args:
        seed: of the flight.
        ideal: the sensors are ideal.
    """

    def __init__(self, seed: int, *, ideal: bool) -> None:
        self._seed, self._ideal = seed, ideal
        self._effects: dict[FaultPart, dict[Fault, Effect[Any]]] = {}

    @property
    def active(self) -> bool:
        """Whether any sensor has a fault."""
        return bool(self._effects)

    def begin(self, fault: Fault) -> None:
        """Let a fault begin."""
        is_position = self._ideal and fault.part in _POSITION
        channel = IDEAL_POSITION if is_position else CHANNELS[fault.part]
        self._effects.setdefault(fault.part, {})[fault] = new_effect(fault, channel, self._seed)

    def end(self, fault: Fault) -> None:
        """Let a fault end, if it is active."""
        effects = self._effects.get(fault.part, {})
        effects.pop(fault, None)
        if not effects:
            self._effects.pop(fault.part, None)

    def change(self, readings: Readings, pose: ExternalPose | None) -> tuple[Readings, ExternalPose | None]:
        """What arrives of one tick's readings, which are changed in place, and of the external pose."""
        now_us, effects = readings.time_us, self._effects
        if FaultPart.GYROSCOPE in effects or FaultPart.ACCELEROMETER in effects:
            readings.imu = self._imu(now_us, readings.imu)
        for part in _SAMPLES:
            if part in effects:
                setattr(readings, part, self._pass(part, now_us, getattr(readings, part)))
        if FaultPart.EXTERNAL_POSE in effects:
            pose = self._pass(FaultPart.EXTERNAL_POSE, now_us, pose)
        if FaultPart.BATTERY_MONITOR in effects:
            measured = (readings.battery_voltage_v, readings.battery_current_a)
            readings.battery_voltage_v, readings.battery_current_a = self._battery(now_us, measured)
        return readings, pose

    def change_ideal(self, sensors: Sensors) -> Sensors:
        """What arrives of one tick's ideal sample; without a position only the height is left."""
        now_us = sensors.time_us
        voltage_v, current_a = self._battery(now_us, (sensors.battery_voltage_v, sensors.battery_current_a))
        place: tuple[Vec3, Vec3] | None = (sensors.position_ned_m, sensors.velocity_ned_m_s)
        for part in _POSITION:
            place = self._pass(part, now_us, place)
        if place is None:
            place = (
                (nan, nan, sensors.position_ned_m[2]),
                (nan, nan, sensors.velocity_ned_m_s[2]),
            )
        return replace(
            sensors,
            position_ned_m=place[0],
            velocity_ned_m_s=place[1],
            angular_rate_frd_rad_s=self._pass(FaultPart.GYROSCOPE, now_us, sensors.angular_rate_frd_rad_s)
            or NAN3,
            specific_force_frd_m_s2=self._pass(
                FaultPart.ACCELEROMETER, now_us, sensors.specific_force_frd_m_s2
            )
            or NAN3,
            battery_voltage_v=voltage_v,
            battery_current_a=current_a,
        )

    def _imu(self, now_us: int, imu: ImuSample | None) -> ImuSample | None:
        """One chip measures both; the part that fails delivers no number, and without both nothing comes."""
        if imu is None:
            return None
        rate = self._pass(FaultPart.GYROSCOPE, now_us, imu.angular_rate_frd_rad_s)
        force = self._pass(FaultPart.ACCELEROMETER, now_us, imu.specific_force_frd_m_s2)
        if rate is None and force is None:
            return None
        return ImuSample(imu.time_us, imu.period_us, rate or NAN3, force or NAN3)

    def _battery(self, now_us: int, measured: tuple[float, float]) -> tuple[float, float]:
        return self._pass(FaultPart.BATTERY_MONITOR, now_us, measured) or (0.0, 0.0)

    def _pass(self, part: FaultPart, now_us: int, sample: T | None) -> T | None:
        for effect in self._effects.get(part, {}).values():
            sample = effect(now_us, sample)
        return sample
