"""Which recorded flight is read next: a few at a time, and whoever asks for the same one shares it."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

from monitor.ports import RunError, RunLibrary

MAX_READING = 2
MAX_WAITING = 2


class BusyError(RunError):
    """Too many runs wait to be read."""


class ReadingQueue:
    """Reads runs: two at a time, so that one that takes long does not hold up all others.

    Args:
        library: the runs.
    """

    def __init__(self, library: RunLibrary) -> None:
        self._library = library
        self._tasks: dict[str, asyncio.Task[Mapping[str, Any]]] = {}
        self._turns = asyncio.Semaphore(MAX_READING)

    async def recording(self, name: str) -> Mapping[str, Any]:
        """One run; at once if it was read before.

        Raises:
            BusyError: as many as may wait do so already.
            RunError: it cannot be shown.
        """
        known = await asyncio.to_thread(self._library.kept, name)
        if known is not None:
            return known
        task = self._tasks.get(name)
        if task is None:
            if len(self._tasks) >= MAX_READING + MAX_WAITING:
                raise BusyError(f"{len(self._tasks)} flights are being read; try again in a minute")
            task = asyncio.create_task(self._read(name))
            self._tasks[name] = task
            task.add_done_callback(lambda done: self._forget(name, done))
        return await asyncio.shield(task)  # others may wait for it when this one has gone

    async def _read(self, name: str) -> Mapping[str, Any]:
        async with self._turns:
            return await asyncio.to_thread(self._library.recording, name)

    def _forget(self, name: str, done: asyncio.Task[Mapping[str, Any]]) -> None:
        del self._tasks[name]
        if not done.cancelled():
            done.exception()  # was told to those who waited, if any is still there
