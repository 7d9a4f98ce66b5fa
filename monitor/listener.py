"""The thread that reads and writes the link, and opens it again when it fails."""

from __future__ import annotations

import asyncio
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from itertools import groupby
from operator import itemgetter

from monitor.ports import Link, Message
from wire.transports.urls import LinkError

_WAIT_S = 0.02  # what is to be sent waits at most this long while nothing comes in
_FIRST_PAUSE_S, _MAX_PAUSE_S = 0.5, 5.0
_MAX_RECEIVED = 5000  # waiting for a loop that is busy; the oldest go first
_MAX_TO_SEND = 256
_END_S = 2.0

Say = Callable[[str, str], None]


class Listener:
    """Carries messages between a link and the loop.

    All but the thread itself belongs to the loop.

    Args:
        open_link: opens it; raises `LinkError`.
        take: called on the loop with what came, and the host it came from; "" over a wire.
        say: called on the loop with level and one line for people.

    Attributes:
        problem: what is wrong with the link now; "" if nothing is.
        url: of the link; "" before it was opened.
    """

    def __init__(
        self, open_link: Callable[[], Link], take: Callable[[Sequence[Message], str], None], say: Say
    ) -> None:
        self._open_link = open_link
        self._take = take
        self._say = say
        self._received: deque[tuple[str, Message]] = deque(maxlen=_MAX_RECEIVED)
        self._to_send: deque[Message] = deque(maxlen=_MAX_TO_SEND)
        self._is_called = False
        self._halt = threading.Event()
        self._failed_s: float | None = None
        self.problem = ""
        self.url = ""

    async def run(self) -> None:
        """Listen until cancelled.

        Raises:
            RuntimeError: the thread ended by a fault of its own.
        """
        loop = asyncio.get_running_loop()
        self._halt.clear()
        ended: asyncio.Future[None] = loop.create_future()
        thread = threading.Thread(target=self._listen, args=(loop, ended), name="monitor's link", daemon=True)
        thread.start()
        try:
            await asyncio.shield(ended)
        finally:
            self._halt.set()
            await asyncio.to_thread(thread.join, _END_S)

    def send(self, message: Message) -> None:
        """Have a message sent; lost without a word while there is no link."""
        self._to_send.append(message)

    def _listen(self, loop: asyncio.AbstractEventLoop, ended: asyncio.Future[None]) -> None:
        """The thread: open, read, open again."""
        pause_s = _FIRST_PAUSE_S
        try:
            while not self._halt.is_set():
                try:
                    link = self._open_link()
                    loop.call_soon_threadsafe(self._opened, link.url)
                    pause_s = _FIRST_PAUSE_S
                    self._carry(loop, link)
                except LinkError as error:
                    self._to_send.clear()
                    loop.call_soon_threadsafe(self._fail, str(error), time.monotonic())
                    self._halt.wait(pause_s)
                    pause_s = min(2 * pause_s, _MAX_PAUSE_S)
        except RuntimeError as error:  # the loop is closed: nobody listens any more
            if not loop.is_closed():
                loop.call_soon_threadsafe(_end, ended, error)
        except Exception as error:
            loop.call_soon_threadsafe(_end, ended, error)

    def _carry(self, loop: asyncio.AbstractEventLoop, link: Link) -> None:
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

    def _fail(self, problem: str, now_s: float) -> None:
        if problem != self.problem:
            self._say("error", f"{problem}; trying again")
        self.problem = problem
        self._failed_s = now_s if self._failed_s is None else self._failed_s


def _end(ended: asyncio.Future[None], error: Exception) -> None:
    if not ended.done():
        ended.set_exception(error)
