"""Worker processes as the server has them: started, given orders, read, and ended whatever they do.

To start one takes seconds, so some are kept ready.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator, Callable, Coroutine

from pydantic import BaseModel

from framerunner.editing.words import Said

MAX_LINE_BYTES = 8_000_000
_MAX_STDERR_BYTES = 20_000
_GRACE_S = 2.0  # from the end of its output to its own
_IDLE_S = 120.0  # without a batch, after which a worker that has flown one is ended
logger = logging.getLogger(__name__)


class FlightProcess:
    """`framerunner.editing.worker`; what is sent first is its task; `kill` ends all its processes."""

    def __init__(self) -> None:
        self._process: Process | None = None
        self._errors: asyncio.Task[bytes] | None = None
        self._starting = asyncio.Lock()
        self._is_needed = True

    async def start(self) -> None:
        """Start it, once; others that call this wait for it. Raises OSError if that is not possible."""
        async with self._starting:
            if self._process is None and self._is_needed:
                await self._start()

    async def _start(self) -> None:
        process = self._process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-m",
            "framerunner.editing.worker",
            stdin=PIPE,
            stdout=PIPE,
            stderr=PIPE,
            start_new_session=True,  # its own workers are in its process group
            limit=MAX_LINE_BYTES,
        )
        assert process.stderr is not None
        self._errors = asyncio.create_task(_last_bytes(process.stderr))

    @property
    def usable(self) -> bool:
        """Whether it has not ended."""
        return self._process is None or self._process.returncode is None

    def send(self, message: BaseModel) -> None:
        """Send a line; nothing if it has ended."""
        if self._process is not None and self._process.stdin is not None:
            with contextlib.suppress(OSError, RuntimeError):
                self._process.stdin.write(message.model_dump_json().encode() + b"\n")

    async def lines(self) -> AsyncIterator[bytes]:
        """What it tells, until it has ended or told something far too long."""
        assert self._process is not None
        assert self._process.stdout is not None
        with contextlib.suppress(ValueError, asyncio.LimitOverrunError):
            async for line in self._process.stdout:
                yield line

    async def ended(self) -> Said | None:
        """Wait until it has ended and end what it left; returns how it ended, None if as it should."""
        process, errors = self._process, self._errors
        assert process is not None
        assert errors is not None
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(_GRACE_S):
                await process.wait()
        self.kill()  # what is left of its group, or a process that only closed its output
        code = await process.wait()
        lines = (await errors).decode(errors="replace").strip().splitlines()
        if code == 0:
            return None
        if code in (-signal.SIGKILL, -signal.SIGXCPU):
            return Said("flight.killed")
        how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        return Said("plain", text=f"{how}: {lines[-1][:300]}" if lines else how)

    async def end(self) -> None:
        """Kill it and wait for its end, if it was started; it is not started any more."""
        async with self._starting:
            self._is_needed = False
            if self._process is not None:
                self.kill()
                await self.ended()

    def kill(self) -> None:
        """End it and all that it started at once."""
        if self._process is not None:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(self._process.pid, signal.SIGKILL)


async def _last_bytes(stream: asyncio.StreamReader) -> bytes:
    """Read to the end, so that the writer never waits, and keep the last part."""
    kept = b""
    while data := await stream.read(4096):
        kept = (kept + data)[-_MAX_STDERR_BYTES:]
    return kept


class WorkerPool:
    """A spare worker, and those that have flown batches and take another one.

    Args:
        max_idle: of those that have flown.
        keep: runs something in the background until it is done.
    """

    def __init__(self, max_idle: int, keep: Callable[[Coroutine[None, None, None]], None]) -> None:
        self._max_idle = max_idle
        self._keep = keep
        self._spare: FlightProcess | None = None
        self._idle: list[FlightProcess] = []
        self._closed = False

    def take(self) -> FlightProcess:
        """One that is ready, else a new one, which is not started yet."""
        if self._spare is not None:
            self._idle.append(self._spare)
            self._spare = None
        while self._idle:
            worker = self._idle.pop(0)
            if worker.usable:
                return worker
        return FlightProcess()

    def give_back(self, worker: FlightProcess) -> None:
        """Keep a worker that takes another batch, for a while."""

        def end() -> None:
            if worker in self._idle:
                self._idle.remove(worker)
                self._keep(worker.end())

        if self._closed or len(self._idle) >= self._max_idle:
            self._keep(worker.end())
            return
        self._idle.append(worker)
        asyncio.get_running_loop().call_later(_IDLE_S, end)

    def prepare(self) -> None:
        """Start a spare one, unless there is one."""
        if self._spare is None and not self._closed:
            self._spare = FlightProcess()
            self._keep(self._start(self._spare))

    async def _start(self, spare: FlightProcess) -> None:
        try:
            await spare.start()
        except OSError as error:
            logger.warning("a worker of the editor cannot be started: %s", error)

    def end_spare(self) -> None:
        """Nobody needs it any more."""
        if self._spare is not None:
            self._keep(self._spare.end())
            self._spare = None

    def close(self) -> None:
        """End all that nobody has taken."""
        self._closed = True
        self.end_spare()
        for worker in self._idle:
            self._keep(worker.end())
        self._idle.clear()
