"""The simulator with PX4 as its autopilot: sensors to PX4, its motor commands to the world, video as ever."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable

from sitl.autopilots.process import AutopilotEndedError, AutopilotStart
from sitl.autopilots.server import AutopilotServer
from sitl.px4.link import FIRST_PORT, Px4GoneError, Px4Link
from sitl.px4.side_link import PERIOD_US, SideLink
from sitl.px4.simulation import Px4Simulation
from sitl.server import BURST_TICKS, LagNotices, Pacer
from sitl.server_settings import ServerSettings
from sitl.time_grants import TimeGrants
from sitl.world import CONTROL_PERIOD_US

_ENDING_S = 1.0  # wall time in which a PX4 that has closed the connection ends


class Px4Server(AutopilotServer[Px4Simulation]):
    """Runs a drone that PX4 flies, until cancelled; see `AutopilotServer`.

    Args:
        new_simulation: makes the simulation anew.
        settings: ports and speed; MAVLink is PX4's own.
        px4: how it is started.
        notice: called with lines for people.
        grants: how far simulated time may advance; None: without a limit.

    Attributes:
        link: to PX4; None before `run`.
    """

    NAME = "PX4"

    def __init__(
        self,
        new_simulation: Callable[[], Px4Simulation],
        settings: ServerSettings,
        px4: AutopilotStart,
        notice: Callable[[str], None] = lambda line: None,
        grants: TimeGrants | None = None,
    ) -> None:
        super().__init__(new_simulation, settings, px4, notice, grants)
        self.link: Px4Link | None = None
        self._side_link: SideLink | None = None

    def _open(self) -> None:
        settings, process = self._settings, self._autopilot.process
        self.link = Px4Link((settings.bind, FIRST_PORT + settings.instance), self._notice)
        output = None if process is None else process.log
        self._side_link = SideLink(settings, self._simulation.scenario.camera, output)

    def _close(self) -> None:
        if self.link is not None:
            self.link.close()
        if self._side_link is not None:
            self._side_link.close()

    async def _serve(self) -> None:
        link = self.link
        assert link is not None, "it was opened"
        while True:
            await self._start(link)
            self._notice("PX4 is connected")
            with contextlib.suppress(Px4GoneError):
                await self._run_paced(link)
            link.drop()
            await self._end_try(await self._reason(), link.try_connect)

    async def _start(self, link: Px4Link) -> None:
        """Start PX4, or say how, and wait until it has connected."""
        process = self._autopilot.process
        if process is None:
            if not link.is_connected:
                port = FIRST_PORT + self._settings.instance
                self._notice(f"waiting for PX4 on TCP {port}; start it: {self._autopilot.command}")
                await link.connected()
            return
        await process.stop()
        await process.start()
        ended = asyncio.create_task(process.ended())
        connected = asyncio.create_task(link.connected())
        done, _ = await asyncio.wait({ended, connected}, return_when=asyncio.FIRST_COMPLETED)
        for task in (ended, connected):
            task.cancel()
        await asyncio.gather(ended, connected, return_exceptions=True)
        if connected not in done:
            raise AutopilotEndedError(f"{ended.result()} (its output: {process.log})")

    async def _reason(self) -> str:
        """Why PX4 is no longer connected."""
        process = self._autopilot.process
        if process is not None:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(_ENDING_S):
                    return await process.ended()
        return "PX4 has closed the connection"

    async def _run_paced(self, link: Px4Link) -> None:
        settings, simulation = self._settings, self._simulation
        pacer = Pacer(1.0, time.monotonic(), simulation.time_us)
        notices = LagNotices(self._notice, settings.speed)
        started = False
        while True:
            if link.in_lockstep and not started:
                started = True
                pacer = Pacer(settings.speed, time.monotonic(), simulation.time_us)
                if self._grants is not None:
                    await self._grants.open()
            target_us = pacer.target_us(time.monotonic())
            for _ in range(BURST_TICKS):
                if simulation.time_us + CONTROL_PERIOD_US > target_us or simulation.time_us > self._until_us:
                    break
                await self._tick(link)
            now_s = time.monotonic()
            lost_s = pacer.give_up_lag(now_s, simulation.time_us)
            if started:
                notices.lag(lost_s, now_s)
            if self._grants is not None and simulation.time_us > self._until_us:
                await self._hold()
                continue
            await asyncio.sleep(pacer.wait_s(now_s, simulation.time_us + CONTROL_PERIOD_US))

    async def _tick(self, link: Px4Link) -> None:
        simulation = self._simulation
        time_us = simulation.time_us
        link.send(simulation.sense())
        self._video.step()  # while PX4 computes
        controls = link.answer(time_us)
        if controls is None and link.in_lockstep and simulation.is_answered:
            controls = await link.late_answer(time_us)
        simulation.move(controls)
        if time_us % PERIOD_US == 0 and self._side_link is not None:
            self._side_link.step(simulation)

    def _coast(self) -> None:
        self._simulation.sense()
        self._simulation.move(None)
