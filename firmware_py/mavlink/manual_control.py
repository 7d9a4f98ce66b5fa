"""An operator's sticks: MANUAL_CONTROL, RC_CHANNELS_OVERRIDE, and RC_CHANNELS with the latter's channels."""

from __future__ import annotations

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import AutopilotService
from firmware_py.types import ManualInput
from framerunner.wire.dialect import BROADCAST, Message, boot_ms, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

_FULL = 1000
_HALF = 500
_MIN_PULSE_US, _MAX_PULSE_US = 800, 2200  # pulses outside are no channel's
_RC_ONLY, _JOYSTICK_ONLY, _DISABLED = 0, 1, 4  # COM_RC_IN_MODE
_CHANNELS = 18
_NOT_GIVEN = (0, 0xFFFF)
_UNKNOWN_RSSI = 255
_STALE_US = 500_000  # COM_RC_LOSS_T's default


class ManualControlService(AutopilotService):
    """Passes sticks to the autopilot; streams a remote control's channels, if there is one, as PX4."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        super().__init__(autopilot, exchange)
        self._pulses_us: list[int] = []  # of the channels that are given, from the first on
        self._channels_received_us = -_STALE_US
        self.handlers = {
            mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL: self._manual_control,
            mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE: self._channels_override,
        }
        self.sources = {mavlink.MAVLINK_MSG_ID_RC_CHANNELS: self._rc_channels}

    def _manual_control(self, _link: Link, message: Message) -> None:
        """Sticks of a joystick. A value out of range is a stick that is not moved, as in PX4."""
        if not self._is_target(message.target) or self._mode() in (_RC_ONLY, _DISABLED):
            return
        self._autopilot.manual_input(
            ManualInput(
                self._exchange.time_us,
                forward=_share(message.x),
                right=_share(message.y),
                up=message.z / _HALF - 1.0 if 0 <= message.z <= _FULL else 0.0,
                yaw=_share(message.r),
            )
        )

    def _channels_override(self, _link: Link, message: Message) -> None:
        """Channels of a remote control: 1 to 4 are roll, pitch, throttle, yaw (RC_MAP_*'s order here)."""
        if not self._is_target(message.target_system):
            return
        pulses = [getattr(message, f"chan{number}_raw") for number in range(1, _CHANNELS + 1)]
        sticks = pulses[:4]
        in_range = all(_MIN_PULSE_US <= pulse <= _MAX_PULSE_US for pulse in sticks)  # else released
        if in_range and self._mode() not in (_JOYSTICK_ONLY, _DISABLED):
            right, back, up, yaw = (min(max((pulse - 1500) / _HALF, -1.0), 1.0) for pulse in sticks)
            self._autopilot.manual_input(
                ManualInput(self._exchange.time_us, forward=-back, right=right, up=up, yaw=yaw)
            )
        count = max((place for place, pulse in enumerate(pulses, 1) if pulse not in _NOT_GIVEN), default=0)
        if count:
            self._pulses_us = pulses[:count]
            self._channels_received_us = self._exchange.time_us

    def _rc_channels(self) -> Message | None:
        if self._exchange.time_us - self._channels_received_us >= _STALE_US:
            return None
        count = len(self._pulses_us)
        unused = [0xFFFF] * (_CHANNELS - count)
        return mavlink.MAVLink_rc_channels_message(
            boot_ms(self._channels_received_us), count, *self._pulses_us, *unused, _UNKNOWN_RSSI
        )

    def _is_target(self, system_id: int) -> bool:
        return system_id in (BROADCAST, self._exchange.system_id)

    def _mode(self) -> int:
        return self._autopilot.parameters.integer("COM_RC_IN_MODE")


def _share(value: int) -> float:
    return value / _FULL if -_FULL <= value <= _FULL else 0.0
