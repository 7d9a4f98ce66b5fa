"""Whether a vehicle is armed, by what it has sent: a heartbeat every second, an acknowledgement sooner."""

from __future__ import annotations


class Arming:
    """Whether a vehicle is armed, by its heartbeats and by its acknowledgement of the request to arm.

    A heartbeat that was under way when the vehicle acknowledged still says disarmed. So an acknowledgement
    holds until a heartbeat shows the vehicle armed, or until a time limit; then only heartbeats count.
    Heartbeats may be taken on another thread. Times are vehicle time, microseconds.

    Attributes:
        shown: by the last heartbeat; None if none counts yet.
    """

    def __init__(self) -> None:
        self.shown: bool | None = None
        self._until_us: int | None = None  # while an acknowledgement holds

    def see_heartbeat(self, armed: bool) -> None:
        """Take a heartbeat."""
        self.shown = armed
        if armed:
            self._until_us = None

    def acknowledge(self, until_us: int) -> None:
        """Note that the vehicle has acknowledged; a heartbeat must show it armed until this time."""
        self._until_us = until_us
        if self.shown:  # by a heartbeat that came before the acknowledgement
            self._until_us = None

    def forget(self) -> None:
        """Note that disarming was requested: an acknowledgement, and heartbeats before this, do not count."""
        if self._until_us is not None:
            self._until_us = self.shown = None

    def is_armed(self, time_us: int) -> bool:
        """Whether the vehicle is armed, by a heartbeat or an acknowledgement that holds at this time."""
        until_us = self._until_us  # read first: a heartbeat that clears it has set `shown` before
        return bool(self.shown) or (until_us is not None and time_us <= until_us)

    def is_overdue(self, time_us: int) -> bool:
        """Whether no heartbeat has shown within the limit what was acknowledged."""
        until_us = self._until_us
        return until_us is not None and time_us > until_us
