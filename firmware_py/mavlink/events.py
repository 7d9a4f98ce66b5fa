"""The events service: EVENT with its sequence, and what was missed again on request.

As PX4: sequences begin at 65525, so that they soon wrap; CURRENT_EVENT_SEQUENCE comes every three seconds;
the last twenty events can be asked for again. RUN_PREARM_CHECKS sends the health report anew, which MAVSDK
and QGroundControl ask for when they connect.
"""

from __future__ import annotations

from collections import deque

from firmware_py.mavlink.event_catalogue import MODE_CHANGED, event_of
from firmware_py.mavlink.event_enums import MODE_GROUPS
from firmware_py.mavlink.event_health import HealthReport, assess
from firmware_py.mavlink.event_model import Occurrence
from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.scaling import boot_ms
from firmware_py.types import StatusText
from wire.dialect import Message, mavlink

_FIRST_SEQUENCE = 65525
_KEPT = 20
_SEQUENCE_PERIOD_US = 3_000_000
_HEALTH_PERIOD_US = 100_000  # between looks
_REPORT_GAP_US = 2_000_000  # between reports that nobody asked for
_LEAST_SEVERE = mavlink.MAV_SEVERITY_DEBUG


class EventService:
    """Tells events, on all links.

    Attributes:
        handlers: by message id.
    """

    __slots__ = (
        "_asked",
        "_exchange",
        "_health_due_us",
        "_mode",
        "_recent",
        "_report",
        "_report_us",
        "_sequence",
        "_sequence_due_us",
        "handlers",
    )

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        self._sequence = _FIRST_SEQUENCE
        self._sequence_due_us = 0
        self._recent: deque[tuple[int, Message]] = deque(maxlen=_KEPT)
        self._mode = exchange.autopilot.status.mode
        self._asked = False
        self._health_due_us = 0
        self._report: HealthReport | None = None
        self._report_us = -_REPORT_GAP_US
        self.handlers: dict[int, Handler] = {
            mavlink.MAVLINK_MSG_ID_REQUEST_EVENT: self._resend,
            mavlink.MAVLINK_MSG_ID_COMMAND_LONG: self._hear_command,
            mavlink.MAVLINK_MSG_ID_COMMAND_INT: self._hear_command,
        }

    def tell(self, text: StatusText) -> bool:
        """Send the event that says the same as a text, if there is one.

        Returns:
            Whether there is; the text then ends with a tab, so that who reads events leaves it out.
        """
        found = event_of(text.text)
        if found is None:
            return False
        kind, values = found
        self.send(Occurrence(kind, min(max(text.severity, 0), _LEAST_SEVERE), values))
        return True

    def send(self, occurrence: Occurrence) -> None:
        """Send an event and keep it for those who miss it."""
        self._sequence = self._sequence + 1 & 0xFFFF
        message = mavlink.MAVLink_event_message(
            0,
            0,
            occurrence.kind.id,
            boot_ms(self._exchange.time_us),
            self._sequence,
            occurrence.log_levels,
            list(occurrence.kind.packed(*occurrence.values)),
        )
        self._recent.append((self._sequence, message))
        self._exchange.broadcast(message)

    def update(self) -> None:
        """Send what is due."""
        now_us = self._exchange.time_us
        mode = self._exchange.autopilot.status.mode
        if mode is not self._mode:
            self._mode = mode
            self.send(Occurrence(MODE_CHANGED, mavlink.MAV_SEVERITY_INFO, (MODE_GROUPS[mode],)))
        if now_us >= self._sequence_due_us:
            self._sequence_due_us = now_us + _SEQUENCE_PERIOD_US
            flags = 0 if self._recent else mavlink.MAV_EVENT_CURRENT_SEQUENCE_FLAGS_RESET
            message = mavlink.MAVLink_current_event_sequence_message(self._sequence, flags)
            self._exchange.broadcast(message)
        if now_us >= self._health_due_us:
            self._health_due_us = now_us + _HEALTH_PERIOD_US
            self._report_health(now_us)

    def _report_health(self, now_us: int) -> None:
        if not self._asked and now_us - self._report_us < _REPORT_GAP_US:
            return
        report = assess(self._exchange.autopilot)
        if report == self._report and not self._asked:
            return
        self._asked, self._report, self._report_us = False, report, now_us
        for occurrence in report.events():
            self.send(occurrence)

    def _hear_command(self, exchange: Exchange, _link: Link, message: Message) -> None:
        """Note RUN_PREARM_CHECKS; who handles commands answers it."""
        if message.command == mavlink.MAV_CMD_RUN_PREARM_CHECKS and exchange.is_for_us(message):
            self._asked = True
            self._health_due_us = 0

    def _resend(self, exchange: Exchange, link: Link, message: Message) -> None:
        """REQUEST_EVENT: what is still there, and one RESPONSE_EVENT_ERROR for what is not."""
        if not exchange.is_for_us(message):
            return
        first, last = message.first_sequence, message.last_sequence
        span = last - first & 0xFFFF
        kept = [(sequence - first & 0xFFFF, event) for sequence, event in self._recent]
        wanted = [(distance, event) for distance, event in kept if distance <= span]
        if not wanted or wanted[0][0] > 0:
            exchange.send(link, self._unavailable(message, first))
        for _, event in wanted:
            exchange.send(link, event)

    def _unavailable(self, request: Message, sequence: int) -> Message:
        after = [kept for kept, _ in self._recent if 0 < (kept - sequence & 0xFFFF) < 0x8000]
        return mavlink.MAVLink_response_event_error_message(
            request.get_srcSystem(),
            request.get_srcComponent(),
            sequence,
            after[0] if after else self._sequence,
            mavlink.MAV_EVENT_ERROR_REASON_UNAVAILABLE,
        )
