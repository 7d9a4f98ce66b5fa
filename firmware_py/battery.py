"""The battery monitor: remaining charge and warnings from voltage and current."""

from __future__ import annotations

from math import isfinite

from firmware_py.parameters import Parameters
from framerunner.vehicle.airframe import Airframe
from framerunner.vehicle.measurements import BatteryState

_OK, _LOW, _CRITICAL, _EMERGENCY = 1, 2, 3, 4  # MAV_BATTERY_CHARGE_STATE
_MAH_PER_A_S = 1000.0 / 3600.0
_SUPPLY_UNCHECKED = 894_281  # of CBRK_SUPPLY_CHK


class BatterySettings:
    """The BAT_ parameters; the airframe's values where they give none.

    Cells, their voltages without load, capacity, resistance, and the shares of charge that warn.
    """

    def __init__(self, airframe: Airframe, parameters: Parameters) -> None:
        value, own = parameters.value, airframe.battery
        capacity_mah, cell_ohm = value("BAT1_CAPACITY"), value("BAT1_R_INTERNAL")
        self.cells = parameters.integer("BAT1_N_CELLS") or own.cells
        self.charged_v = value("BAT1_V_CHARGED")
        self.empty_v = value("BAT1_V_EMPTY")
        self.capacity_mah = capacity_mah if capacity_mah > 0.0 else own.capacity_mah
        self.resistance_ohm = cell_ohm * self.cells if cell_ohm >= 0.0 else own.resistance_ohm
        self.low = value("BAT_LOW_THR")
        self.critical = value("BAT_CRIT_THR")
        self.emergency = value("BAT_EMERGEN_THR")


class BatteryMonitor:
    """Integrates the current, and estimates the remaining charge by the voltage without load, as PX4's.

    Attributes:
        state: updated in place.
    """

    def __init__(self, airframe: Airframe, parameters: Parameters) -> None:
        self.state = BatteryState()
        self._started = False
        self._time_us = 0
        self.configure(airframe, parameters)

    def configure(self, airframe: Airframe, parameters: Parameters) -> None:
        """Apply changed parameters."""
        self._settings = BatterySettings(airframe, parameters)
        if parameters.integer("CBRK_SUPPLY_CHK") == _SUPPLY_UNCHECKED:
            self._min_charge_to_arm = 0.0
        else:
            chosen = parameters.value("COM_ARM_BAT_MIN")
            self._min_charge_to_arm = chosen if chosen >= 0.0 else self._settings.critical

    @property
    def can_arm(self) -> bool:
        """Whether the charge is enough to arm."""
        return self.state.remaining >= self._min_charge_to_arm

    def update(self, time_us: int, voltage_v: float, current_a: float) -> None:
        """Take a measurement of the terminal voltage and the current; one that is not finite is ignored."""
        if not isfinite(voltage_v + current_a):
            return
        state, settings = self.state, self._settings
        period_s = (time_us - self._time_us) / 1e6 if self._started else 0.0
        self._started, self._time_us = True, time_us
        state.voltage_v, state.current_a, state.cells = voltage_v, current_a, settings.cells
        state.used_mah += current_a * period_s * _MAH_PER_A_S
        state.remaining = _share(voltage_v + settings.resistance_ohm * current_a, settings)
        state.warning = warning(state.remaining, settings)


def warning(remaining: float, settings: BatterySettings) -> int:
    """MAV_BATTERY_CHARGE_STATE of a share of charge."""
    if remaining < settings.emergency:
        return _EMERGENCY
    if remaining < settings.critical:
        return _CRITICAL
    return _LOW if remaining < settings.low else _OK


def _share(voltage_v: float, settings: BatterySettings) -> float:
    """Share of the full charge at a voltage without load."""
    cell_v = voltage_v / max(settings.cells, 1)
    span_v = max(settings.charged_v - settings.empty_v, 1e-3)
    return min(max((cell_v - settings.empty_v) / span_v, 0.0), 1.0)
