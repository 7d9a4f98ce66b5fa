"""The sticks in a browser: the WebSocket at /ws/pilot."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from typing import TYPE_CHECKING

from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from monitor.access import refuse
from monitor.pilot_desk import Browser, JsonMessage, PilotDesk
from monitor.pilot_messages import Allowance, Order, PilotMessageError, read_message
from monitor.sticks import Sticks

if TYPE_CHECKING:
    from monitor.server import Monitor

BAD_MESSAGE_CODE, TOO_MANY_CODE = 4400, 4429  # as HTTP's
UNNAMED = "another window"
_LONGEST_QUEUE = 200  # messages; whoever is so slow has gone
_LONGEST_REASON = 120  # bytes; WebSockets allow 123
_CLOSE_S = 2.0
_MOST_ORDERS = 8  # of one browser under way

logger = logging.getLogger(__name__)


def register(monitor: Monitor) -> None:
    """Add the WebSocket."""
    desk = PilotDesk(monitor.fleet)

    @monitor.web.websocket("/ws/pilot")
    async def pilot(websocket: WebSocket) -> None:
        visitor = monitor.access.visitor(websocket)
        if not visitor.may_fly:
            await refuse(websocket, "only those who logged in may fly")
            return
        await websocket.accept()
        await _Connection(websocket, desk, visitor.name or UNNAMED, visitor.may_judge).serve()


class _Connection:
    """One browser's WebSocket, from its first message to its last."""

    def __init__(self, websocket: WebSocket, desk: PilotDesk, name: str, may_judge: bool) -> None:
        self._websocket = websocket
        self._desk = desk
        self._outbox: asyncio.Queue[JsonMessage] = asyncio.Queue(_LONGEST_QUEUE)
        self._browser = Browser(name, may_judge, self._tell)
        self._allowance = Allowance(time.monotonic)
        self._orders: set[asyncio.Task[None]] = set()
        self._overrun = asyncio.Event()

    async def serve(self) -> None:
        """Listen until the browser goes or has to."""
        self._desk.come(self._browser)
        tasks = [asyncio.create_task(each) for each in (self._listen(), self._speak(), self._overrun.wait())]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._desk.go(self._browser)
            for task in tasks:
                task.cancel()
            for failure in await asyncio.gather(*tasks, return_exceptions=True):
                if isinstance(failure, Exception):
                    logger.error("a pilot's WebSocket failed", exc_info=failure)
        if self._overrun.is_set():
            await self._close(TOO_MANY_CODE, "this page does not keep up")

    async def _listen(self) -> None:
        while True:
            message = await self._websocket.receive()
            if message["type"] == "websocket.disconnect":
                return
            if not self._allowance.spend():
                await self._close(TOO_MANY_CODE, "too many messages a second")
                return
            try:
                self._take(read_message(message.get("text") or message.get("bytes") or ""))
            except PilotMessageError as error:
                await self._close(BAD_MESSAGE_CODE, str(error))
                return

    def _take(self, message: Sticks | Order) -> None:
        if isinstance(message, Sticks):
            self._desk.sticks(self._browser, message)
        elif len(self._orders) >= _MOST_ORDERS and message.what not in {"hold", "land", "stop_motors"}:
            self._reply(message.what, False, "too many orders at once; wait for an answer")
        else:
            task = asyncio.create_task(self._carry_out(message))
            self._orders.add(task)  # it goes on when the browser goes: a landing is not to be forgotten
            task.add_done_callback(self._orders.discard)

    async def _carry_out(self, order: Order) -> None:
        try:
            answer = await self._desk.do(self._browser, order)
        except Exception:
            logger.exception("order %s to drone %d", order.what, order.drone_id)
            self._reply(order.what, False, "the monitor failed at this; its log says more")
        else:
            self._reply(order.what, answer.ok, answer.text)

    def _reply(self, what: str, ok: bool, text: str) -> None:
        self._tell({"kind": "reply", "what": what, "ok": ok, "text": text})

    def _tell(self, message: JsonMessage) -> None:
        try:
            self._outbox.put_nowait(message)
        except asyncio.QueueFull:
            self._overrun.set()

    async def _speak(self) -> None:
        while True:
            message = await self._outbox.get()
            try:
                await self._websocket.send_json(message)
            except (WebSocketDisconnect, RuntimeError, OSError):
                return  # gone; listening ends as well

    async def _close(self, code: int, reason: str) -> None:
        short = reason.encode()[:_LONGEST_REASON].decode(errors="ignore")
        if self._websocket.application_state is WebSocketState.CONNECTED:
            with contextlib.suppress(RuntimeError, OSError, TimeoutError):
                async with asyncio.timeout(_CLOSE_S):
                    await self._websocket.close(code, short)
