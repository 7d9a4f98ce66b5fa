"""Flies plans in this process, in others or on a cluster, and yields each row as its flight ends."""

from __future__ import annotations

import asyncio
import gc
import os
import pickle
import signal
import threading
import time
import traceback
import warnings
from collections.abc import Coroutine, Generator, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import metadata
from itertools import count
from multiprocessing import get_context
from multiprocessing.connection import Connection
from types import FrameType
from typing import Any, TypeVar

from framerunner.evaluation.backends import Pool, Workers, is_lost_worker, open_pool
from framerunner.evaluation.rows import EvaluationRow
from framerunner.flying.fly import FinishedFlight
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from framerunner.flying.real_time import RealTimeSettings, fly_in_real_time
from framerunner.flying.simulator_process import GenuineAutopilot
from framerunner.instances import claimed_instance
from framerunner.runs.recorder import RunRecords
from framerunner.runs.run_folder import RunFolder
from framerunner.runs.track import ChartRecord, Track
from offboard.mission import Mission
from scenarios.result import TimedPosition
from scenarios.verdict import Verdict
from sitl.temporary_folder import TemporaryFolder

T = TypeVar("T")

_PARENT_CHECK_S = 0.5
_AGAIN_S = 2.0  # processor time after which a flight that goes on is ended once more
TRACK_STEP_S = 0.2
"""Between two samples that are kept for a plot."""
_ONE_AT_A_TIME = threading.Lock()
"""A cluster's worker may have several threads, and JSBSim is not documented to be thread-safe."""


class WorkerDiedError(Exception):
    """The process of a flight ended before the flight, by its own code or from outside."""


class FlightTooLongError(Exception):
    """A flight used too much processor time."""


@dataclass(frozen=True, slots=True)
class Terms:
    """What a flight may use, and what is kept of it.

    Attributes:
        processor_s: processor time; a flight that uses more ends, mostly in its mission, with the reason.
            None: no limit. It holds in a process's main thread only.
        whole: keep of every flight the track and the counts of transitions, not only tracks of failed ones.
        genuine: the genuine autopilot that flies, over MAVLink; None: our own, in lockstep. With it counts of
            transitions are not kept.
    """

    processor_s: float | None = None
    whole: bool = False
    genuine: GenuineUse | None = None


NO_LIMITS = Terms()


@dataclass(frozen=True, slots=True)
class _Task:
    """A flight as it is sent to a worker, some 20 kB, by the process `sender`.

    The mission is taken out of the plan, pickled once for all flights, and unpickled once in each process.
    """

    plan: FlightPlan
    mission: bytes
    sender: int
    terms: Terms


def fly_all(
    tasks: Iterable[FlightPlan], pool: Pool, terms: Terms = NO_LIMITS
) -> Generator[EvaluationRow, None, None]:
    """Fly all plans.

    Only a few are taken from `tasks` at a time, and nothing is kept of those that have ended. If a worker
    dies, every flight that was running is flown once more, each in its own process; one that ends its process
    again gets the verdict "error".

    Args:
        tasks: plans; their scenarios have different names.
        pool: where they are flown.
        terms: of each flight.

    Yields:
        Rows as the flights end, in any order.

    Raises:
        SettingError: see `open_pool`.
    """
    if pool.backend == "loky" and pool.jobs == 1:  # no other process is needed
        _prepare_process()
        for task in tasks:
            yield fly_task(task, terms)
        return
    waiting = iter(tasks)
    with open_pool(pool) as workers:
        while True:
            running: dict[str, FlightPlan] = {}
            try:
                yield from _fly_in_pool(waiting, workers, running, terms)
            except Exception as error:
                if not is_lost_worker(error):
                    raise
            else:
                return
            yield from (fly_alone(task, terms) for task in list(running.values()))


def _fly_in_pool(
    waiting: Iterator[FlightPlan], workers: Workers, running: dict[str, FlightPlan], terms: Terms
) -> Iterator[EvaluationRow]:
    """Fly in the pool; `running` gets the plans that were sent and whose rows have not been received."""
    from joblib import delayed

    packer = _Packer(terms)

    def calls() -> Iterator[Any]:
        for plan in waiting:
            running[plan.scenario.name] = plan
            yield delayed(_fly_in_worker)(packer.task(plan))

    with _sigint_blocked():
        rows = workers(calls())
    try:
        for row in rows:
            del running[row.scenario]
            yield row
    finally:
        with warnings.catch_warnings():  # joblib warns that it stops running flights, which is intended
            warnings.simplefilter("ignore")
            rows.close()


class _Packer:
    """Makes tasks of plans; pickles a mission once."""

    def __init__(self, terms: Terms) -> None:
        self._terms = terms
        self._mission: Mission | None = None
        self._packed = b""

    def task(self, plan: FlightPlan) -> _Task:
        if plan.mission is not self._mission:
            self._mission, self._packed = plan.mission, pickle.dumps(plan.mission)
        return _Task(replace(plan, mission=None), self._packed, os.getpid(), self._terms)


def fly_alone(plan: FlightPlan, terms: Terms = NO_LIMITS) -> EvaluationRow:
    """Fly in a new process, which may die."""
    context = get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send_flight, args=(_Packer(terms).task(plan), sender), daemon=True)
    with _sigint_blocked():
        process.start()
    sender.close()
    try:
        row: EvaluationRow = receiver.recv()
    except EOFError:
        process.join()
        ending = _ending(process.exitcode)
        row = _error_row(plan, WorkerDiedError(f"the flight ended its process ({ending})"))
    finally:
        process.kill()
        process.join()
        receiver.close()
    return row


def _ending(exit_code: int | None) -> str:
    if exit_code is not None and exit_code < 0:
        return f"signal {signal.Signals(-exit_code).name}"
    return f"exit code {exit_code}"


def _send_flight(task: _Task, sender: Connection) -> None:
    row = _fly_in_worker(task)
    with suppress(BrokenPipeError):  # the receiver has gone
        sender.send(row)


def _fly_in_worker(task: _Task) -> EvaluationRow:
    _prepare_process()
    if os.getppid() == task.sender:
        _end_with(task.sender)
    return fly_task(replace(task.plan, mission=_unpack(task.mission)), task.terms)


@lru_cache(maxsize=1)
def _unpack(mission: bytes) -> Mission:
    """The mission, cached because its chart takes a while to build; a flight leaves nothing in it."""
    unpacked = pickle.loads(mission)  # from `_Packer`
    assert isinstance(unpacked, Mission)
    return unpacked


@lru_cache(maxsize=1)
def _prepare_process() -> None:
    """Use one core for one flight: images and matrices are too small for several threads."""
    import cv2

    cv2.setNumThreads(1)


@lru_cache(maxsize=1)
def _keep_imports() -> None:
    """Leave what the first flight has imported out of garbage collections, which take 1 % of the time."""
    gc.collect()
    gc.freeze()


@lru_cache(maxsize=1)
def _end_with(parent: int) -> None:
    """End this process when its parent has ended, for whatever reason."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_PARENT_CHECK_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _sigint_blocked() -> Iterator[None]:
    """Processes started within never get SIGINT; this one gets it afterwards, and ends them.

    A terminal sends SIGINT to all processes, and a child inherits whether it is blocked.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def processor_limit(limit_s: float | None) -> Iterator[None]:
    """Raise `FlightTooLongError` within when this process has used so much processor time; None: never.

    It is raised again and again, in case something catches it. Only a process's main thread has a limit.
    """
    if limit_s is None or threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(_signal: int, _frame: object) -> None:
        raise FlightTooLongError(f"more than {limit_s:g} s of processor time; its mission computes too much")

    before = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, limit_s, _AGAIN_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def fly_task(plan: FlightPlan, terms: Terms = NO_LIMITS) -> EvaluationRow:
    """Fly a plan with a mission.

    Args:
        plan: what is flown.
        terms: what it may use, and what is kept.

    Returns:
        The flight's row; with the verdict "error" and a traceback if the program failed.

    Raises:
        KeyboardInterrupt: Ctrl-C was pressed.
    """
    chart = ChartRecord() if terms.whole else None
    try:
        with _ONE_AT_A_TIME, processor_limit(terms.processor_s):
            if terms.genuine is not None:
                flown = fly_with_genuine(plan, terms.genuine)
            else:
                flown = fly_lockstep(plan, observers=() if chart is None else (chart.see,))
        if flown.outcome.interrupted:
            raise KeyboardInterrupt
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # a contestant's code may raise anything, SystemExit too
        return _error_row(plan, error)
    _keep_imports()
    has_track = terms.whole or flown.result.verdict is not Verdict.CLEAN
    track = thinned(flown.track) if has_track else None
    return EvaluationRow(
        **dict(flown.result), track=track, transitions={} if chart is None else dict(chart.counts)
    )


def _error_row(plan: FlightPlan, error: BaseException) -> EvaluationRow:
    """The row of a flight that a fault of the program ended."""
    text = " ".join(str(error).split())
    kind = type(error).__name__
    return EvaluationRow(
        scenario=plan.scenario.name,
        mission="" if plan.mission is None else plan.mission.name,
        mission_class="contest" if plan.mission is None else plan.mission.mission_class,
        seed=plan.seed,
        response="" if plan.response is None else str(plan.response),
        verdict=Verdict.ERROR,
        reason=f"{kind}: {text}" if text else kind,
        ended="error",
        version=metadata.version("framerunner"),
        traceback="".join(traceback.format_exception(error)),
    )


def thinned(track: Track, step_s: float = TRACK_STEP_S) -> Track:
    """Keep the samples that a plot needs: both ends, changes of state, and one every `step_s`.

    Times are rounded to milliseconds and positions to millimetres.
    """
    states, times = track.mission_state, track.time_s
    kept: list[int] = []
    for index in range(len(track)):
        is_edge = index in (0, len(track) - 1) or states[index] != states[index - 1]
        if is_edge or times[index] - times[kept[-1]] >= step_s - 1e-6:
            kept.append(index)
    columns = ([round(column[index], 3) for index in kept] for column in (times, track.x, track.y, track.z))
    time_s, x, y, z = columns
    true_path, estimated = (_thinned_path(path, step_s) for path in (track.true_path, track.estimated_path))
    return Track(time_s, x, y, z, [states[index] for index in kept], track.estimates, true_path, estimated)


def _thinned_path(path: Sequence[TimedPosition], step_s: float) -> list[TimedPosition]:
    kept: list[TimedPosition] = []
    for sample in path:
        if not kept or sample[0] - kept[-1][0] >= step_s - 1e-6:
            time_s, x, y, z = (round(value, 3) for value in sample)
            kept.append((time_s, x, y, z))
    return kept


@dataclass(frozen=True, slots=True)
class GenuineUse:
    """By which flights with a genuine autopilot are flown.

    Attributes:
        autopilot: that flies, and where it was built.
        speed: simulated seconds a second, if the machine can.
    """

    autopilot: GenuineAutopilot
    speed: float


def fly_with_genuine(plan: FlightPlan, use: GenuineUse) -> FinishedFlight:
    """Fly a plan with an autopilot and a simulator that are started for it and end with it.

    Raises:
        DroneError: the drone does not get ready.
        SettingError: simulator or autopilot cannot be started, or have ended.
        ValueError: the plan has no mission.
    """
    with claimed_instance() as instance, closing(TemporaryFolder("framerunner-flight-")) as out:
        folder = RunFolder(out.path, plan.scenario.name)
        folder.write_plan(plan.scenario, plan.chart)
        settings = RealTimeSettings(
            speed=use.speed, instance=instance, autopilot=use.autopilot, unattended=True
        )
        return asyncio.run(interrupted_once(fly_in_real_time(plan, settings, RunRecords(folder, None), None)))


async def interrupted_once(work: Coroutine[object, object, T]) -> T:
    """Do some work of `asyncio.run`, which ends in order at Ctrl-C, also if it is pressed again meanwhile."""
    if threading.current_thread() is not threading.main_thread():  # no signals come here
        return await work
    before = signal.getsignal(signal.SIGINT)  # asyncio's, which cancels only once
    interrupts = count()

    def interrupt(number: int, frame: FrameType | None) -> None:
        if next(interrupts) == 0 and callable(before):
            before(number, frame)

    signal.signal(signal.SIGINT, interrupt)
    try:
        return await work
    finally:
        signal.signal(signal.SIGINT, before)
