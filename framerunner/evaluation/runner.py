"""Flies tasks in this process, in others, or on a cluster, and hands each row on as soon as it is there."""

from __future__ import annotations

import os
import pickle
import signal
import threading
import time
import warnings
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

from framerunner.evaluation.backends import Pool, Workers, is_lost_worker, open_pool
from framerunner.evaluation.rows import Row
from framerunner.evaluation.task import broken_off, fly_task
from framerunner.flying.plan import FlightPlan
from offboard.mission import Mission

_LOOK_UP_S = 0.5


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
