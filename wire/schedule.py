"""When which message is due on a link, in vehicle time."""

from __future__ import annotations

from collections.abc import Mapping

from wire.dialect import mavlink

_NEVER_US = 1 << 62
_REQUESTED_PHASE_US = 16_000


class _Stream:
    __slots__ = ("due_us", "interval_us", "message_id")

    def __init__(self, message_id: int, interval_us: int) -> None:
        self.message_id = message_id
        self.interval_us = interval_us
        self.due_us = 0


class Schedule:
    """Message streams with their intervals. Everything is due at once at first.

    Attributes:
        next_due_us: nothing is due before; makes the common case one comparison.
        stretch: by how much a slow link makes all intervals longer, but the heartbeat's.
    """

    __slots__ = ("_defaults_us", "_streams", "next_due_us", "stretch")

    def __init__(self, rates_hz: Mapping[int, float]) -> None:
        """Start with the default rates, in hertz by message id."""
        self._defaults_us = {
            message_id: max(1, round(1e6 / rate)) for message_id, rate in rates_hz.items() if rate > 0
        }
        self._streams = {
            message_id: _Stream(message_id, interval) for message_id, interval in self._defaults_us.items()
        }
        self.next_due_us = 0
        self.stretch = 1.0

    def due(self, time_us: int) -> list[int]:
        """Message ids due now. Phases are kept, so that rates hold on average; what was missed is skipped."""
        if time_us < self.next_due_us:
            return []
        ids: list[int] = []
        next_due_us = _NEVER_US
        for stream in self._streams.values():
            if stream.due_us <= time_us:
                ids.append(stream.message_id)
                interval_us = stream.interval_us
                if self.stretch > 1.0 and stream.message_id != mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                    interval_us = round(interval_us * self.stretch)
                stream.due_us += interval_us
                if stream.due_us <= time_us:
                    stream.due_us = time_us + interval_us
            if stream.due_us < next_due_us:  # noqa: PLR1730  # a call for each costs more than all the rest
                next_due_us = stream.due_us
        self.next_due_us = next_due_us
        return ids

    def interval_us(self, message_id: int) -> int:
        """Interval of a stream; -1 when it is off."""
        stream = self._streams.get(message_id)
        return -1 if stream is None else stream.interval_us

    def set_interval(self, message_id: int, interval_us: int, time_us: int) -> None:
        """Change a stream.

        It runs on a grid of vehicle time whenever the request came, so that flights repeat, and 16 ms beside
        the streams that nobody asked for, so that a receiver does not depend on which of two messages of one
        instant it handles first.

        Args:
            message_id: which.
            interval_us: microseconds; 0: its default, negative: off.
            time_us: vehicle time now.
        """
        if interval_us == 0:
            interval_us = self._defaults_us.get(message_id, -1)
        if interval_us < 0:
            self._streams.pop(message_id, None)
            return
        stream = self._streams.setdefault(message_id, _Stream(message_id, interval_us))
        stream.interval_us = interval_us
        phase_us = _REQUESTED_PHASE_US % interval_us
        stream.due_us = ((time_us - phase_us) // interval_us + 1) * interval_us + phase_us
        self.next_due_us = 0
