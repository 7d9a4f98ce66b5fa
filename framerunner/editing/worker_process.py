"""The server's side of a worker process: started, given orders, read, and ended whatever it does."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import sys
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncIterator

from pydantic import BaseModel

from framerunner.editing.words import Said

MAX_LINE_BYTES = 8_000_000
_MAX_STDERR_BYTES = 20_000
_GRACE_S = 2.0  # from the end of its output to its own


class WorkerProcess:
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
