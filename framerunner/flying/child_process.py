"""A command of this program as a child process, which never outlives whoever started it: both its ends."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import sys
import threading
from asyncio.subprocess import PIPE, Process
from collections.abc import Callable, Coroutine, Sequence
from typing import Self, TypeVar

from errors import SettingError

T = TypeVar("T")

_GRACE_S = 3.0
_LINES_KEPT = 50


class ChildProcess:
    """`framerunner …` as a child process.

    The child stops when its standard input ends, so it goes even if this process is killed. It runs in a
    session of its own: a Ctrl-C in the terminal is first handled here.

    Args:
        name: for people: "the simulator".
        arguments: of the command, `--lifeline` among them.
        hear: called with each line that it says on standard error.
        handed: a socket that it inherits, with its number; closed here once it has started.
    """

    def __init__(
        self,
        name: str,
        arguments: Sequence[str],
        hear: Callable[[str], None] = lambda line: None,
        handed: socket.socket | None = None,
    ) -> None:
        self._name = name
        self._arguments = [sys.executable, "-m", "framerunner", *arguments]
        self._hear = hear
        self._handed = handed
        self._process: Process | None = None
        self._said: list[str] = []
        self._reader: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        """Start it."""
        handed = self._handed
        try:
            self._process = await asyncio.create_subprocess_exec(
                *self._arguments,
                stdin=PIPE,
                stdout=asyncio.subprocess.DEVNULL,
                stderr=PIPE,
                start_new_session=True,
                pass_fds=() if handed is None else (handed.fileno(),),
            )
        finally:
            if handed is not None:
                handed.close()
        self._reader = asyncio.create_task(self._read())
        return self

    async def __aexit__(self, *_: object) -> None:
        """Stop it: first by closing its standard input, then by force."""
        process = self._process
        assert process is not None
        if process.stdin is not None:
            process.stdin.close()
        try:
            await asyncio.wait_for(process.wait(), _GRACE_S)
        except TimeoutError:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()
        if self._reader is not None:
            self._reader.cancel()
            await asyncio.gather(self._reader, return_exceptions=True)

    async def failed(self) -> str:
        """Return, when the process ends by itself, the last line it said. Waits for ever if all is well."""
        assert self._process is not None
        code = await self._process.wait()
        if self._reader is not None:
            await asyncio.wait({self._reader}, timeout=1.0)
        last = self._said[-1].removeprefix("error: ") if self._said else "it said nothing"
        return f"{self._name} ended with code {code}: {last}"

    async def guard(self, work: asyncio.Task[T]) -> T:
        """Wait for some work, but not longer than the child lives.

        When this is cancelled, so is the work; if it ends with a result all the same, that is returned.

        Raises:
            SettingError: it could not start or died; its own words are the reason.
        """
        watching = asyncio.create_task(self.failed())
        try:
            await _wait_or_cancel(work, watching)
            if not work.done():
                work.cancel()
                await asyncio.gather(work, return_exceptions=True)
                raise SettingError(watching.result())
            return work.result()
        finally:
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)

    async def _read(self) -> None:
        assert self._process is not None
        assert self._process.stderr is not None
        async for line in self._process.stderr:
            text = line.decode(errors="replace").rstrip()
            if text:
                self._said = [*self._said[-_LINES_KEPT:], text]
                self._hear(text)

    @property
    def said(self) -> tuple[str, ...]:
        """What it said on standard error, line by line."""
        return tuple(self._said)


async def _wait_or_cancel(work: asyncio.Task[T], watching: asyncio.Task[str]) -> None:
    """Wait for one of two tasks; hand a cancellation on to the work, and wait for the result it may have."""
    try:
        await asyncio.wait({work, watching}, return_when=asyncio.FIRST_COMPLETED)
    except asyncio.CancelledError:
        work.cancel()
        await asyncio.wait({work})
        if work.cancelled():
            raise
        task = asyncio.current_task()
        if task is not None:
            task.uncancel()  # the work's result tells of it


async def until_standard_input_ends(work: Coroutine[object, object, None]) -> None:
    """Do some work until it is done or standard input ends: whoever started this is gone then.

    Args:
        work: is cancelled in the second case.
    """
    running = asyncio.create_task(work)
    watching = asyncio.create_task(_standard_input_ends())
    done, _ = await asyncio.wait({running, watching}, return_when=asyncio.FIRST_COMPLETED)
    for task in (running, watching):
        task.cancel()
    await asyncio.gather(running, watching, return_exceptions=True)
    if running in done:
        running.result()


async def _standard_input_ends() -> None:
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    while await reader.read(1024):
        pass


def end_with_standard_input(tidy: Callable[[], None]) -> None:
    """Have this process end at once when standard input ends, whatever it is doing; for one without a loop.

    Args:
        tidy: is called before.
    """

    def watch() -> None:
        while os.read(0, 1024):
            pass
        tidy()
        os._exit(1)

    threading.Thread(target=watch, name="lifeline", daemon=True).start()
