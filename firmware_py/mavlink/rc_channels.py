"""RC_CHANNELS: the channels of a remote control, as somebody sends them with RC_CHANNELS_OVERRIDE."""

from __future__ import annotations

from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.scaling import boot_ms
from wire.dialect import BROADCAST, Message, mavlink

_CHANNELS = 18
_NOT_GIVEN = (0, 0xFFFF)
_UNKNOWN_RSSI = 255
_STALE_US = 500_000  # COM_RC_LOSS_T's default


class RcChannels:
    """Remembers the channels and tells them while they are fresh; silent without a remote control, as PX4.

    Attributes:
        handlers: of the message that brings them.
    """

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        self._pulses_us: list[int] = []
        self._heard_us = -_STALE_US
        self.handlers: dict[int, Handler] = {mavlink.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE: self._hear}
        exchange.sources[mavlink.MAVLINK_MSG_ID_RC_CHANNELS] = self._message

    def _hear(self, exchange: Exchange, _link: Link, message: Message) -> None:
        if message.target_system not in (BROADCAST, exchange.system_id):
            return
        pulses = [getattr(message, f"chan{number}_raw") for number in range(1, _CHANNELS + 1)]
        count = max((place for place, pulse in enumerate(pulses, 1) if pulse not in _NOT_GIVEN), default=0)
        if count:
            self._pulses_us = pulses[:count]
            self._heard_us = exchange.time_us

    def _message(self) -> Message | None:
        if self._exchange.time_us - self._heard_us >= _STALE_US:
            return None
        count = len(self._pulses_us)
        return mavlink.MAVLink_rc_channels_message(
            boot_ms(self._heard_us),
            count,
            *self._pulses_us,
            *[0xFFFF] * (_CHANNELS - count),
            _UNKNOWN_RSSI,
        )
