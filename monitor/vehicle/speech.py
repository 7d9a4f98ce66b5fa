"""What a vehicle says to people: texts for the pages, and the autopilot's warnings as reasons."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

from monitor.ports import Message
from monitor.vehicle.orders import is_warning
from wire.dialect import mavlink
from wire.mission_tunnel import COMPONENT_ID as APP
from wire.status_text import Text, TextAssembler

_KEPT = 16
_MAX_PER_SECOND = 20  # what a drone says beyond that is left out

JsonMessage = dict[str, Any]


class Speech:
    """Turns STATUSTEXT into messages "text".

    Args:
        drone_id: system id.
        tell: takes messages for the pages.

    Attributes:
        warnings: of the autopilot, so far.
    """

    def __init__(self, drone_id: int, tell: Callable[[JsonMessage], None]) -> None:
        self._id = drone_id
        self._tell = tell
        self._assembler = TextAssembler()
        self._reasons: deque[str] = deque(maxlen=_KEPT)
        self._second_s = -1e9
        self._told = 0
        self._time_us = 0
        self.warnings = 0

    def take(self, message: Message, time_us: int, now_s: float) -> None:
        """Take a STATUSTEXT at a vehicle time."""
        self._time_us = time_us
        for text in self._assembler.take(message, message.get_srcComponent(), now_s):
            self._say(text, now_s)

    def tick(self, now_s: float) -> None:
        """Give up waiting for the ends of texts."""
        for text in self._assembler.expire(now_s):
            self._say(text, now_s)

    def since(self, count: int) -> list[str]:
        """Warnings after the first `count` of them, as far as they are kept."""
        new = self.warnings - count
        return list(self._reasons)[-new:] if new > 0 else []

    def _say(self, text: Text, now_s: float) -> None:
        if text.component == mavlink.MAV_COMP_ID_AUTOPILOT1 and is_warning(text.severity):
            self._reasons.append(text.text)
            self.warnings += 1
        if now_s - self._second_s >= 1.0:
            self._second_s, self._told = now_s, 0
        self._told += 1
        if self._told > _MAX_PER_SECOND:
            return
        self._tell(
            {
                "kind": "text",
                "id": self._id,
                "time_s": round(self._time_us * 1e-6, 3),
                "severity": text.severity,
                "text": text.text,
                "from": "mission" if text.component == APP else "drone",
            }
        )
