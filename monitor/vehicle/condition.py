"""The vehicle's condition: armed or not, mode, landed or not, battery."""

from __future__ import annotations

from math import fsum

from pymavlink.dialects.v20 import common as mavlink

from monitor.ports import Message
from monitor.vehicle.modes import Mode, mode_name, mode_of

_UNKNOWN_MV = 0xFFFF


class Condition:
    """What HEARTBEAT, EXTENDED_SYS_STATE, BATTERY_STATUS and SYS_STATUS say.

    Attributes:
        armed: the motors may turn.
        speaks_px4: its modes are PX4's.
        mode: main and sub mode, if they are PX4's.
        mode_name: for people; "" before the first heartbeat.
        landed: it stands; None: not known.
        battery_percent: charge left; None: not known.
        voltage_v: of the battery; None: not known.
    """

    def __init__(self) -> None:
        self.armed = False
        self.speaks_px4 = False
        self.mode: Mode = (0, 0)
        self.mode_name = ""
        self.landed: bool | None = None
        self.battery_percent: int | None = None
        self.voltage_v: float | None = None
        self._has_battery_status = False

    @property
    def standing(self) -> bool:
        """Known to stand with its motors off."""
        return bool(self.mode_name) and not self.armed and self.landed is True

    def take_heartbeat(self, message: Message) -> None:
        """Take the autopilot's HEARTBEAT."""
        self.armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        self.speaks_px4 = message.autopilot == mavlink.MAV_AUTOPILOT_PX4
        self.mode = mode_of(message.custom_mode) if self.speaks_px4 else (0, 0)
        self.mode_name = mode_name(message.autopilot, message.base_mode, message.custom_mode)

    def take_landed(self, message: Message) -> None:
        """Take EXTENDED_SYS_STATE."""
        state = message.landed_state
        if state == mavlink.MAV_LANDED_STATE_UNDEFINED:
            self.landed = None
        else:
            self.landed = state == mavlink.MAV_LANDED_STATE_ON_GROUND

    def take_battery(self, message: Message) -> None:
        """Take BATTERY_STATUS of the first battery; the cells' voltages add up."""
        if message.id != 0:
            return
        self._has_battery_status = True
        cells_mv = [cell for cell in message.voltages if cell != _UNKNOWN_MV]
        cells_mv += [cell for cell in message.voltages_ext if cell != 0]
        self.voltage_v = fsum(cells_mv) / 1e3 if cells_mv else None
        self.battery_percent = _percent(message.battery_remaining)

    def take_system_status(self, message: Message) -> None:
        """Take SYS_STATUS, which says of the battery what BATTERY_STATUS says better."""
        if self._has_battery_status:
            return
        known = message.voltage_battery != _UNKNOWN_MV
        self.voltage_v = message.voltage_battery / 1e3 if known else None
        self.battery_percent = _percent(message.battery_remaining)


def _percent(told: int) -> int | None:
    return told if 0 <= told <= 100 else None
