"""Worker processes that are ready for the next flight or batch: to start one takes seconds."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine

from framerunner.editing.worker_process import WorkerProcess

_IDLE_S = 120.0  # without a batch, after which a worker that has flown one is ended
logger = logging.getLogger(__name__)


class WorkerPool:
    """A spare worker, and those that have flown batches and take another one.

    Args:
        max_idle: of those that have flown.
        keep: runs something in the background until it is done.
    """

    def __init__(self, max_idle: int, keep: Callable[[Coroutine[None, None, None]], None]) -> None:
        self._max_idle = max_idle
        self._keep = keep
        self._spare: WorkerProcess | None = None
        self._idle: list[WorkerProcess] = []
        self._closed = False

    def take(self) -> WorkerProcess:
        """One that is ready, else a new one, which is not started yet."""
        if self._spare is not None:
            self._idle.append(self._spare)
            self._spare = None
        while self._idle:
            worker = self._idle.pop(0)
            if worker.usable:
                return worker
        return WorkerProcess()

    def give_back(self, worker: WorkerProcess) -> None:
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
            self._spare = WorkerProcess()
            self._keep(self._start(self._spare))

    async def _start(self, spare: WorkerProcess) -> None:
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
