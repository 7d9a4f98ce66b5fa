"""Flies plans in this process, in others, or on a cluster, and hands each row on as soon as it is there."""

from __future__ import annotations

import os
import pickle
import signal
import threading
import time
import traceback
import warnings
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import metadata
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

from framerunner.evaluation.backends import Pool, Workers, is_lost_worker, open_pool
from framerunner.evaluation.rows import Row
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from framerunner.runs.track import Track
from offboard.mission import Mission
from scenarios.verdict import Verdict

_LOOK_UP_S = 0.5
TRACK_STEP_S = 0.2
"""Between two samples that are kept for a picture."""
_ONE_AT_A_TIME = threading.Lock()
"""A cluster's worker may have several threads; JSBSim promises nothing about being used by two of them."""


class WorkerDiedError(Exception):
    """The process that flew was ended, by its own code or from outside."""


@dataclass(frozen=True, slots=True)
class Parcel:
    """A flight on its way to who flies it: some 20 kB.

    Attributes:
        plan: without its mission.
        mission: packed once for all, and unpacked once in each process.
        sender: process id of who sent it.
    """

    plan: FlightPlan
    mission: bytes
    sender: int


def fly_all(tasks: Iterable[FlightPlan], pool: Pool) -> Generator[Row, None, None]:
    """Fly all tasks.

    No more than a few are under way at a time, and nothing is kept here of those that are over. If a
    worker dies, every flight that was under way is flown once more, each in a process of its own; the one
    that ends its process again has the verdict "error".

    Args:
        tasks: flights; their scenarios have different names.
        pool: who flies.

    Yields:
        Rows as the flights end, in any order.

    Raises:
        SettingError: the pool cannot be had.
    """
    if pool.in_process:
        _prepare_process()
        yield from map(fly_task, tasks)
        return
    waiting = iter(tasks)
    with open_pool(pool) as workers:
        while True:
            under_way: dict[str, FlightPlan] = {}
            try:
                yield from _fly_together(waiting, workers, under_way)
            except Exception as error:
                if not is_lost_worker(error):
                    raise
            else:
                return
            yield from (fly_alone(task) for task in list(under_way.values()))


def _fly_together(
    waiting: Iterator[FlightPlan], workers: Workers, under_way: dict[str, FlightPlan]
) -> Iterator[Row]:
    """Fly in the pool; `under_way` has what has been handed out and has not come back."""
    from joblib import delayed

    packed = _Packer()

    def parcels() -> Iterator[Any]:
        for task in waiting:
            under_way[task.scenario.name] = task
            yield delayed(_fly_parcel)(packed.parcel(task))

    with _hidden_from_ctrl_c():
        rows = workers(parcels())
    try:
        for row in rows:
            del under_way[row.scenario]
            yield row
    finally:
        with warnings.catch_warnings():  # that flights are broken off is what is wanted
            warnings.simplefilter("ignore")
            rows.close()


class _Packer:
    """Packs missions; the same one again without work."""

    def __init__(self) -> None:
        self._mission: Mission | None = None
        self._packed = b""

    def parcel(self, task: FlightPlan) -> Parcel:
        """Make a task ready to be sent."""
        if task.mission is not self._mission:
            self._mission, self._packed = task.mission, pickle.dumps(task.mission)
        return Parcel(replace(task, mission=None), self._packed, os.getpid())


def fly_alone(task: FlightPlan) -> Row:
    """Fly in a process of its own, which may die."""
    context = get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send_flight, args=(_Packer().parcel(task), sender), daemon=True)
    with _hidden_from_ctrl_c():
        process.start()
    sender.close()
    try:
        row: Row = receiver.recv()
    except EOFError:
        process.join()
        row = broken_off(task, WorkerDiedError(f"the flight ended its process ({_ending(process.exitcode)})"))
    finally:
        process.kill()
        process.join()
        receiver.close()
    return row


def _ending(exit_code: int | None) -> str:
    if exit_code is not None and exit_code < 0:
        return f"signal {signal.Signals(-exit_code).name}"
    return f"exit code {exit_code}"


def _send_flight(parcel: Parcel, sender: Connection) -> None:
    row = _fly_parcel(parcel)
    try:
        sender.send(row)
    except BrokenPipeError:
        return  # nobody waits for it any more


def _fly_parcel(parcel: Parcel) -> Row:
    """Fly in a worker."""
    _prepare_process()
    if os.getppid() == parcel.sender:
        _end_with(parcel.sender)
    return fly_task(replace(parcel.plan, mission=_unpack(parcel.mission)))


@lru_cache(maxsize=1)
def _unpack(mission: bytes) -> Mission:
    """The mission with its chart, which takes a while to build; it keeps nothing of a flight."""
    unpacked = pickle.loads(mission)  # what `_Packer` has packed
    assert isinstance(unpacked, Mission)
    return unpacked


@lru_cache(maxsize=1)
def _prepare_process() -> None:
    """One flight, one core: images and matrices are too small to share among threads."""
    import cv2

    cv2.setNumThreads(1)


@lru_cache(maxsize=1)
def _end_with(parent: int) -> None:
    """See to it that this process does not outlive the one that started it, however that ends."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK_UP_S)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _hidden_from_ctrl_c() -> Iterator[None]:
    """Processes started within do not hear of Ctrl-C; this one hears of it afterwards, and ends them.

    A terminal sends the signal to all of them; whether it is blocked, a child inherits.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def fly_task(plan: FlightPlan) -> Row:
    """Fly, and tell of it, whatever happens.

    Args:
        plan: what to fly; with a mission.

    Returns:
        The flight's row; with the verdict "error" and a traceback if the program failed.

    Raises:
        KeyboardInterrupt: somebody pressed Ctrl-C.
    """
    try:
        with _ONE_AT_A_TIME:
            flown = fly_lockstep(plan)
        if flown.outcome.interrupted:
            raise KeyboardInterrupt
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # a contestant's code may raise anything, SystemExit too
        return broken_off(plan, error)
    track = None if flown.result.completed else thinned(flown.track)
    return Row(**dict(flown.result), track=track)


def broken_off(plan: FlightPlan, error: BaseException) -> Row:
    """The row of a flight that a fault of the program ended."""
    text = " ".join(str(error).split())
    kind = type(error).__name__
    return Row(
        scenario=plan.scenario.name,
        mission="" if plan.mission is None else plan.mission.name,
        seed=plan.seed,
        verdict=Verdict.ERROR,
        reason=f"{kind}: {text}" if text else kind,
        ended="error",
        version=metadata.version("framerunner"),
        traceback="".join(traceback.format_exception(error)),
    )


def thinned(track: Track, step_s: float = TRACK_STEP_S) -> Track:
    """Leave out what a picture does not need; changes of state stay where they are.

    Args:
        track: as recorded.
        step_s: between two samples that stay.

    Returns:
        Rounded to milliseconds and millimetres.
    """
    states, times = track.mission_state, track.time_s
    kept: list[int] = []
    for index in range(len(track)):
        is_edge = index in (0, len(track) - 1) or states[index] != states[index - 1]
        if is_edge or times[index] - times[kept[-1]] >= step_s - 1e-6:
            kept.append(index)
    columns = ([round(column[index], 3) for index in kept] for column in (times, track.x, track.y, track.z))
    time_s, x, y, z = columns
    return Track(time_s, x, y, z, [states[index] for index in kept])
