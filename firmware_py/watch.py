"""What is looked at ten times a second: the battery, the fence, and what the mission has to tell."""

from __future__ import annotations

from collections.abc import Callable

from firmware_py.airframe import Airframe
from firmware_py.battery import BatteryMonitor, battery_settings
from firmware_py.commander_guards import Situation
from firmware_py.navigator import Navigator
from firmware_py.parameters import Parameters
from firmware_py.types import Sensors

_PERIOD_US = 100_000
_WARNING = 4  # MAV_SEVERITY
_SUPPLY_UNCHECKED = 894_281


class Watch:
    """Brings what changes slowly to the commander.

    Args:
        navigator: knows fence and mission.
        situation: what the commander looks at.
        say: takes texts for people, with MAV_SEVERITY.
        airframe: with its battery.
        parameters: of battery and fence.

    Attributes:
        battery: counts what is drawn.
        due_us: when to look again.
    """

    __slots__ = (
        "_airframe",
        "_least_to_arm",
        "_navigator",
        "_say",
        "_settings",
        "_situation",
        "battery",
        "due_us",
    )

    def __init__(
        self,
        navigator: Navigator,
        situation: Situation,
        say: Callable[[int, str], None],
        *,
        airframe: Airframe,
        parameters: Parameters,
    ) -> None:
        self.battery = BatteryMonitor()
        self.due_us = 0
        self._navigator = navigator
        self._situation = situation
        self._say = say
        self._airframe = airframe
        self.configure(parameters)

    def configure(self, parameters: Parameters) -> None:
        """Take over changed parameters."""
        self._settings = battery_settings(self._airframe, parameters)
        least = parameters.value("COM_ARM_BAT_MIN")
        if parameters.integer("CBRK_SUPPLY_CHK") == _SUPPLY_UNCHECKED:
            self._least_to_arm = 0.0
        else:
            self._least_to_arm = least if least >= 0.0 else self._settings.critical

    def look(self, now_us: int, sensors: Sensors, *, armed: bool) -> None:
        """Look once."""
        self.due_us = now_us + _PERIOD_US
        situation, navigator = self._situation, self._navigator
        self.battery.update(now_us, sensors.battery_voltage_v, sensors.battery_current_a, self._settings)
        situation.battery_warning = self.battery.state.warning
        situation.battery_arms = self.battery.state.remaining >= self._least_to_arm
        situation.has_mission = navigator.store.valid
        breach = navigator.breach() if armed else None
        if breach is not None and not situation.fence_breached:
            self._say(_WARNING, breach.text)
        situation.fence_breached = breach is not None
        navigator.collect()
        for text in navigator.take_texts():
            self._say(text.severity, text.text)
