"""STATUSTEXT of a vehicle: texts for the pages, and the autopilot's warnings as reasons of refusals."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.mission_tunnel import COMPONENT_ID as APP
from framerunner.wire.status_text import Text, TextAssembler

_MAX_WARNINGS = 16
_MAX_PER_SECOND = 20  # further texts of a drone are left out

JsonMessage = dict[str, Any]


class Texts:
    """Turns STATUSTEXT into messages "text".

    Attributes:
        warnings: how many the autopilot has sent.
    """

    def __init__(self, drone_id: int, publish: Callable[[JsonMessage], None]) -> None:
        self._id = drone_id
        self._publish = publish
        self._assembler = TextAssembler()
        self._newest_warnings: deque[str] = deque(maxlen=_MAX_WARNINGS)
        self._second_s = -1e9
        self._count = 0
        self._time_us = 0
        self.warnings = 0

    def take(self, message: Message, time_us: int, now_s: float) -> None:
        """Take a STATUSTEXT at a vehicle time."""
        self._time_us = time_us
        for text in self._assembler.take(message, message.get_srcComponent(), now_s):
            self._pass_on(text, now_s)

    def tick(self, now_s: float) -> None:
        """Pass on texts whose end does not arrive."""
        for text in self._assembler.expire(now_s):
            self._pass_on(text, now_s)

    def since(self, count: int) -> list[str]:
        """Warnings of the autopilot after the first `count` of them, as far as they are kept."""
        new = self.warnings - count
        return list(self._newest_warnings)[-new:] if new > 0 else []

    def _pass_on(self, text: Text, now_s: float) -> None:
        is_autopilot = text.component == mavlink.MAV_COMP_ID_AUTOPILOT1
        if is_autopilot and text.severity <= mavlink.MAV_SEVERITY_WARNING:
            self._newest_warnings.append(text.text)
            self.warnings += 1
        if now_s - self._second_s >= 1.0:
            self._second_s, self._count = now_s, 0
        self._count += 1
        if self._count > _MAX_PER_SECOND:
            return
        self._publish(
            {
                "kind": "text",
                "id": self._id,
                "time_s": round(self._time_us * 1e-6, 3),
                "severity": text.severity,
                "text": text.text,
                "from": "mission" if text.component == APP else "drone",
            }
        )
