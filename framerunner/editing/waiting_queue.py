"""The queue of flights or batches that wait until others are over."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

Item = TypeVar("Item")
_NEWEST = 0.3  # part of the last one's duration in the mean


class WaitingQueue(Generic[Item]):
    """First come, first served, some at the same time.

    Args:
        places: how many at the same time.
        duration_s: that one is expected to take at first; None: not known, as a person controls it.
        clock: seconds that never go back.
    """

    def __init__(self, places: int, duration_s: float | None, clock: Callable[[], float]) -> None:
        self._places = places
        self._duration_s = duration_s
        self._clock = clock
        self._waiting: list[Item] = []
        self._began_s: dict[Item, float] = {}

    def __len__(self) -> int:
        """How many wait."""
        return len(self._waiting)

    def __contains__(self, item: Item) -> bool:
        """Whether it waits."""
        return item in self._waiting

    def enter(self, item: Item) -> None:
        """Put it at the end."""
        self._waiting.append(item)

    def begin(self) -> Iterator[Item]:
        """Those whose turn it is; they count as begun."""
        while self._waiting and len(self._began_s) < self._places:
            item = self._waiting.pop(0)
            self._began_s[item] = self._clock()
            yield item

    def leave(self, item: Item, *, counts: bool = True) -> None:
        """It is over, or waits no more; `counts`: its duration tells of that of others."""
        if item in self._waiting:
            self._waiting.remove(item)
        began_s = self._began_s.pop(item, None)
        if began_s is not None and counts and self._duration_s is not None:
            self._duration_s += _NEWEST * (self._clock() - began_s - self._duration_s)

    def waiting(self) -> Iterator[tuple[Item, int, int | None]]:
        """Each that waits, with its place from 1 and the seconds until its turn, if they can be expected."""
        duration_s, now_s = self._duration_s, self._clock()
        free_s = [max(0.0, began_s + (duration_s or 0.0) - now_s) for began_s in self._began_s.values()]
        free_s += [0.0] * (self._places - len(free_s))
        heapq.heapify(free_s)
        for place, item in enumerate(list(self._waiting), start=1):
            turn_s = heapq.heapreplace(free_s, free_s[0] + (duration_s or 0.0))
            yield item, place, None if duration_s is None else math.ceil(turn_s)
