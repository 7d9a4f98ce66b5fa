"""The simulator as a process of its own, which never outlives whoever started it."""

from __future__ import annotations

import asyncio
import contextlib
import sys
from asyncio.subprocess import PIPE, Process
from typing import TypeVar

from framerunner.errors import SettingError
from sitl.server_settings import VIDEO_PORT

T = TypeVar("T")

_GRACE_S = 3.0


class SitlProcess:
    """`framerunner sim` as a child process.

    The child stops when its standard input ends, so it goes even if this process is killed. It runs in a
    session of its own: a Ctrl-C in the terminal is first handled here.

    Args:
        scenario: name or file.
        speed: simulated seconds a second.
        instance: shifts its ports.
    """

    def __init__(self, scenario: str, speed: float = 1.0, instance: int = 0) -> None:
        self._arguments = [
            *(sys.executable, "-m", "framerunner", "sim", "--lifeline"),
            *("--scenario", scenario, "--speed", f"{speed:g}", "--instance", str(instance)),
            *("--video-rtp", "off"),
        ]
        self._process: Process | None = None
        self._said: list[str] = []
        self._reader: asyncio.Task[None] | None = None
        self.drone_url = f"udpin://127.0.0.1:{14540 + instance}"
        port = VIDEO_PORT + instance
        self.video_url = f"http://127.0.0.1:{port}/video"
        self.referee_url = f"http://127.0.0.1:{port}/referee.json"

    async def __aenter__(self) -> SitlProcess:
        """Start it."""
        self._process = await asyncio.create_subprocess_exec(
            *self._arguments,
            stdin=PIPE,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=PIPE,
            start_new_session=True,
        )
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
        return f"the simulator ended with code {code}: {last}"

    async def guard(self, work: asyncio.Task[T]) -> T:
        """Wait for some work, but not longer than the simulator lives.

        When this is cancelled, so is the work; if it ends with a result all the same, that is returned.

        Raises:
            SettingError: the simulator could not start or died; its own words are the reason.
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
                self._said = [*self._said[-50:], text]

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
