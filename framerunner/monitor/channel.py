"""The WebSocket of a page: what it sends is checked, what it is sent waits in a queue of limited length.

All messages are JSON objects; `kind` says which. A channel ends with one of four codes, whose reason is one
line for people: the page sent what it never sends (4400), its person may not do this (4403), it sends too
much (4429), or too much waits to be sent to it, or too many are connected (1013).
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections import deque
from collections.abc import Awaitable, Callable, Hashable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError
from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from framerunner.errors import UserError
from framerunner.wire import finite_json

BAD_MESSAGE_CODE, REFUSED_CODE, TOO_MANY_CODE = 4400, 4403, 4429  # as HTTP's
TRY_LATER_CODE = 1013
MESSAGES_PER_S = 60.0  # a page sends 25 with sticks and some orders
MAX_BURST = 240.0  # what a page sends in 10 s, if a network or this machine delays it
_MAX_REASON_BYTES = 120  # WebSockets allow 123
_MAX_SHOWN = 40  # characters of a wrong value
_CLOSE_S = 2.0
_GONE = (WebSocketDisconnect, RuntimeError, OSError)  # sending to a page that was closed

In = TypeVar("In")
Out = TypeVar("Out", bound="BaseModel | Mapping[str, Any]")
logger = logging.getLogger(__name__)


class PageModel(BaseModel):
    """A message of a page or to one: it cannot be changed, and has no fields but its own."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class PageMessageError(UserError):
    """A message that no page sends; its text is one line."""


class ChannelEndError(UserError):
    """Ends a channel: a code, and the reason in one line."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code = code


@dataclass(frozen=True, slots=True)
class ChannelTerms(Generic[In]):
    """What a page may send, and how much may wait for it.

    Attributes:
        messages: what the page sends; None: that is ignored.
        max_bytes: of one message of the page.
        is_limited: it may send `MESSAGES_PER_S` in the mean, and `MAX_BURST` at once.
        always: whether a message is taken in any case.
        max_waiting: messages that wait to be sent; if more do, the page is disconnected and connects again.
    """

    messages: TypeAdapter[In] | None
    max_bytes: int = 1000
    is_limited: bool = True
    always: Callable[[In], bool] = lambda _message: False
    max_waiting: int = 200

    def read(self, data: str | bytes) -> In:
        """A page's message. Raises `PageMessageError`."""
        assert self.messages is not None
        size = len(data) if isinstance(data, bytes) else len(data.encode(errors="replace"))
        if size > self.max_bytes:
            raise PageMessageError(f"a message of {size} bytes; at most {self.max_bytes} are taken")
        try:
            return self.messages.validate_json(data)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
        field = ".".join(str(step) for step in first["loc"])
        given = repr(first["input"]) if first["type"] != "json_invalid" else ""
        shown = given if len(given) <= _MAX_SHOWN else f"{given[:_MAX_SHOWN]}…"
        raise PageMessageError(": ".join(filter(None, [field, shown, first["msg"][:200]])))


class Channel(Generic[In, Out]):
    """One page's WebSocket, which is accepted here.

    Args:
        websocket: of the page.
        terms: what it may send, and how much may wait for it.
    """

    def __init__(self, websocket: WebSocket, terms: ChannelTerms[In]) -> None:
        self._websocket = websocket
        self._terms = terms
        self._events: deque[str] = deque()
        self._newest: dict[Hashable, str] = {}
        self._arrived = asyncio.Event()
        self._too_slow = False

    def send(self, message: Out, newest_of: Hashable = None) -> None:
        """Queue a message; see `put`."""
        self.put(encoded(message), newest_of)

    def put(self, text: str, newest_of: Hashable = None) -> None:
        """Queue a message that is encoded already.

        Args:
            text: JSON.
            newest_of: replaces the message of this key that was not sent yet; None: each counts.
        """
        if newest_of is not None:
            self._newest[newest_of] = text
        elif len(self._events) < self._terms.max_waiting:
            self._events.append(text)
        else:
            self._too_slow = True
        self._arrived.set()

    async def next(self) -> str:
        """Wait for the next message to send: those of which each counts come first.

        Raises:
            ChannelEndError: too many wait.
        """
        while not (self._events or self._newest or self._too_slow):
            self._arrived.clear()
            await self._arrived.wait()
        if self._too_slow:
            raise ChannelEndError(TRY_LATER_CODE, "this page does not keep up")
        if self._events:
            return self._events.popleft()
        return self._newest.pop(next(iter(self._newest)))

    async def serve(
        self,
        take: Callable[[In], Awaitable[None] | None] = lambda _message: None,
        *,
        left: Callable[[], None] = lambda: None,
        refused: Callable[[str, PageMessageError], None] | None = None,
    ) -> None:
        """Receive and send until the page has left or is disconnected.

        Args:
            take: gets each message of the page; may raise `ChannelEndError`.
            left: called as soon as the page has left or is to be disconnected.
            refused: gets messages that are none, with the reason; None: they end the channel.
        """
        tasks = [asyncio.create_task(each) for each in (self._receive(take, refused), self._send())]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            left()
            for task in tasks:
                task.cancel()
            failures = await asyncio.gather(*tasks, return_exceptions=True)
            for failure in failures:
                if isinstance(failure, Exception) and not isinstance(failure, ChannelEndError):
                    logger.error("a page's WebSocket failed", exc_info=failure)
        for failure in failures:
            if isinstance(failure, ChannelEndError):
                await close(self._websocket, failure.code, str(failure))

    async def _receive(
        self,
        take: Callable[[In], Awaitable[None] | None],
        refused: Callable[[str, PageMessageError], None] | None,
    ) -> None:
        terms, allowance = self._terms, Allowance(time.monotonic)
        while True:
            received = await self._websocket.receive()
            if received["type"] == "websocket.disconnect":
                return
            if terms.messages is None:
                continue
            data = received.get("text") or received.get("bytes") or ""
            message, problem = None, None
            try:
                message = terms.read(data)
            except PageMessageError as error:
                problem = error
            is_free = not terms.is_limited or (message is not None and terms.always(message))
            if not is_free and not allowance.spend():
                raise ChannelEndError(TOO_MANY_CODE, "too many messages a second")
            if problem is not None and refused is not None:
                refused(data if isinstance(data, str) else "", problem)
            elif message is None:
                raise ChannelEndError(BAD_MESSAGE_CODE, str(problem))
            elif (taking := take(message)) is not None:
                await taking

    async def _send(self) -> None:
        while True:
            text = await self.next()
            try:
                await self._websocket.send_text(text)
            except _GONE:
                return


async def refuse(websocket: WebSocket, text: str) -> None:
    """Accept a WebSocket and close it with code 4403 and one short line, which the page can show."""
    await websocket.accept()
    await close(websocket, REFUSED_CODE, text)


async def close(websocket: WebSocket, code: int, reason: str) -> None:
    """Close a WebSocket that was accepted; one that is closed already stays so."""
    short = reason.encode()[:_MAX_REASON_BYTES].decode(errors="ignore")
    if websocket.application_state is WebSocketState.CONNECTED:
        with contextlib.suppress(*_GONE, TimeoutError):
            async with asyncio.timeout(_CLOSE_S):
                await websocket.close(code, short)


def encoded(message: BaseModel | Mapping[str, Any]) -> str:
    """A message as JSON; numbers that are not finite become null."""
    return message.model_dump_json() if isinstance(message, BaseModel) else finite_json.encode(message)


class Allowance:
    """Limits messages to a rate, with a burst after a pause (a token bucket).

    Args:
        clock: seconds that never go back.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._left = MAX_BURST
        self._counted_s = clock()

    def spend(self) -> bool:
        """Count one message; False if it is one too many."""
        now_s = self._clock()
        self._left = min(MAX_BURST, self._left + (now_s - self._counted_s) * MESSAGES_PER_S)
        self._counted_s = now_s
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True
