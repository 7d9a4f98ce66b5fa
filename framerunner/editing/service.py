"""The flights and batches that browsers started: their worker processes, limits and watchers."""

from __future__ import annotations

import asyncio
import logging
import os
import secrets
import time
from collections import OrderedDict
from collections.abc import Coroutine
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from pydantic import BaseModel, ValidationError

from framerunner.editing import editor_messages
from framerunner.editing.live import LiveFlight, LiveSettings
from framerunner.editing.session_runs import forget_old
from framerunner.editing.waiting_queue import WaitingQueue
from framerunner.editing.words import Said
from framerunner.editing.workers import FlightProcess, WorkerPool
from offboard.chart.mission_texts import Language

_MAX_OWN_RUNS = 4  # flights under control of one page
_MAX_WAITING = 300
_SPARE_S = 2.0  # after a start, until a worker is made ready for the next one
_KEPT_JOBS = 8  # that are over, for pages that are opened again
_MAX_KEPT_LINES = editor_messages.MAX_COUNT + 10
logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class EditingSettings:
    """Limits of what browsers may start.

    Attributes:
        pilot: a contestant's Python file, which workers execute, or a pilot's name; None: missions use
            `Pilot` itself.
        keep: folder for the run folders of flights, for replays; None: they are not kept.
        max_runs: flights under control at the same time; more wait.
        max_batches: batches at the same time; more wait.
        batch_s: that a batch is expected to take before any has ended.
        jobs: flights of a batch at the same time.
        processor_s: processor time of one flight.
        memory_bytes: of each process, beyond that of the libraries.
        silent_s: after which a batch that told nothing is ended.
        unwatched_s: after which a flight or batch that nobody watches is ended.
        live: how flights in the real simulator are flown; None: there are none.
    """

    pilot: str | None = None
    keep: Path | None = None
    max_runs: int = 8
    max_batches: int = 1
    batch_s: float = 60.0
    jobs: int = field(default_factory=lambda: max(1, (os.cpu_count() or 2) - 1))
    processor_s: float = 60.0
    memory_bytes: int = 512 << 20
    silent_s: float = 300.0
    unwatched_s: float = 30.0
    live: LiveSettings | None = None


class Watcher(Protocol):
    """A browser's connection; `language` is that of its page."""

    language: Language

    def put(self, line: str) -> None:
        """Queue a message, JSON."""


class _Job:
    """A flight or a batch with its process.

    Attributes:
        kept: lines for those who watch later: a flight's end, or all of a batch.
        over: it has told its end.
        refused: it was not even started.
    """

    def __init__(self, name: str, *, is_batch: bool, language: Language) -> None:
        self.name = name
        self.language = language  # of who started it
        self.worker = FlightProcess()  # never started, until one is taken
        self.is_batch = is_batch
        self.task: BaseModel | None = None
        self.watchers: set[Watcher] = set()
        self.asked: dict[int, tuple[Watcher, int]] = {}
        self.kept: list[str] = []
        self.flown: list[editor_messages.Flight] = []
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
        self._workers = WorkerPool(settings.max_batches, self._keep)
        self._queues = {
            True: WaitingQueue[_Job](settings.max_batches, settings.batch_s, time.monotonic),
            False: WaitingQueue[_Job](settings.max_runs, None, time.monotonic),
        }  # of batches, and of flights under control
        self._closed = False
        self._live = None if settings.live is None else LiveFlight(settings.live, self._tell_pages)

    def enter(self, watcher: Watcher) -> None:
        """Note a watcher that connected; a worker is made ready for it, as that takes a second."""
        self._pages.add(watcher)
        if self._live is not None and self._live.latest is not None:
            _put(watcher, self._live.latest)
        self._prepare()

    async def do(self, request: editor_messages.Request, watcher: Watcher) -> None:
        """Carry out a request; its answer is put to the watcher."""
        if isinstance(request, editor_messages.Start | editor_messages.StartBatch):
            await self._start(request, watcher)
            return
        if isinstance(request, editor_messages.StartLive | editor_messages.StopLive):
            await self._do_live(request, watcher)
            return
        name = request.batch if isinstance(request, editor_messages.Cancel) else request.run
        job = self._jobs.get(name)
        if job is None:
            _refuse(watcher, request.tag, Said("flight.unknown", name=name))
        elif isinstance(request, editor_messages.Watch):
            self._watch(job, request, watcher)
        elif isinstance(request, editor_messages.Cancel) or (
            isinstance(request, editor_messages.Stop) and job in self._queues[job.is_batch]
        ):
            _put(watcher, editor_messages.Done(tag=request.tag))
            self._cancel(job)
        elif job.over or job.is_batch:
            why = Said("flight.is_batch" if job.is_batch else "flight.over")
            _refuse(watcher, request.tag, why, run=name)
        elif job in self._queues[job.is_batch]:
            _refuse(watcher, request.tag, Said("flight.waits"), run=name)
        else:
            job.worker.send(request.model_copy(update={"tag": job.ask(watcher, request.tag)}))

    def leave(self, watcher: Watcher) -> None:
        """Forget a watcher that disconnected; what nobody watches any more is ended after a while."""
        self._pages.discard(watcher)
        if not self._pages:
            self._workers.end_spare()
        for job in self._jobs.values():
            if watcher in job.watchers:
                job.watchers.discard(watcher)
                self._end_unwatched_later(job)

    async def close(self) -> None:
        """End everything."""
        self._closed = True
        self._workers.close()
        for job in list(self._jobs.values()):
            self._cancel(job)
        if self._live is not None:
            await self._live.close()
        while self._tasks:  # they may begin others, to end a worker
            await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _do_live(
        self, request: editor_messages.StartLive | editor_messages.StopLive, watcher: Watcher
    ) -> None:
        if self._live is None:
            _refuse(watcher, request.tag, Said("live.none_here"))
            return
        refusal: Said | None
        if isinstance(request, editor_messages.StartLive):
            refusal = await self._live.start(request)
        else:
            refusal = None if self._live.stop() else Said("live.none")
        if refusal is None:
            _put(watcher, editor_messages.Done(tag=request.tag))
        else:
            _refuse(watcher, request.tag, refusal)

    def _tell_pages(self, message: BaseModel) -> None:
        line = message.model_dump_json()
        for page in self._pages:
            page.put(line)

    async def _start(
        self, request: editor_messages.Start | editor_messages.StartBatch, watcher: Watcher
    ) -> None:
        is_batch = isinstance(request, editor_messages.StartBatch)
        refusal = self._no_room(watcher, is_batch=is_batch)
        if refusal is not None:
            _refuse(watcher, request.tag, refusal)
            return
        name = secrets.token_urlsafe(9)
        settings = self._settings
        common = {
            "pilot": settings.pilot,
            "keep": None if settings.keep is None else str(settings.keep),
            "processor_s": settings.processor_s,
            "memory_bytes": settings.memory_bytes,
        }
        task: editor_messages.RunTask | editor_messages.BatchTask
        start = request.model_copy(update={"tag": 1})  # the job's first
        if isinstance(start, editor_messages.StartBatch):
            task = editor_messages.BatchTask.model_validate(
                {**common, "batch": name, "start": start, "jobs": settings.jobs}
            )
        else:
            task = editor_messages.RunTask.model_validate({**common, "run": name, "start": start})
        job = self._jobs[name] = _Job(name, is_batch=is_batch, language=request.language)
        job.task = task
        job.watchers.add(watcher)
        job.ask(watcher, request.tag)
        self._queues[is_batch].enter(job)
        self._advance(is_batch=is_batch)

    def _advance(self, *, is_batch: bool) -> None:
        """Begin what need not wait any more, and tell the others how long they have to."""
        queue = self._queues[is_batch]
        for job in () if self._closed else queue.begin():
            job.worker = self._workers.take()
            self._keep(self._follow(job))
            asyncio.get_running_loop().call_later(_SPARE_S, self._prepare)
        for job, place, seconds in queue.waiting():
            for watcher, tag in job.asked.values():
                _put(watcher, editor_messages.Waiting(tag=tag, run=job.name, place=place, seconds=seconds))

    def _cancel(self, job: _Job) -> None:
        """End a job, or take it out of its queue."""
        job.cancelled = True
        if job not in self._queues[job.is_batch]:
            job.worker.kill()
            return
        for watcher, tag in job.asked.values():
            _refuse(watcher, tag, Said("flight.cancelled"))
        job.over = True
        del self._jobs[job.name]
        self._queues[job.is_batch].leave(job)
        self._advance(is_batch=job.is_batch)

    def _prepare(self) -> None:
        """Start a worker for the next task, unless there is one or nobody is connected."""
        if self._pages:
            self._workers.prepare()

    def _keep(self, work: Coroutine[None, None, None]) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _no_room(self, watcher: Watcher, *, is_batch: bool) -> Said | None:
        """Why no more can be started; None if it can. A page has one batch: it does not fill the queue."""
        own = [job for job in self._jobs.values() if not job.over and watcher in job.watchers]
        if is_batch and any(job.is_batch for job in own):
            return Said("flight.yours")
        if not is_batch and len(own) >= _MAX_OWN_RUNS:
            return Said("flight.too_many", count=_MAX_OWN_RUNS)
        waiting = len(self._queues[is_batch])
        return Said("flight.full", count=waiting) if waiting >= _MAX_WAITING else None

    def _watch(self, job: _Job, request: editor_messages.Watch, watcher: Watcher) -> None:
        job.watchers.add(watcher)
        for line in job.kept:
            watcher.put(line)
        if job.over or job.is_batch:
            _put(watcher, editor_messages.Done(tag=request.tag))
        else:
            job.worker.send(request.model_copy(update={"tag": job.ask(watcher, request.tag)}))

    async def _follow(self, job: _Job) -> None:
        """Pass on what a worker tells until it ends, and say how it ended if it did not."""
        how: Said | None = None
        is_ready = False
        assert job.task is not None
        try:
            try:
                await job.worker.start()
            except OSError as error:
                how = Said("flight.not_started", reason=error.strerror or error)
                return
            job.worker.send(job.task)
            try:
                if not job.cancelled:
                    is_ready = await self._pass_on(job)
            except TimeoutError:
                how = Said("flight.silent", seconds=self._settings.silent_s)
                job.worker.kill()
            if is_ready:
                worker, job.worker = job.worker, FlightProcess()  # the next one's, from now on
                self._workers.give_back(worker)
            else:
                how = await job.worker.ended() or how
        finally:
            if not is_ready:
                job.worker.kill()
            self._queues[job.is_batch].leave(job, counts=not (job.refused or job.cancelled))
            if self._settings.keep is not None:
                await asyncio.to_thread(forget_old, self._settings.keep)
            if job.refused:
                del self._jobs[job.name]
            elif not job.over:
                self._end(job, how)
            self._forget_old()
            self._advance(is_batch=job.is_batch)

    async def _pass_on(self, job: _Job) -> bool:
        """Pass on until the worker has ended; True: until it can take another batch."""
        lines = job.worker.lines()
        while True:
            async with asyncio.timeout(self._settings.silent_s if job.is_batch else None):
                line = await anext(lines, None)
            if line is None:
                return False
            try:
                message = editor_messages.FROM_WORKER.validate_json(line)
            except ValidationError:
                logger.error("a worker of the editor told %.200r", line)
                continue
            if isinstance(message, editor_messages.Ready):
                return True
            self._take(job, message)

    def _take(self, job: _Job, message: editor_messages.FromWorker) -> None:
        match message:
            case (
                editor_messages.Done()
                | editor_messages.Refused()
                | editor_messages.Started()
                | editor_messages.BatchStarted()
            ):
                watcher, tag = job.asked.pop(message.tag, (None, 0))
                if isinstance(message, editor_messages.BatchStarted):
                    job.count = message.count
                    job.kept.append(message.model_copy(update={"tag": 0}).model_dump_json())
                if isinstance(message, editor_messages.Refused) and not message.run:
                    job.over = job.refused = True
                if watcher is not None:
                    _put(watcher, message.model_copy(update={"tag": tag}))
            case editor_messages.Changed():
                asker, tag = job.asked.pop(message.tag, (None, 0))
                for watcher in job.watchers:
                    _put(watcher, message.model_copy(update={"tag": tag if watcher is asker else 0}))
            case editor_messages.Now():
                job.tell(message)
            case editor_messages.Ended() | editor_messages.BatchEnded():
                job.over = True
                job.tell(message, keep=True)
            case editor_messages.Flight():
                job.flown.append(message)
                job.tell(message, keep=True)

    def _end(self, job: _Job, how: Said | None) -> None:
        """Tell the end of a job whose process did not."""
        job.over = True
        why = Said("flight.cancelled") if job.cancelled else how or Said("flight.no_result")
        if not job.is_batch and not job.cancelled:
            why = Said("flight.ended_process", how=why)
        text = why.text(job.language)
        if not job.is_batch:
            ended = editor_messages.Ended(
                run=job.name, text=text, lost_in="", result=None, counts={}, spans=()
            )
            job.tell(ended, keep=True)
            return
        order = tuple(each.scenario for each in sorted(job.flown, key=lambda each: each.rank))
        completed = sum(each.completed for each in job.flown)
        job.tell(
            editor_messages.BatchEnded(
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
                self._cancel(job)

        if not job.watchers and not job.over:
            asyncio.get_running_loop().call_later(self._settings.unwatched_s, end)

    def _forget_old(self) -> None:
        over = [name for name, job in self._jobs.items() if job.over]
        for name in over[: max(0, len(over) - _KEPT_JOBS)]:
            del self._jobs[name]


def _refuse(watcher: Watcher, tag: int, why: Said, *, run: str = "") -> None:
    _put(watcher, editor_messages.Refused(tag=tag, text=why.text(watcher.language), run=run))


def _put(watcher: Watcher, message: BaseModel) -> None:
    watcher.put(message.model_dump_json())
