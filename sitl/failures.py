"""Parts of the simulated drone that can be broken on purpose: motors, the position sensor, the battery."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import nan
from typing import Protocol

from firmware_py.types import Sensors

_GPS, _BATTERY, _MOTOR = 4, 100, 101  # FAILURE_UNIT
_OK, _OFF, _STUCK = 0, 1, 2  # FAILURE_TYPE


class Motors(Protocol):
    """A world whose motors can fail."""

    def fail_motor(self, index: int, *, stuck: bool = False) -> None:
        """Cut a motor off from its commands."""
        ...

    def repair_motor(self, index: int) -> None:
        """Let a motor follow its commands again."""
        ...


class Failures:
    """Breaks and mends parts.

    Args:
        motors: that can fail.
        count: of them.

    Attributes:
        falsify: makes of each sample of the sensors what broken ones say; None while all are whole.
    """

    def __init__(self, motors: Motors, count: int) -> None:
        self._motors = motors
        self._count = count
        self._lost: set[int] = set()
        self.falsify: Callable[[Sensors], Sensors] | None = None

    def inject(self, unit: int, kind: int, instance: int) -> bool:
        """Break or mend a part, numbered from 1 (0: all); False for what cannot be done."""
        if unit == _MOTOR:
            return self._inject_motor(kind, instance)
        if unit not in (_GPS, _BATTERY) or kind not in (_OK, _OFF) or instance > 1:
            return False
        if kind == _OFF:
            self._lost.add(unit)
        else:
            self._lost.discard(unit)
        self.falsify = self._falsified if self._lost else None
        return True

    def _inject_motor(self, kind: int, instance: int) -> bool:
        if kind not in (_OK, _OFF, _STUCK) or instance > self._count:
            return False
        for index in range(self._count) if instance == 0 else (instance - 1,):
            if kind == _OK:
                self._motors.repair_motor(index)
            else:
                self._motors.fail_motor(index, stuck=kind == _STUCK)
        return True

    def _falsified(self, sensors: Sensors) -> Sensors:
        """Without GPS there is no place but the barometer's height; a battery that is gone has no voltage."""
        if _GPS in self._lost:
            sensors = replace(
                sensors,
                position_ned_m=(nan, nan, sensors.position_ned_m[2]),
                velocity_ned_m_s=(nan, nan, sensors.velocity_ned_m_s[2]),
            )
        if _BATTERY in self._lost:
            sensors = replace(sensors, battery_voltage_v=0.0)
        return sensors
