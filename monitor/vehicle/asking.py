"""What a vehicle is asked for once, and again until it answers; never so much that it would matter."""

from __future__ import annotations

from pymavlink.dialects.v20 import common as mavlink

from monitor.ports import Message
from monitor.vehicle.camera import request

_EVERY_S = 2.0
_ASKS = 5
_SPAN_S = 3.0  # over which rates are measured
_ENOUGH_HZ = 15.0
_WANTED_HZ = 25.0
_YEAR_2001_US = 978_307_200_000_000


class BootTime:
    """When the vehicle was switched on, which names this boot for good.

    Attributes:
        unix_us: of the boot, microseconds since 1970; None: not known yet.
    """

    def __init__(self, system_id: int) -> None:
        self._id = system_id
        self._asked_s = -1e9
        self._asks = 0
        self.unix_us: int | None = None

    def take(self, message: Message) -> None:
        """Take SYSTEM_TIME; the first one that knows the date counts."""
        boot_us = message.time_unix_usec - message.time_boot_ms * 1000
        if self.unix_us is None and boot_us > _YEAR_2001_US:
            self.unix_us = boot_us

    def question(self, now_s: float) -> Message | None:
        """What is to be asked now."""
        if self.unix_us is not None or self._asks >= _ASKS or now_s - self._asked_s < _EVERY_S:
            return None
        self._asked_s = now_s
        self._asks += 1
        return request(self._id, mavlink.MAV_COMP_ID_AUTOPILOT1, mavlink.MAVLINK_MSG_ID_SYSTEM_TIME)


class RateWatch:
    """Asks for more attitude and position where they come too slowly for a picture; never for less."""

    def __init__(self, system_id: int, now_s: float) -> None:
        self._id = system_id
        self._since_s = now_s
        self._counts = (0, 0)
        self._asks = 0

    def questions(self, counts: tuple[int, int], now_s: float) -> list[Message]:
        """What is to be asked now.

        Args:
            counts: attitudes and positions so far.
            now_s: loop time.
        """
        span_s = now_s - self._since_s
        if span_s < _SPAN_S:
            return []
        rates_hz = [(now - then) / span_s for now, then in zip(counts, self._counts, strict=True)]
        self._since_s, self._counts = now_s, counts
        if not any(counts) or min(rates_hz) >= _ENOUGH_HZ or self._asks >= _ASKS:
            return []
        self._asks += 1
        wanted = (mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED)
        return [
            mavlink.MAVLink_command_long_message(
                *(self._id, mavlink.MAV_COMP_ID_AUTOPILOT1, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0),
                *(number, 1e6 / _WANTED_HZ, 0, 0, 0, 0, 0),
            )
            for number, rate_hz in zip(wanted, rates_hz, strict=True)
            if rate_hz < _ENOUGH_HZ
        ]
