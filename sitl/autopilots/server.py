"""What the simulators of genuine autopilots share: ports, video, the autopilot's end, granted time."""

from __future__ import annotations

import asyncio
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import ExitStack
from typing import Generic, TypeVar

from framerunner.wire.transports.urls import in_url
from sitl.autopilots.process import AutopilotEndedError, AutopilotStart
from sitl.pacing.pacer import BURST_TICKS, Pacer
from sitl.pacing.time_grants import FREE_US, TimeGrants
from sitl.server_settings import ServerSettings
from sitl.vehicle import SimulatedVehicle
from sitl.video import DroneVideo
from sitl.world import CONTROL_PERIOD_US

FALL_US = 3_000_000
"""For which a drone without its autopilot is simulated on."""
_READY_US = 7_000_000  # by which the autopilot can be prepared for its flight
_WAITING_SPEED = 0.2  # simulated seconds a second; a heartbeat still comes every 5 s

V = TypeVar("V", bound=SimulatedVehicle)


class AutopilotServer(ABC, Generic[V]):
    """Runs a drone that a genuine autopilot flies, until cancelled.

    When the autopilot has gone, the drone falls and the try ends. One that connects then gets a new drone on
    its start, at time zero.

    Args:
        new_simulation: makes the simulation anew.
        settings: ports and speed; MAVLink is the autopilot's own.
        start: how the autopilot is started.
        notice: called with lines for people.
        grants: how far simulated time may advance; None: without a limit. With them the autopilot's end ends
            the server.
    """

    def __init__(
        self,
        new_simulation: Callable[[], V],
        settings: ServerSettings,
        start: AutopilotStart,
        notice: Callable[[str], None] = lambda line: None,
        grants: TimeGrants | None = None,
    ) -> None:
        self._new_simulation = new_simulation
        self._settings, self._autopilot, self._notice, self._grants = settings, start, notice, grants
        self._simulation = self._new()
        self._opened = ExitStack()  # the autopilot's ports, and what else is closed in the end
        self._video = DroneVideo(self._simulation, settings, grants)
        self._video_is_open = asyncio.Event()  # from then on time passes

    async def run(self) -> None:
        """Open the ports, then run until cancelled.

        Raises:
            LinkError: the autopilot's port is in use.
            VideoError: the port of the video is in use.
            SettingError: the autopilot cannot be started.
            AutopilotEndedError: it ended soon after its start, or time is granted by another program.
        """
        tasks: list[asyncio.Task[None]] = []
        try:
            self._open()
            tasks = [asyncio.create_task(work) for work in (self._open_video(), self._serve())]
            await asyncio.gather(*tasks)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            self._opened.close()
            if self._autopilot.process is not None:
                await self._autopilot.process.stop()
            if self._grants is not None:
                await self._grants.close()
            await self._video.close()

    async def _open_video(self) -> None:
        """Open the video, which takes long, while the autopilot starts and connects."""
        await self._video.open()
        self._notice(self._greeting())
        self._video_is_open.set()

    @abstractmethod
    def _open(self) -> None:
        """Open the autopilot's ports, each to be closed by `_opened`."""

    @abstractmethod
    async def _serve(self) -> None:
        """Start the autopilot, or say how, and simulate."""

    @abstractmethod
    def _coast(self) -> None:
        """Simulate one control period with standing motors."""

    def _greeting(self) -> str:
        scenario, settings, name = self._simulation.scenario, self._settings, self._simulation.autopilot_name
        page = f"http://{in_url(settings.bind, settings.http_port)}/"
        return (
            f"{scenario.airframe} with {name} and sensors {scenario.sensors} in {scenario.name}: "
            f"{name}'s MAVLink on UDP {14540 + settings.instance} and 14550, video on {page} "
            "(Ctrl-C stops)"
        )

    def _new(self) -> V:
        simulation = self._new_simulation()
        simulation.faults.notice = self._notice
        return simulation

    def _renew(self) -> None:
        """Put a new drone on the start, at time zero."""
        self._simulation = self._new()
        self._video.show(self._simulation)

    async def _end_try(self, reason: str, is_over: Callable[[], bool] = lambda: False) -> None:
        """Let the drone of an autopilot that has gone fall, and then renew it; `is_over` ends the fall.

        Raises:
            AutopilotEndedError: time is granted by another program, whose flight this ends.
        """
        at_s = self._simulation.time_us / 1e6
        self._notice(f"{reason}; at {at_s:.1f} s the motors stop")
        if self._grants is not None:
            raise AutopilotEndedError(f"at {at_s:.1f} s of simulated time {reason}")
        simulation = self._simulation
        pacer = Pacer(self._settings.speed, time.monotonic(), simulation.time_us)
        end_us = simulation.time_us + FALL_US
        while simulation.time_us < end_us and not is_over():
            target_us = pacer.target_us(time.monotonic())
            for _ in range(BURST_TICKS):
                if simulation.time_us + CONTROL_PERIOD_US > target_us:
                    break
                self._coast()
                self._video.step()
            await asyncio.sleep(pacer.wait_s(time.monotonic(), simulation.time_us + CONTROL_PERIOD_US))
        self._renew()

    @property
    def _until_us(self) -> int:
        return FREE_US if self._grants is None else self._grants.until_us

    async def _hold(self) -> None:
        """Wait until simulated time may advance."""
        grants = self._grants
        assert grants is not None, "time is granted"
        held_us = self._simulation.time_us - CONTROL_PERIOD_US
        await grants.hold(held_us, self._video.image_us, lambda: grants.setpoint)

    @property
    def _is_starting(self) -> bool:
        """Whether a program will grant time, and has not yet."""
        return self._grants is not None and not self._grants.used

    def _starting_speed(self) -> float:
        """Simulated seconds a second until a program grants time: at most real time.

        When the autopilot can be armed, time passes slowly, because that program begins its flight at a
        whole multiple of ten seconds.
        """
        speed = 1.0 if self._simulation.time_us < _READY_US else _WAITING_SPEED
        return min(speed, self._settings.speed)
