"""The thread that reads and writes the link to the drones, and opens it again when it fails."""

from __future__ import annotations

import asyncio
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from itertools import groupby
from operator import itemgetter

from framerunner.wire.dialect import Message
from framerunner.wire.transports.urls import LinkError
from framerunner.wire.transports.vehicle_link import VehicleLink

_WAIT_S = 0.02  # longest delay of a message to send while nothing is received
_FIRST_PAUSE_S, _MAX_PAUSE_S = 0.5, 5.0
_MAX_RECEIVED = 5000  # waiting for a loop that is busy; the oldest are dropped
_MAX_TO_SEND = 256
_END_S = 2.0

Say = Callable[[str, str], None]


class LinkThread:
    """Carries messages between a link and the loop; all methods belong to the loop.

    Args:
        open_link: opens it; raises `LinkError`.
        take: called with received messages and the host they came from, "" on a serial line.
        say: called with level and one line for people.
        reopens: a link that fails is opened again, and closed at the end; else its end is that of `run`.

    Attributes:
        problem: what is wrong with the link now; "" if nothing is.
        url: of the link; "" before it was opened.
    """

    def __init__(
        self,
        open_link: Callable[[], VehicleLink],
        take: Callable[[Sequence[Message], str], None],
        say: Say,
        *,
        reopens: bool = True,
    ) -> None:
        self._open_link = open_link
        self._take = take
        self._say = say
        self._reopens = reopens
        self._received: deque[tuple[str, Message]] = deque(maxlen=_MAX_RECEIVED)
        self._to_send: deque[Message] = deque(maxlen=_MAX_TO_SEND)
        self._is_called = False
        self._halt = threading.Event()
        self._failed_s: float | None = None
        self.problem = ""
        self.url = ""

    async def run(self) -> None:
        """Read and write until cancelled.

        Raises:
            LinkError: the link has failed and is not opened again.
            Exception: the thread ended with a fault.
        """
        loop = asyncio.get_running_loop()
        self._halt.clear()
        ended: asyncio.Future[None] = loop.create_future()
        thread = threading.Thread(target=self._run, args=(loop, ended), name="monitor's link", daemon=True)
        thread.start()
        try:
            await asyncio.shield(ended)
        finally:
            self._halt.set()
            await asyncio.to_thread(thread.join, _END_S)

    def send(self, message: Message) -> None:
        """Send a message; it is lost without an error while there is no link."""
        self._to_send.append(message)

    def _run(self, loop: asyncio.AbstractEventLoop, ended: asyncio.Future[None]) -> None:
        """In the thread: open, read, open again."""
        pause_s = _FIRST_PAUSE_S
        try:
            while not self._halt.is_set():
                try:
                    link = self._open_link()
                    loop.call_soon_threadsafe(self._opened, link.url)
                    pause_s = _FIRST_PAUSE_S
                    self._carry(loop, link)
                except LinkError as error:
                    if not self._reopens:
                        raise
                    self._to_send.clear()
                    loop.call_soon_threadsafe(self._failed, str(error), time.monotonic())
                    self._halt.wait(pause_s)
                    pause_s = min(2 * pause_s, _MAX_PAUSE_S)
        except Exception as error:
            if not loop.is_closed():  # a closed loop is itself the cause
                loop.call_soon_threadsafe(_end, ended, error)

    def _carry(self, loop: asyncio.AbstractEventLoop, link: VehicleLink) -> None:
        try:
            while not self._halt.is_set():
                while self._to_send:
                    link.send(self._to_send.popleft())
                messages = link.receive(_WAIT_S)
                if messages:
                    host = link.host
                    self._received.extend((host, message) for message in messages)
                    if not self._is_called:
                        self._is_called = True
                        loop.call_soon_threadsafe(self._hand_over)
        finally:
            if self._reopens:
                link.close()

    def _hand_over(self) -> None:
        self._is_called = False
        batch = [self._received.popleft() for _ in range(len(self._received))]
        for host, pairs in groupby(batch, key=itemgetter(0)):
            self._take([message for _, message in pairs], host)

    def _opened(self, url: str) -> None:
        self.url = url
        if self._failed_s is not None:
            self._say("info", f"the link {url} is back after {time.monotonic() - self._failed_s:.0f} s")
        self._failed_s, self.problem = None, ""

    def _failed(self, problem: str, now_s: float) -> None:
        if problem != self.problem:
            self._say("error", f"{problem}; trying again")
        self.problem = problem
        self._failed_s = now_s if self._failed_s is None else self._failed_s


def _end(ended: asyncio.Future[None], error: Exception) -> None:
    if not ended.done():
        ended.set_exception(error)
