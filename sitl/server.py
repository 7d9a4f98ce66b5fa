"""The simulator as a program: simulations paced by wall time, with MAVLink and video for each."""

from __future__ import annotations

import asyncio
import functools
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from sitl.server_settings import ServerSettings
from sitl.time_grants import FREE_US, TimeGrants
from sitl.world import CONTROL_PERIOD_US

if TYPE_CHECKING:
    from sitl.simulation import Simulation

BURST_TICKS = 5  # at most 0.02 s of simulated time before links and video are served
_MAX_CAUGHT_UP_S = 0.05  # shorter delays are caught up; longer ones slow simulated time down
_NOTICE_PERIOD_S = 5.0


class Pacer:
    """The simulated time that should have been reached: the only place where it meets wall time.

    It is a linear function of wall time, so it never drifts. When the machine cannot keep up, the line is
    moved: simulated time passes more slowly and no step is skipped.

    Args:
        speed: simulated seconds a wall second.
        now_s: monotonic wall time, seconds.
        time_us: simulated time now, microseconds.
    """

    def __init__(self, speed: float, now_s: float, time_us: int = 0) -> None:
        if not 0.01 <= speed <= 1000:
            raise ValueError(f"speed {speed:g}: must be from 0.01 to 1000")
        self._speed = speed
        self._wall_s = now_s
        self._time_us = time_us

    def target_us(self, now_s: float) -> int:
        """The simulated time that should have been reached at a wall time."""
        return self._time_us + round((now_s - self._wall_s) * self._speed * 1e6)

    def wait_s(self, now_s: float, time_us: int) -> float:
        """Wall seconds until a simulated time is due; zero if it is."""
        return max(0.0, (time_us - self.target_us(now_s)) / 1e6 / self._speed)

    def give_up_lag(self, now_s: float, time_us: int) -> float:
        """Move the line if simulated time is too far behind to catch up; return the wall seconds given up."""
        lag_s = (self.target_us(now_s) - time_us) / 1e6 / self._speed
        if lag_s <= _MAX_CAUGHT_UP_S:
            return 0.0
        self._wall_s += lag_s
        return lag_s


class SimulatorServer:
    """Runs one simulation, or several side by side, in real time.

    Args:
        simulation: one or several; drone n has the ports and the system id of instance + n.
        settings: ports and speed.
        notice: called with lines for people: the addresses once all is open, when it cannot keep up.
        grants: how far the time of a single simulation may advance; None: without a limit.
    """

    def __init__(
        self,
        simulation: Simulation | Sequence[Simulation],
        settings: ServerSettings,
        notice: Callable[[str], None] = lambda line: None,
        grants: TimeGrants | None = None,
    ) -> None:
        from sitl.drone import ServedDrone  # our autopilot, which takes long to import; others do not need it
        from sitl.fleet import Fleet

        simulations = list(simulation) if isinstance(simulation, Sequence) else [simulation]
        self._settings = settings
        self._notice = notice
        self._grants = grants
        boot_unix_us = int(time.time() * 1e6)
        self._drones = [
            ServedDrone(flown, settings.shifted(number), boot_unix_us, notice)
            for number, flown in enumerate(simulations)
        ]
        self._fleet = Fleet([flown.world for flown in simulations], notice)

    async def run(self) -> None:
        """Open the links, then run until cancelled; video starts right after the first packets.

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
            await self._run_paced(video_task)
        finally:
            if video_task is not None:
                video_task.cancel()
                await asyncio.gather(video_task, return_exceptions=True)
            if self._grants is not None:
                await self._grants.close()
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

    async def _run_paced(self, video_task: asyncio.Task[None]) -> None:
        drones, fleet = self._drones, self._fleet
        simulation = drones[0].simulation
        pacer = Pacer(self._settings.speed, time.monotonic(), simulation.time_us)
        notices = LagNotices(self._notice, self._settings.speed)
        while True:
            if video_task.done():
                video_task.result()  # a busy port ends the simulator
            target_us = pacer.target_us(time.monotonic())
            for _ in range(BURST_TICKS):
                if simulation.time_us + CONTROL_PERIOD_US > target_us or simulation.time_us > self._until_us:
                    break
                for drone in drones:
                    drone.tick()
                fleet.tick()
            now_s = time.monotonic()
            lost_s = pacer.give_up_lag(now_s, simulation.time_us)
            if video_task.done():  # until then much is loaded
                notices.lag(lost_s, now_s)
            if self._grants is not None and simulation.time_us > self._until_us:
                await drones[0].hold(self._grants)
                continue
            await asyncio.sleep(pacer.wait_s(now_s, simulation.time_us + CONTROL_PERIOD_US))

    @property
    def _until_us(self) -> int:
        return FREE_US if self._grants is None else self._grants.until_us


class LagNotices:
    """Reports that the machine cannot keep up, at most once a period."""

    def __init__(self, notice: Callable[[str], None], speed: float) -> None:
        self._notice = notice
        self._speed = speed
        self._since_s = time.monotonic()
        self._lost_s = 0.0

    def lag(self, lost_s: float, now_s: float) -> None:
        """Count wall seconds given up, and report them once a period."""
        self._lost_s += lost_s
        span_s = now_s - self._since_s
        if span_s < _NOTICE_PERIOD_S:
            return
        if self._lost_s > 0.0:
            reached = self._speed * (1.0 - self._lost_s / span_s)
            self._notice(
                f"the machine cannot keep up: simulated time ran at {reached:.2f} of real time "
                f"(wanted {self._speed:g}) for the last {span_s:.0f} s; nothing was skipped"
            )
        self._since_s, self._lost_s = now_s, 0.0
