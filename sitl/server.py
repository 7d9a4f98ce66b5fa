"""The simulator as a program: simulations paced by wall time, with MAVLink and video for each."""

from __future__ import annotations

import asyncio
import functools
import time
from collections.abc import Callable, Sequence

from sitl.drone import ServedDrone
from sitl.fleet import Fleet
from sitl.pacing.pacer import BURST_TICKS, LagNotices, Pacer
from sitl.pacing.time_grants import TimeGrants
from sitl.server_settings import ServerSettings
from sitl.simulation import Simulation
from sitl.truth_channel import TruthChannel
from sitl.world import CONTROL_PERIOD_US


class SimulatorServer:
    """Runs one simulation, or several side by side, in real time.

    Args:
        simulation: one or several; drone n has the ports and the system id of instance + n.
        settings: ports and speed.
        notice: called with lines for people: the addresses once all is open, that every drone can be armed
            (once), when it cannot keep up.
        grants: how far the time of a single simulation may advance; None: without a limit.
        truth: tells the first drone's true state to the program that started this one; None: nobody asks.
    """

    def __init__(
        self,
        simulation: Simulation | Sequence[Simulation],
        settings: ServerSettings,
        notice: Callable[[str], None] = lambda line: None,
        grants: TimeGrants | None = None,
        truth: TruthChannel | None = None,
    ) -> None:
        simulations = list(simulation) if isinstance(simulation, Sequence) else [simulation]
        self._settings = settings
        self._notice = notice
        self._grants = grants
        self._truth = truth
        boot_unix_us = int(time.time() * 1e6)
        self._drones = [
            ServedDrone(flown, settings.shifted(number), boot_unix_us, notice, grants)
            for number, flown in enumerate(simulations)
        ]
        self._fleet = Fleet([flown.world for flown in simulations], notice)

    async def run(self) -> None:
        """Open the links, then run until cancelled; video starts right after the first packets.

        With grants it starts before: their program gets every image, as in lockstep.

        Raises:
            LinkError: a link cannot be opened.
            VideoError: a port of the video is taken.
        """
        video_task: asyncio.Task[None] | None = None
        try:
            for drone in self._drones:
                await drone.open_links()
            for drone in self._drones:
                await asyncio.to_thread(drone.simulation.autopilot.prepare)
            video_task = asyncio.create_task(self._open_video())
            if self._grants is not None:
                await asyncio.wait({video_task})
            await self._run_paced(video_task)
        finally:
            if video_task is not None:
                video_task.cancel()
                await asyncio.gather(video_task, return_exceptions=True)
            for channel in (self._grants, self._truth):
                if channel is not None:
                    await channel.close()
            for drone in self._drones:
                await drone.close()

    async def _open_video(self) -> None:
        for number, drone in enumerate(self._drones):
            await drone.open_video(functools.partial(self._fleet.others, number))
        if self._settings.is_open:
            self._notice("other machines can command the drone: MAVLink is unsigned; see --signing-key")
        for drone in self._drones:
            self._notice(f"{drone.greeting()} (Ctrl-C stops)")
        if self._grants is not None:
            await self._grants.open()
        if self._truth is not None:
            simulation = self._drones[0].simulation
            await self._truth.open(lambda: simulation.truth)

    async def _run_paced(self, video_task: asyncio.Task[None]) -> None:
        drones, fleet = self._drones, self._fleet
        simulation = drones[0].simulation
        pacer = Pacer(self._settings.speed, time.monotonic(), simulation.time_us)
        notices = LagNotices(self._notice, self._settings.speed)
        ready = False
        while True:
            if video_task.done():
                video_task.result()  # a busy port ends the simulator
            target_us = pacer.target_us(time.monotonic())
            for _ in range(BURST_TICKS):
                if simulation.time_us + CONTROL_PERIOD_US > target_us or drones[0].holds:
                    break
                for drone in drones:
                    drone.tick()
                fleet.tick()
            now_s = time.monotonic()
            lost_s = pacer.give_up_lag(now_s, simulation.time_us)
            if video_task.done():  # until then much is loaded
                notices.lag(lost_s, now_s)
                if not ready and all(drone.simulation.autopilot.status.ready for drone in drones):
                    ready = True
                    self._notice("Ready for takeoff!")  # PX4's words, for which scripts wait
            if drones[0].holds:
                await drones[0].hold()
                continue
            await asyncio.sleep(pacer.wait_s(now_s, simulation.time_us + CONTROL_PERIOD_US))
