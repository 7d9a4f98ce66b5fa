"""A flight with a genuine autopilot, for many of them: no display, no files, an instance of its own."""

from __future__ import annotations

import asyncio
import fcntl
import os
import signal
import threading
from collections.abc import Coroutine, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from tempfile import gettempdir
from types import FrameType
from typing import BinaryIO, TypeVar

from errors import SettingError
from framerunner.flying.fly import FinishedFlight
from framerunner.flying.plan import FlightPlan
from framerunner.flying.real_time import RealTimeSettings, fly_in_real_time
from framerunner.flying.simulator_process import GenuineAutopilot
from framerunner.runs.recorder import RunRecords
from framerunner.runs.run_folder import RunFolder
from sitl.ardupilot import json_interface as ardupilot
from sitl.ardupilot.poses import POSE_PORT
from sitl.ardupilot.relay import RELAY_PORT
from sitl.autopilots.temporary_folder import TemporaryFolder
from sitl.px4 import link as px4
from sitl.px4.side_link import CAMERA_PORT
from sitl.server_settings import VIDEO_PORT
from wire.transports.sockets import bind_udp, listen_tcp
from wire.transports.urls import LinkError

T = TypeVar("T")

INSTANCES = 10
_TCP_PORTS = (px4.FIRST_PORT, VIDEO_PORT)
_UDP_PORTS = (14540, 14580, 18570, CAMERA_PORT)  # of the app, and PX4's own
_ARDUPILOT_UDP_PORTS = (ardupilot.FIRST_PORT, POSE_PORT, RELAY_PORT)


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


@contextmanager
def claimed_instance() -> Iterator[int]:
    """An instance whose ports are free, and which no other flight of this machine claims meanwhile.

    Raises:
        SettingError: there is none.
    """
    for instance in range(INSTANCES):
        try:
            lock = _open_lock(Path(gettempdir()) / f"framerunner-{instance}.lock")
        except OSError:  # its name is taken by something else
            continue
        with lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            if _is_free(instance):
                yield instance
                return
    raise SettingError(
        f"the ports of all {INSTANCES} instances are in use; end other simulators, or use fewer --jobs"
    )


def _open_lock(path: Path) -> BinaryIO:
    """Open a file that every user can lock, in a folder where others may have put a file or a link before.

    It is opened for reading, and made only where there is nothing, so no other file is changed.
    """
    with suppress(FileExistsError):
        made = os.open(path, os.O_RDONLY | os.O_CREAT | os.O_EXCL)
        with os.fdopen(made, "rb"):
            os.fchmod(made, 0o644)
    return os.fdopen(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb")


def _is_free(instance: int) -> bool:
    """Whether no program has one of its ports."""
    try:
        for port in _TCP_PORTS:
            listen_tcp(("127.0.0.1", port + instance)).close()
        shift = ardupilot.PORTS_AN_INSTANCE * instance
        shifted = [port + shift for port in _ARDUPILOT_UDP_PORTS]
        for port in (*(port + instance for port in _UDP_PORTS), *shifted):
            bind_udp(("127.0.0.1", port), "").close()
    except LinkError:
        return False
    return True
