"""What is looked at ten times a second: the battery, the fence, and what the mission has to tell."""

from __future__ import annotations

from collections.abc import Callable

from firmware_py.battery import BatteryMonitor, battery_settings
from firmware_py.commander_guards import Situation
from firmware_py.navigator import Navigator
from firmware_py.parameters import Parameters
from firmware_py.types import Sensors

_PERIOD_US = 100_000
_WARNING = 4  # MAV_SEVERITY


class Watch:
    """Brings what changes slowly to the commander.

    Args:
        navigator: knows fence and mission.
        situation: what the commander looks at.
        say: takes texts for people, with MAV_SEVERITY.
        parameters: of battery and fence.

    Attributes:
        battery: counts what is drawn.
        due_us: when to look again.
    """

    __slots__ = ("_navigator", "_say", "_settings", "_situation", "battery", "due_us")

    def __init__(
        self,
        navigator: Navigator,
        situation: Situation,
        say: Callable[[int, str], None],
        parameters: Parameters,
    ) -> None:
        self.battery = BatteryMonitor()
        self.due_us = 0
        self._navigator = navigator
        self._situation = situation
        self._say = say
        self._settings = battery_settings(parameters)

    def configure(self, parameters: Parameters) -> None:
        """Take over changed parameters."""
        self._settings = battery_settings(parameters)

    def look(self, now_us: int, sensors: Sensors, *, armed: bool) -> None:
        """Look once."""
        self.due_us = now_us + _PERIOD_US
        situation, navigator = self._situation, self._navigator
        self.battery.update(now_us, sensors.battery_voltage_v, sensors.battery_current_a, self._settings)
        situation.battery_warning = self.battery.state.warning
        situation.has_mission = navigator.store.valid
        breach = navigator.breach() if armed else None
        if breach is not None and not situation.fence_breached:
            self._say(_WARNING, breach.text)
        situation.fence_breached = breach is not None
        navigator.collect()
        for text in navigator.take_texts():
            self._say(text.severity, text.text)
