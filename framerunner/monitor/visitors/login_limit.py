"""How often log-ins may be tried. Tries that come too fast wait: the right password is not shut out."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from framerunner.monitor.addresses import visitor_key

LONGEST_WAIT_S = 30.0
_MAX_ADDRESSES = 10_000


@dataclass(frozen=True, slots=True)
class RateLimit:
    """Tries that are allowed at once, and how many seconds later another one is."""

    at_once: int
    period_s: float


ONE_ADDRESS = RateLimit(10, 3.0)
ALL_ADDRESSES = RateLimit(60, 0.5)


class _Bucket:
    """Tries that are left; fewer than none: that many wait."""

    def __init__(self, rate: RateLimit, now_s: float) -> None:
        self._rate = rate
        self._left = float(rate.at_once)
        self._counted_s = now_s

    def refill(self, now_s: float) -> None:
        gained = (now_s - self._counted_s) / self._rate.period_s
        self._left, self._counted_s = min(self._left + gained, float(self._rate.at_once)), now_s

    def change(self, tries: int) -> None:
        self._left += tries

    @property
    def wait_s(self) -> float:
        """Until the try that was taken last may be made."""
        return max(0.0, -self._left * self._rate.period_s)


class LoginLimit:
    """Limits tries of each address and of all together; a try that was right does not count.

    Args:
        clock: seconds that never go back.
        wait: waits some seconds.
    """

    def __init__(
        self, clock: Callable[[], float], wait: Callable[[float], Awaitable[None]] = asyncio.sleep
    ) -> None:
        self._clock = clock
        self._wait = wait
        self._all = _Bucket(ALL_ADDRESSES, clock())
        self._addresses: OrderedDict[str, _Bucket] = OrderedDict()

    async def turn(self, address: str) -> bool:
        """Wait until a try of an address may be made; False: it may not, because too many wait."""
        buckets = self._buckets(address)
        for each in buckets:
            each.change(-1)
        wait_s = max(each.wait_s for each in buckets)
        if wait_s > LONGEST_WAIT_S:
            for each in buckets:
                each.change(1)
            return False
        if wait_s:
            await self._wait(wait_s)
        return True

    def was_right(self, address: str) -> None:
        """The last try of an address was no guess."""
        for each in self._buckets(address):
            each.change(1)

    def _buckets(self, address: str) -> tuple[_Bucket, _Bucket]:
        now_s, key = self._clock(), visitor_key(address)
        own = self._addresses.pop(key, None) or _Bucket(ONE_ADDRESS, now_s)
        self._addresses[key] = own
        for each in (self._all, own):
            each.refill(now_s)
        while len(self._addresses) > _MAX_ADDRESSES:
            self._addresses.popitem(last=False)
        return self._all, own
