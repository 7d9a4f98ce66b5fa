"""What a pilot's browser may say: checked before anything is done about it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from errors import UserError
from monitor.sticks import Sticks

LONGEST_MESSAGE = 1000  # bytes; one holds some 80
MESSAGES_PER_SECOND = 60.0  # a page sends 25 and a word now and then
BURST = 240.0  # what a page sends in 10 s and a network or this machine may hold back

WORDS = ("take", "give", "arm", "disarm", "take_off", "land", "hold", "stop_motors")
_AXES = ("forward", "right", "up", "yaw")
_LAST_SYSTEM = 255


class PilotMessageError(UserError):
    """A message that no page of ours sends; its text is one line for people."""


@dataclass(frozen=True, slots=True)
class Order:
    """A word about a drone.

    Attributes:
        drone_id: which.
        what: one of `WORDS`.
        confirmed: the person was asked again and said yes.
    """

    drone_id: int
    what: str
    confirmed: bool = False


def read_message(text: str | bytes) -> Sticks | Order:
    """Read what came.

    Args:
        text: as it came.

    Raises:
        PilotMessageError: what is wrong with it.
    """
    size = len(text) if isinstance(text, bytes) else len(text.encode(errors="replace"))
    if size > LONGEST_MESSAGE:
        raise PilotMessageError(f"a message of {size} bytes; at most {LONGEST_MESSAGE} are taken")
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        raise PilotMessageError("a message that is not JSON") from None
    if not isinstance(message, dict):
        raise PilotMessageError("a message that is not a JSON object")
    kind = message.get("kind")
    if kind == "sticks":
        return Sticks(*(_deflection(message, axis) for axis in _AXES))
    if kind == "do":
        return _order(message)
    raise PilotMessageError(f"kind: {_short(kind)}; it must be sticks or do")


def _deflection(message: Mapping[str, Any], axis: str) -> float:
    value = message.get(axis)
    if isinstance(value, bool) or not isinstance(value, int | float) or not -1.0 <= value <= 1.0:
        raise PilotMessageError(f"{axis}: {_short(value)}; it must be a number from -1 to 1")
    return float(value)


def _order(message: Mapping[str, Any]) -> Order:
    drone_id, what, confirmed = message.get("id"), message.get("what"), message.get("confirmed", False)
    if isinstance(drone_id, bool) or not isinstance(drone_id, int) or not 1 <= drone_id <= _LAST_SYSTEM:
        raise PilotMessageError(f"id: {_short(drone_id)}; it must be a whole number from 1 to {_LAST_SYSTEM}")
    if what not in WORDS:
        raise PilotMessageError(f"what: {_short(what)}; it must be one of {', '.join(WORDS)}")
    if not isinstance(confirmed, bool):
        raise PilotMessageError(f"confirmed: {_short(confirmed)}; it must be true or false")
    return Order(drone_id, what, confirmed)


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:40]}…"


class Allowance:
    """How many messages may come: so many a second in the long run, and some at once after a pause.

    Args:
        clock: seconds that only grow.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._left = BURST
        self._counted_s = clock()

    def spend(self) -> bool:
        """Count one message; False if it is one too many."""
        now_s = self._clock()
        self._left = min(BURST, self._left + (now_s - self._counted_s) * MESSAGES_PER_SECOND)
        self._counted_s = now_s
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
