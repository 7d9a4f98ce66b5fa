"""Which of a vehicle's messages are newer than what is known, on links that swap and delay."""

from __future__ import annotations

RESTART_US = 3_000_000
"""A time stamp farther back is that of a vehicle that has restarted; one less far back, of a late message."""


class MessageOrder:
    """The order of messages of one kind from one vehicle, by their time stamps."""

    __slots__ = ("_newest_us",)

    def __init__(self) -> None:
        self._newest_us = 0

    def is_next(self, time_us: int) -> bool:
        """Whether a message is not older than those before, or the first one after a restart.

        Args:
            time_us: its time stamp, microseconds since the vehicle's boot.
        """
        if self._newest_us - RESTART_US <= time_us < self._newest_us:
            return False
        self._newest_us = time_us
        return True
