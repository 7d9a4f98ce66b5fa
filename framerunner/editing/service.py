"""The flights and batches that browsers started: their worker processes, limits and watchers."""

from __future__ import annotations

import asyncio
import logging
import os
import secrets
from collections import OrderedDict
from collections.abc import Coroutine
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from pydantic import BaseModel, ValidationError

from framerunner.editing import messages
from framerunner.editing.worker_process import WorkerProcess

_SPARE_S = 2.0  # after a start, until a worker is made ready for the next one
_KEPT_JOBS = 8  # that are over, for pages that are opened again
_MAX_KEPT_LINES = messages.MAX_COUNT + 10
logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class EditingSettings:
    """Limits of what browsers may start.

    Attributes:
        pilot: a contestant's Python file, which workers execute; None: missions use `Pilot` itself.
        max_runs: flights under control at the same time.
        max_batches: batches at the same time.
        jobs: flights of a batch at the same time.
        processor_s: processor time of one flight.
        memory_bytes: of each process, beyond that of the libraries.
        silent_s: after which a batch that told nothing is ended.
        unwatched_s: after which a flight or batch that nobody watches is ended.
    """

    pilot: Path | None = None
    max_runs: int = 4
    max_batches: int = 1
    jobs: int = field(default_factory=lambda: max(1, (os.cpu_count() or 2) - 1))
    processor_s: float = 60.0
    memory_bytes: int = 512 << 20
    silent_s: float = 300.0
    unwatched_s: float = 30.0


class Watcher(Protocol):
    """A browser's connection."""

    def put(self, line: str) -> None:
        """Queue a message, JSON."""


class _Job:
    """A flight or a batch with its process.

    Attributes:
        kept: lines for those who watch later: a flight's end, or all of a batch.
        over: it has told its end.
        refused: it was not even started.
    """

    def __init__(self, name: str, worker: WorkerProcess, *, is_batch: bool) -> None:
        self.name = name
        self.worker = worker
        self.is_batch = is_batch
        self.watchers: set[Watcher] = set()
        self.asked: dict[int, tuple[Watcher, int]] = {}
        self.kept: list[str] = []
        self.flown: list[messages.Flight] = []
        self.count = 0
        self.over = False
        self.cancelled = False
        self.refused = False
        self._number = 0

    def ask(self, watcher: Watcher, tag: int) -> int:
        """A tag by which the answer to a request finds its watcher."""
        self._number += 1
        self.asked[self._number] = (watcher, tag)
        return self._number

    def tell(self, message: BaseModel, *, keep: bool = False) -> None:
        line = message.model_dump_json()
        if keep and len(self.kept) < _MAX_KEPT_LINES:
            self.kept.append(line)
        for watcher in self.watchers:
            watcher.put(line)


class EditingService:
    """Starts and controls flights and batches for watchers; call `close` at the end.

    Args:
        settings: the limits.
    """

    def __init__(self, settings: EditingSettings) -> None:
        self._settings = settings
        self._jobs: OrderedDict[str, _Job] = OrderedDict()
        self._tasks: set[asyncio.Task[None]] = set()
        self._pages: set[Watcher] = set()
        self._spare: WorkerProcess | None = None
        self._closed = False

    def enter(self, watcher: Watcher) -> None:
        """Note a watcher that connected; a worker is made ready for it, as that takes a second."""
        self._pages.add(watcher)
        self._prepare()

    async def do(self, request: messages.Request, watcher: Watcher) -> None:
        """Carry out a request; its answer is put to the watcher."""
        if isinstance(request, messages.Start | messages.StartBatch):
            await self._start(request, watcher)
            return
        name = request.batch if isinstance(request, messages.Cancel) else request.run
        job = self._jobs.get(name)
        if job is None:
            text = f"'{name}': there is no such flight or batch; start it again"
            _put(watcher, messages.Refused(tag=request.tag, text=text))
        elif isinstance(request, messages.Watch):
            self._watch(job, request, watcher)
        elif isinstance(request, messages.Cancel):
            job.cancelled = True
            job.worker.kill()
            _put(watcher, messages.Done(tag=request.tag))
        elif job.over or job.is_batch:
            why = "it is a batch; cancel it" if job.is_batch else "the flight is over"
            _put(watcher, messages.Refused(tag=request.tag, text=why, run=name))
        else:
            job.worker.send(request.model_copy(update={"tag": job.ask(watcher, request.tag)}))

    def leave(self, watcher: Watcher) -> None:
        """Forget a watcher that disconnected; what nobody watches any more is ended after a while."""
        self._pages.discard(watcher)
        if not self._pages and self._spare is not None:
            self._keep(self._spare.end())
            self._spare = None
        for job in self._jobs.values():
            if watcher in job.watchers:
                job.watchers.discard(watcher)
                self._end_unwatched_later(job)

    async def close(self) -> None:
        """End everything."""
        self._closed = True
        if self._spare is not None:
            self._keep(self._spare.end())
            self._spare = None
        for job in self._jobs.values():
            job.cancelled = True
            job.worker.kill()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _start(self, request: messages.Start | messages.StartBatch, watcher: Watcher) -> None:
        is_batch = isinstance(request, messages.StartBatch)
        refusal = self._no_room(is_batch=is_batch)
        if refusal:
            _put(watcher, messages.Refused(tag=request.tag, text=refusal))
            return
        name = secrets.token_urlsafe(9)
        settings = self._settings
        common = {
            "pilot": None if settings.pilot is None else str(settings.pilot),
            "processor_s": settings.processor_s,
            "memory_bytes": settings.memory_bytes,
        }
        task: messages.RunTask | messages.BatchTask
        start = request.model_copy(update={"tag": 1})  # the job's first
        if isinstance(start, messages.StartBatch):
            task = messages.BatchTask.model_validate(
                {**common, "batch": name, "start": start, "jobs": settings.jobs}
            )
        else:
            task = messages.RunTask.model_validate({**common, "run": name, "start": start})
        spare, self._spare = self._spare, None
        worker = spare if spare is not None and spare.usable else WorkerProcess()
        job = self._jobs[name] = _Job(name, worker, is_batch=is_batch)
        job.watchers.add(watcher)
        job.ask(watcher, request.tag)
        self._keep(self._follow(job, task))
        asyncio.get_running_loop().call_later(_SPARE_S, self._prepare)

    def _prepare(self) -> None:
        """Start a worker for the next task, unless there is one or nobody is connected."""
        if self._spare is None and self._pages and not self._closed:
            self._spare = WorkerProcess()
            self._keep(self._start_spare(self._spare))

    async def _start_spare(self, spare: WorkerProcess) -> None:
        try:
            await spare.start()
        except OSError as error:
            logger.warning("a worker of the editor cannot be started: %s", error)
            return
        if spare is not self._spare and not any(spare is job.worker for job in self._jobs.values()):
            await spare.end()  # all pages have gone meanwhile

    def _keep(self, work: Coroutine[None, None, None]) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _no_room(self, *, is_batch: bool) -> str:
        """Why no more can be started; "" if it can."""
        running = [job for job in self._jobs.values() if not job.over and job.is_batch is is_batch]
        if is_batch and len(running) >= self._settings.max_batches:
            return "other flights are being flown; wait until they are over, or cancel them"
        if not is_batch and len(running) >= self._settings.max_runs:
            return f"no more than {len(running)} can be under control at the same time; stop one first"
        return ""

    def _watch(self, job: _Job, request: messages.Watch, watcher: Watcher) -> None:
        job.watchers.add(watcher)
        for line in job.kept:
            watcher.put(line)
        if job.over or job.is_batch:
            _put(watcher, messages.Done(tag=request.tag))
        else:
            job.worker.send(request.model_copy(update={"tag": job.ask(watcher, request.tag)}))

    async def _follow(self, job: _Job, task: BaseModel) -> None:
        """Pass on what a worker tells until it ends, and say how it ended if it did not."""
        how = ""
        try:
            try:
                await job.worker.start()
            except OSError as error:
                how = f"it cannot be started ({error.strerror or error})"
                return
            job.worker.send(task)
            try:
                if not job.cancelled:
                    await self._pass_on(job)
            except TimeoutError:
                how = f"nothing was flown for {self._settings.silent_s:g} s"
                job.worker.kill()
            how = await job.worker.ended() or how
        finally:
            job.worker.kill()
            if job.refused:
                del self._jobs[job.name]
            elif not job.over:
                self._end(job, how)
            self._forget_old()

    async def _pass_on(self, job: _Job) -> None:
        lines = job.worker.lines()
        while True:
            async with asyncio.timeout(self._settings.silent_s if job.is_batch else None):
                line = await anext(lines, None)
            if line is None:
                return
            try:
                message = messages.FROM_WORKER.validate_json(line)
            except ValidationError:
                logger.error("a worker of the editor told %.200r", line)
                continue
            self._take(job, message)

    def _take(self, job: _Job, message: messages.FromWorker) -> None:
        match message:
            case messages.Done() | messages.Refused() | messages.Started() | messages.BatchStarted():
                watcher, tag = job.asked.pop(message.tag, (None, 0))
                if isinstance(message, messages.BatchStarted):
                    job.count = message.count
                    job.kept.append(message.model_copy(update={"tag": 0}).model_dump_json())
                if isinstance(message, messages.Refused) and not message.run:
                    job.over = job.refused = True
                if watcher is not None:
                    _put(watcher, message.model_copy(update={"tag": tag}))
            case messages.Changed():
                asker, tag = job.asked.pop(message.tag, (None, 0))
                for watcher in job.watchers:
                    _put(watcher, message.model_copy(update={"tag": tag if watcher is asker else 0}))
            case messages.Now():
                job.tell(message)
            case messages.Ended() | messages.BatchEnded():
                job.over = True
                job.tell(message, keep=True)
            case messages.Flight():
                job.flown.append(message)
                job.tell(message, keep=True)

    def _end(self, job: _Job, how: str) -> None:
        """Tell the end of a job whose process did not."""
        job.over = True
        text = "cancelled" if job.cancelled else how or "it ended without a result"
        if not job.is_batch:
            text = text if job.cancelled else f"the flight ended its process: {text}"
            ended = messages.Ended(run=job.name, text=text, lost_in="", result=None, counts={}, spans=())
            job.tell(ended, keep=True)
            return
        order = tuple(each.scenario for each in sorted(job.flown, key=lambda each: each.rank))
        completed = sum(each.completed for each in job.flown)
        job.tell(
            messages.BatchEnded(
                batch=job.name,
                flown=len(job.flown),
                completed=completed,
                count=job.count,
                text=text,
                order=order,
            ),
            keep=True,
        )

    def _end_unwatched_later(self, job: _Job) -> None:
        def end() -> None:
            if not job.watchers and not job.over:
                job.cancelled = True
                job.worker.kill()

        if not job.watchers and not job.over:
            asyncio.get_running_loop().call_later(self._settings.unwatched_s, end)

    def _forget_old(self) -> None:
        over = [name for name, job in self._jobs.items() if job.over]
        for name in over[: max(0, len(over) - _KEPT_JOBS)]:
            del self._jobs[name]


def _put(watcher: Watcher, message: BaseModel) -> None:
    watcher.put(message.model_dump_json())
