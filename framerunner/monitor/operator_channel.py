"""`/ws/operator`: the operator's buttons, between the pages of those who may fly and the flight.

A flight connects to a local socket that only this user may open. What it sends is passed on to all pages, and
their demands to the flight with who made them; the flight decides what they mean (`operator_pages.py` of
`offboard/safety/`).
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import socket
from errno import EADDRINUSE
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import TypeAdapter
from starlette.websockets import WebSocket

from framerunner.monitor.channel import (
    REFUSED_CODE,
    TRY_LATER_CODE,
    Channel,
    ChannelEndError,
    ChannelTerms,
    close,
    encoded,
    refuse,
)
from framerunner.monitor.settings import MonitorError
from framerunner.wire.operator_messages import (
    ALL_PAGES,
    MAX_LINE_BYTES,
    AnswerMessage,
    EndMessage,
    NoFlightMessage,
    PageDemand,
    PageMessage,
    ToPage,
    YouMessage,
)

if TYPE_CHECKING:
    from framerunner.monitor.server import Monitor

MAX_PAGES = 20
_MAX_UNSENT_BYTES = 1 << 16
_TRIAL_S = 1.0
REFUSED = "another flight has tried to connect and was refused; end this one first"

_FROM_PAGE: ChannelTerms[PageDemand] = ChannelTerms(
    TypeAdapter(PageDemand),
    max_bytes=500,  # a page sends some 80
    always=lambda demand: demand.kind == "stop",  # a stop is taken in any case
)

logger = logging.getLogger(__name__)


class _Page(Channel[PageDemand, ToPage]):
    """One page's connection."""

    def __init__(self, websocket: WebSocket, number: int, name: str) -> None:
        super().__init__(websocket, _FROM_PAGE)
        self.number = number
        self.name = name


class OperatorSession:
    """The flight that is connected, and the pages that show it.

    Args:
        path: of the socket at which flights connect; it is opened here, and listens in `run`.

    Raises:
        MonitorError: the socket cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._listener = _opened_socket(path)
        except OSError as error:
            raise MonitorError(
                f"monitor: --operator-socket {path}: cannot be opened ({error.strerror or error}); "
                "give the path of a new file in a folder of yours"
            ) from None
        self._pages: dict[int, _Page] = {}
        self._numbers = count(1)
        self._flight: asyncio.StreamWriter | None = None
        self._shown = encoded(NoFlightMessage())  # what a page that opens is sent first

    async def run(self) -> None:
        """Listen for flights until cancelled."""
        server = await asyncio.start_unix_server(self._serve, sock=self._listener, limit=MAX_LINE_BYTES)
        try:
            await server.serve_forever()
        finally:
            with contextlib.suppress(OSError):
                self._path.unlink()

    def enter(self, websocket: WebSocket, name: str) -> _Page | None:
        """Add a page of a person; None if there are too many."""
        if len(self._pages) >= MAX_PAGES:
            return None
        page = _Page(websocket, next(self._numbers), name)
        self._pages[page.number] = page
        page.send(YouMessage(page=page.number))
        page.put(self._shown)
        return page

    def leave(self, page: _Page) -> None:
        """Remove a page; the flight is told."""
        self._pages.pop(page.number, None)
        self._tell(PageMessage(page=page.number, name=page.name, what="gone"))

    def demand(self, page: _Page, demand: PageDemand) -> None:
        """Pass a page's demand on; without a flight it means nothing."""
        self._tell(
            PageMessage(
                page=page.number, name=page.name, what=demand.kind, beat=demand.beat, flight=demand.flight
            )
        )

    def _tell(self, message: PageMessage) -> None:
        flight = self._flight
        if flight is None or flight.is_closing():
            return
        if flight.transport.get_write_buffer_size() > _MAX_UNSENT_BYTES:
            flight.transport.abort()  # it hangs; demands that wait for it would come late
            return
        flight.write(message.model_dump_json().encode() + b"\n")

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """One flight's connection; a second flight is refused."""
        if self._flight is not None:
            logger.warning("a second flight with an operator was refused; end the first one")
            self._show_all(AnswerMessage(page=ALL_PAGES, text=REFUSED).model_dump_json())
            writer.close()
            return
        self._flight = writer
        is_open = False  # it has sent a message, and not its last one
        try:
            with contextlib.suppress(OSError, ValueError, RecursionError):
                while line := await reader.readline():
                    is_open = not self._pass_on(line)
        finally:
            self._flight = None
            writer.close()
            if is_open:
                words = "the app has ended, or its connection is lost: use the remote control"
                self._show_all(EndMessage(flight="", words=words, lost=True).model_dump_json())

    def _pass_on(self, line: bytes) -> bool:
        """Pass a flight's message on to its page or to all; True if it is its last one."""
        message = json.loads(line)  # ValueError ends the connection
        if not isinstance(message, dict):
            raise ValueError("not a message of a flight")
        text = line.decode()
        kind = message.get("kind")
        if kind == "answer":
            number = message.get("page")
            page = self._pages.get(number) if isinstance(number, int) else None
            if page is not None:
                page.put(text)
            return False
        if kind == "flight":
            self._shown = text
        elif kind == "end":
            self._shown = encoded(NoFlightMessage())
        self._show_all(text)
        return bool(kind == "end")

    def _show_all(self, text: str) -> None:
        for page in self._pages.values():
            page.put(text)


def _opened_socket(path: Path) -> socket.socket:
    """A socket that only this user may open, in the place of one that a monitor left when it was killed.

    Raises:
        OSError: it cannot be opened there, or another monitor listens there.
    """
    if path.is_socket():
        with socket.socket(socket.AF_UNIX) as trial:
            trial.settimeout(_TRIAL_S)
            try:
                trial.connect(str(path))
            except ConnectionRefusedError:
                path.unlink()
            else:
                raise OSError(EADDRINUSE, "another monitor listens there")
    listener = socket.socket(socket.AF_UNIX)
    try:
        listener.bind(str(path))
        path.chmod(0o600)  # nobody can connect before it listens
    except OSError:
        listener.close()
        raise
    return listener


def register(monitor: Monitor) -> None:
    """Add the WebSocket, and listen for flights."""
    path = monitor.settings.operator_socket
    session = None if path is None else OperatorSession(path)
    if session is not None:
        monitor.jobs.append(session.run)

    @monitor.web.websocket("/ws/operator")
    async def operator(websocket: WebSocket) -> None:
        visitor = monitor.access.visitor(websocket)
        if not visitor.may_fly:
            await refuse(websocket, "only judges and organisers may operate a flight; log in at /login")
            return
        if session is None:
            await refuse(websocket, "this monitor was started without --operator-socket")
            return
        await websocket.accept()
        page = session.enter(websocket, visitor.name)
        if page is None:
            await close(websocket, TRY_LATER_CODE, "too many operators' pages")
            return

        def take(demand: PageDemand) -> None:
            if demand.kind != "stop" and not monitor.access.visitor(websocket).may_fly:
                raise ChannelEndError(REFUSED_CODE, "logged out")
            session.demand(page, demand)

        await page.serve(take, left=lambda: session.leave(page))
