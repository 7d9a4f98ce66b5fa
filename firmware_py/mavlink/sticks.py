"""A pilot's sticks: MANUAL_CONTROL and RC_CHANNELS_OVERRIDE."""

from __future__ import annotations

from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.types import ManualInput
from wire.dialect import BROADCAST, Message, mavlink

_FULL = 1000
_HALF = 500
_LOW_US, _HIGH_US = 800, 2200  # pulses outside are no channel's
_RC_ONLY, _JOYSTICK_ONLY, _DISABLED = 0, 1, 4  # COM_RC_IN_MODE


def _is_ours(exchange: Exchange, target: int) -> bool:
    return target in (BROADCAST, exchange.system_id)


def _manual_control(exchange: Exchange, _link: Link, message: Message) -> None:
    """Sticks of a joystick. A value out of range is a stick that is not moved, as in PX4."""
    if not _is_ours(exchange, message.target):
        return
    if exchange.autopilot.parameters.integer("COM_RC_IN_MODE") in (_RC_ONLY, _DISABLED):
        return
    exchange.autopilot.manual_input(
        ManualInput(
            exchange.time_us,
            forward=_share(message.x),
            right=_share(message.y),
            up=message.z / _HALF - 1.0 if 0 <= message.z <= _FULL else 0.0,
            yaw=_share(message.r),
        )
    )


def _share(value: int) -> float:
    return value / _FULL if -_FULL <= value <= _FULL else 0.0


def _channels_override(exchange: Exchange, _link: Link, message: Message) -> None:
    """Sticks of a remote control: channels 1 to 4 are roll, pitch, throttle, yaw (RC_MAP_*'s order here)."""
    if not _is_ours(exchange, message.target_system):
        return
    if exchange.autopilot.parameters.integer("COM_RC_IN_MODE") in (_JOYSTICK_ONLY, _DISABLED):
        return
    channels = (message.chan1_raw, message.chan2_raw, message.chan3_raw, message.chan4_raw)
    if not all(_LOW_US <= pulse <= _HIGH_US for pulse in channels):
        return  # released, or not given
    right, back, up, yaw = (min(max((pulse - 1500) / _HALF, -1.0), 1.0) for pulse in channels)
    exchange.autopilot.manual_input(ManualInput(exchange.time_us, forward=-back, right=right, up=up, yaw=yaw))


HANDLERS: dict[int, Handler] = {
    mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL: _manual_control,
    mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE: _channels_override,
}
