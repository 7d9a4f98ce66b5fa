"""A flight with a genuine autopilot, for many of them: no display, no files, an instance of its own."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections.abc import Coroutine
from contextlib import closing
from dataclasses import dataclass
from itertools import count
from types import FrameType
from typing import TypeVar

from framerunner.flying.fly import FinishedFlight
from framerunner.flying.plan import FlightPlan
from framerunner.flying.real_time import RealTimeSettings, fly_in_real_time
from framerunner.flying.simulator_process import GenuineAutopilot
from framerunner.instances import claimed_instance
from framerunner.runs.recorder import RunRecords
from framerunner.runs.run_folder import RunFolder
from sitl.temporary_folder import TemporaryFolder

T = TypeVar("T")


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
