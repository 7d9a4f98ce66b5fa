"""Lists of all parameters that links have asked for, sent a few at a time."""

from __future__ import annotations

from collections.abc import Callable

from firmware_py.mavlink.exchange import Exchange
from firmware_py.mavlink.links import Link
from wire.dialect import Message

_PER_UPDATE = 4  # 1000 a second at 250 updates: PX4's pace, gentle to slow links


class Listings:
    """The lists under way, one a link.

    Args:
        exchange: whose links.
        message: makes the message of an index.
        first: index with which a list begins; -1 where something comes before the parameters.
    """

    __slots__ = ("_exchange", "_first", "_message", "_next")

    def __init__(self, exchange: Exchange, message: Callable[[int], Message], first: int = 0) -> None:
        self._exchange = exchange
        self._message = message
        self._first = first
        self._next: dict[str, int] = {}  # by link name

    def begin(self, link: Link) -> None:
        """List all on a link, from the beginning."""
        self._next[link.profile.name] = self._first

    def end(self, link: Link) -> None:
        """List no more on a link."""
        self._next.pop(link.profile.name, None)

    def update(self) -> None:
        """Send the next few of each list."""
        if not self._next:
            return
        count = len(self._exchange.autopilot.parameters)
        for name, first in list(self._next.items()):
            link = self._exchange.links.get(name)
            if link is None:
                del self._next[name]
                continue
            if link.congested:
                continue
            after = min(first + _PER_UPDATE, count)
            for index in range(first, after):
                self._exchange.send(link, self._message(index))
            if after == count:
                del self._next[name]
            else:
                self._next[name] = after
