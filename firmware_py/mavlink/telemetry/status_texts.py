"""STATUSTEXT: the autopilot's texts, to the links where a ground station was heard, as PX4.

Earlier texts wait for one: the latest few, for five seconds. Long texts are sent in pieces of 50 bytes. As in
PX4, a text that is also sent as an event ends with a tab, so that receivers of events can leave it out.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import AutopilotService
from firmware_py.types import StatusText
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.status_text import PIECE_BYTES, statustexts

_KEPT = 8
_STALE_US = 5_000_000


class StatusTextService(AutopilotService):
    """Sends the autopilot's texts.

    Args:
        send_event: sends a text's event, if there is one, and returns whether.
        log: called with vehicle time and each text, whether it is received or not.
    """

    def __init__(
        self,
        autopilot: Autopilot,
        exchange: Exchange,
        send_event: Callable[[StatusText], bool],
        log: Callable[[int, StatusText], None] | None = None,
    ) -> None:
        super().__init__(autopilot, exchange)
        self._send_event = send_event
        self._log = log
        self._last_id = 0
        self._waiting: dict[str, deque[tuple[int, list[Message]]]] = {}

    def update(self) -> None:
        """Take the autopilot's new texts and send what can be sent."""
        exchange = self._exchange
        for said in self._autopilot.take_texts():
            if self._log is not None:
                self._log(exchange.time_us, said)
            text = StatusText(said.severity, f"{said.text}\t") if self._send_event(said) else said
            pieces = self._pieces(text)
            for name in exchange.links:
                waiting = self._waiting.setdefault(name, deque(maxlen=_KEPT))
                waiting.append((exchange.time_us, pieces))
        for name, waiting in list(self._waiting.items()):
            link = exchange.links.get(name)
            if link is None:
                del self._waiting[name]
                continue
            while waiting and link.gcs_heard:
                said_us, pieces = waiting.popleft()
                if exchange.time_us - said_us <= _STALE_US:
                    for piece in pieces:
                        exchange.send(link, piece)

    def _pieces(self, text: StatusText) -> list[Message]:
        data = text.text.encode("ascii", "replace")
        severity = min(max(text.severity, 0), mavlink.MAV_SEVERITY_DEBUG)
        if len(data) > PIECE_BYTES:
            self._last_id = self._last_id % 0xFFFF + 1
        return statustexts(severity, data, self._last_id)
