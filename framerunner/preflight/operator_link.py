"""A flight's connection to the monitor, whose pages have the operator's buttons.

The monitor listens on a local socket that only its user may open; see
`framerunner/wire/operator_messages.py`. The connection is opened again when it is lost.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable
from pathlib import Path

from pydantic import BaseModel, ValidationError

from framerunner.errors import SettingError
from framerunner.preflight.card import FlightCard
from framerunner.wire.operator_messages import (
    MAX_LINE_BYTES,
    AnswerMessage,
    BeatMessage,
    EndMessage,
    FlightMessage,
    PageMessage,
)
from offboard.safety.operator import Operator
from offboard.safety.operator_pages import BEAT_S, OperatorPages

_AGAIN_S = 1.0
_REFUSAL_S = 0.5  # in which a monitor that has a flight closes another one's connection
_MAX_WAITING_BYTES = 1 << 20  # that a monitor which hangs has not read

logger = logging.getLogger(__name__)


class OperatorLink:
    """Shows a flight to the operators' pages and takes their demands, while it is entered.

    Args:
        path: of the monitor's socket.
        operator: of the flight.
        title: of the flight, for people.
        terminal: the flight has a terminal, which can stop it, too, or needs no operator.
        clock: seconds that never go back.
    """

    def __init__(
        self,
        path: Path,
        operator: Operator,
        title: str,
        *,
        terminal: bool,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._path = path
        self._operator = operator
        self._terminal = terminal
        self._clock = clock
        self._flight = FlightMessage(flight=f"{title} {time.time():.3f}", title=title)
        self._pages = OperatorPages(operator, self._flight.flight, alone=not terminal)
        self._writer: asyncio.StreamWriter | None = None
        self._tasks: list[asyncio.Task[None]] = []

    async def __aenter__(self) -> OperatorLink:
        """Connect.

        Raises:
            SettingError: no monitor listens there, or it has another flight.
        """
        try:
            reader = await self._open()
        except OSError as error:
            reason = error.strerror or error
            raise SettingError(
                f"--operator-socket {self._path}: no monitor listens there ({reason}); start framerunner "
                f"monitor --operator-socket {self._path}"
            ) from None
        if await _is_refused(reader):
            raise SettingError(
                f"--operator-socket {self._path}: the monitor there has another flight already; end it, or "
                "start another monitor with another socket"
            )
        self._tasks = [asyncio.create_task(each) for each in (self._serve(reader), self._beat_forever())]
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: object
    ) -> None:
        """Say how it ended, and disconnect."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        ended = self._operator.stop_words if self._operator.stops else "the flight is over"
        words = str(error) if isinstance(error, Exception) else ended
        self._send(EndMessage(flight=self._flight.flight, words=words))
        if self._writer is not None:
            with contextlib.suppress(OSError, TimeoutError):
                async with asyncio.timeout(1.0):
                    await self._writer.drain()
            self._writer.close()

    def show_card(self, card: FlightCard, failed: tuple[str, ...]) -> None:
        """Show the flight card, and the names of checks that prevent arming."""
        self._flight = self._flight.model_copy(update={"sections": card.sections, "failed": failed})
        self._send(self._flight)

    async def _open(self) -> asyncio.StreamReader:
        reader, self._writer = await asyncio.open_unix_connection(str(self._path), limit=MAX_LINE_BYTES)
        self._send(self._flight)
        return reader

    async def _serve(self, reader: asyncio.StreamReader) -> None:
        """Take pages' messages; connect again when the connection is lost."""
        while True:
            with contextlib.suppress(OSError, ValueError):  # ValueError: a line that is too long
                while line := await reader.readline():
                    self._take(line)
            self._pages.lose_all()
            if self._writer is not None:  # the monitor serves one connection at a time
                self._writer.close()
            self._writer = None
            logger.warning("the monitor with the operator's page is lost; trying again")
            while self._writer is None:
                await asyncio.sleep(_AGAIN_S)
                with contextlib.suppress(OSError):
                    reader = await self._open()
            logger.warning("the monitor with the operator's page is back")

    def _take(self, line: bytes) -> None:
        try:
            message = PageMessage.model_validate_json(line)
        except ValidationError:
            logger.warning("the monitor has sent something that is no demand; it is ignored")
            return
        problem = self._pages.take(message, self._clock())
        if problem:
            self._send(AnswerMessage(page=message.page, text=problem))

    async def _beat_forever(self) -> None:
        while True:
            now_s = self._clock()
            self._pages.check(now_s)
            operator = self._operator
            self._send(
                BeatMessage(
                    flight=self._flight.flight,
                    beat=self._pages.beat(now_s),
                    phase=operator.phase,
                    asks=operator.asks,
                    stops=operator.stops,
                    terminal=self._terminal,
                    words=operator.stop_words if operator.stops else "",
                    pages=self._pages.states(now_s),
                )
            )
            await asyncio.sleep(BEAT_S)

    def _send(self, message: BaseModel) -> None:
        writer = self._writer
        if writer is None or writer.is_closing():
            return
        if writer.transport.get_write_buffer_size() > _MAX_WAITING_BYTES:
            writer.transport.abort()  # a monitor that hangs; its pages are lost
            return
        writer.write(message.model_dump_json().encode() + b"\n")


async def _is_refused(reader: asyncio.StreamReader) -> bool:
    """Whether a monitor closes a new connection at once."""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(_REFUSAL_S):
            while not reader.at_eof() and reader.exception() is None:  # noqa: ASYNC110 - a read would take what is for `_serve`
                await asyncio.sleep(0.02)
            return True
    return False
