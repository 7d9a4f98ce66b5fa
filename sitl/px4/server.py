"""The simulator with PX4 as its autopilot: sensors to PX4, its motor commands to the world, video as ever."""

from __future__ import annotations

import asyncio
import contextlib
import time

from sitl.autopilots.idle import IdleCheck
from sitl.autopilots.process import AutopilotEndedError
from sitl.autopilots.server import AutopilotServer
from sitl.pacing.pacer import BURST_TICKS, LagNotices, Pacer
from sitl.px4.link import FIRST_PORT, Px4GoneError, Px4Link
from sitl.px4.side_link import PERIOD_US, SideLink
from sitl.px4.simulation import Px4Simulation
from sitl.world import CONTROL_PERIOD_US

_OWN_TIME = ("commander", "mavlink_if1")
"""Threads that PX4's lockstep does not wait for: its state machine, and what sends to UDP 14540."""
_IDLE_S = 0.1  # wall time for which a step waits until PX4's threads have done their work
_FIRST_S = 0.3  # wall time in which its start-up script comes to waiting for them
_IDLE_START_S = 2.0  # likewise, while it starts
_ENDING_S = 1.0  # wall time in which a PX4 that has closed the connection ends


class Px4Server(AutopilotServer[Px4Simulation]):
    """Runs a drone that PX4 flies, until cancelled; see `AutopilotServer`.

    Attributes:
        link: to PX4; None before `run`.
    """

    link: Px4Link | None = None
    _idle: IdleCheck | None = None  # of the PX4 that was started here
    _side_link: SideLink | None = None
    _ended: asyncio.Task[str] | None = None  # how the PX4 that was started here ends

    def _open(self) -> None:
        settings, process = self._settings, self._autopilot.process
        self.link = Px4Link((settings.bind, FIRST_PORT + settings.instance), self._notice)
        self._opened.callback(self.link.close)
        output = None if process is None else process.log
        self._side_link = SideLink(settings, self._simulation.scenario.camera, output)
        self._opened.callback(self._side_link.close)
        self._opened.callback(self._forget_process)

    def _forget_process(self) -> None:
        """No longer watch the PX4 that was started here."""
        if self._ended is not None:
            self._ended.cancel()
        if self._idle is not None:
            self._idle.close()

    async def _serve(self) -> None:
        link = self.link
        assert link is not None, "it was opened"
        while True:
            await self._start(link)
            self._notice("PX4 is connected")
            await self._video_is_open.wait()
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
        self._forget_process()
        await process.stop()
        await process.start()
        self._idle = None if process.process_id is None else IdleCheck(process.process_id, _OWN_TIME)
        self._ended = ended = asyncio.create_task(process.ended())
        connected = asyncio.create_task(link.connected())
        try:
            await asyncio.wait({ended, connected}, return_when=asyncio.FIRST_COMPLETED)
            if not connected.done():
                raise AutopilotEndedError(f"{ended.result()} ({process.where_its_output_is})")
            connected.result()
        finally:
            connected.cancel()
            await asyncio.gather(connected, return_exceptions=True)

    async def _reason(self) -> str:
        """Why PX4 is no longer connected."""
        process = self._autopilot.process
        if process is not None:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(_ENDING_S):
                    return await process.ended()
        return "PX4 has closed the connection"

    async def _run_paced(self, link: Px4Link) -> None:
        """Step until PX4 has gone."""
        simulation, grants = self._simulation, self._grants
        speed, opened = 0.0, False
        while True:
            if self._has_started(link) and not opened:
                opened = True
                if grants is not None:
                    await grants.open()
            if speed != (wanted := self._wanted_speed(opened=opened)):
                speed = wanted
                pacer = Pacer(speed, time.monotonic(), simulation.time_us)
                notices = LagNotices(self._notice, speed)
            target_us = pacer.target_us(time.monotonic())
            for _ in range(BURST_TICKS):
                if simulation.time_us + CONTROL_PERIOD_US > target_us or simulation.time_us > self._until_us:
                    break
                await self._tick(link)
            now_s = time.monotonic()
            lost_s = pacer.give_up_lag(now_s, simulation.time_us)
            if opened:
                notices.lag(lost_s, now_s)
            if grants is not None and simulation.time_us > self._until_us:
                await self._hold()
                continue
            await asyncio.sleep(pacer.wait_s(now_s, simulation.time_us + CONTROL_PERIOD_US))

    def _wanted_speed(self, *, opened: bool) -> float:
        """Simulated seconds a second, also while PX4 starts."""
        return self._settings.speed if opened and not self._is_starting else self._starting_speed()

    def _has_started(self, link: Px4Link) -> bool:
        return link.in_lockstep and not (self._idle is not None and self._idle.starting)

    async def _tick(self, link: Px4Link) -> None:
        simulation = self._simulation
        time_us = simulation.time_us
        packets = simulation.sense()
        if self._idle is not None:
            await self._wait_idle(self._idle)
        link.send(packets)
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

    async def _wait_idle(self, idle: IdleCheck) -> None:
        """Let PX4's threads that its lockstep does not wait for finish, so that each step is the same."""
        if not idle.starting:
            await idle.wait(_IDLE_S)
        elif self._simulation.time_us > 0:
            await asyncio.to_thread(idle.wait_started, _IDLE_START_S)
        else:  # until its first sensors, PX4 waits by polling
            await asyncio.sleep(_FIRST_S)

    async def _hold(self) -> None:
        """Wait until simulated time may advance; what PX4 sends before that has been sent then.

        Raises:
            AutopilotEndedError: PX4 has ended, which no sensors find out meanwhile.
        """
        if self._idle is not None:
            await self._wait_idle(self._idle)
        held = asyncio.create_task(super()._hold())
        ended = () if self._ended is None else (self._ended,)
        try:
            await asyncio.wait({held, *ended}, return_when=asyncio.FIRST_COMPLETED)
            if held.done():
                held.result()
            elif self._ended is not None:
                await self._end_try(self._ended.result())
        finally:
            held.cancel()
            await asyncio.gather(held, return_exceptions=True)
