"""The simulator with ArduPilot as its autopilot: each frame of its outputs is one step with one answer."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

from sitl.ardupilot.json_interface import FIRST_PORT, PORTS_AN_INSTANCE, ServoFrame, decode_frame
from sitl.ardupilot.simulation import PULSE_MIN_US, ArduPilotSimulation
from sitl.autopilots.process import AutopilotEndedError, AutopilotStart
from sitl.server_settings import ServerSettings
from sitl.streaming.drone_video import DroneVideo
from sitl.world import PHYSICS_PERIOD_US
from wire.transports.sockets import Address, UdpSocket, bind_udp

_SILENCE_S = 2.0  # wall time without a frame that is reported
_FALL_US = 5_000_000  # for which a drone without its autopilot is simulated on
_MIN_LIFE_S = 5.0  # wall time; an ArduPilot that ends sooner is not started again
_STANDING = (PULSE_MIN_US,) * 16


class FrameExchange:
    """Steps a simulation with ArduPilot's frames, one step for each.

    ArduPilot sends a frame again when it has waited a second for the answer, and counts from zero when it
    starts. Of frames that wait together only the newest is answered: the others are repetitions, and a
    second answer to one of them would be read as the answer to the next.

    Args:
        new_simulation: makes the simulation anew, for an ArduPilot that has started again.
        moved: called at the end of each control period, with the simulation.

    Attributes:
        simulation: the present one.
        steps: taken since its start.
        repeated: frames that were answered as before, without a step.
    """

    def __init__(
        self,
        new_simulation: Callable[[], ArduPilotSimulation],
        moved: Callable[[ArduPilotSimulation], None] = lambda simulation: None,
    ) -> None:
        self._new_simulation, self._moved = new_simulation, moved
        self.simulation = new_simulation()
        self.steps = self.repeated = 0
        self._number: int | None = None  # of the last frame; None: none was received
        self._answer = b""

    def answer(self, frame: ServoFrame) -> bytes:
        """The line for a frame."""
        last = self._number
        if last == frame.number:
            self.repeated += 1
            return self._answer
        if last is not None and frame.number < last:
            self.restart()
        self._number = frame.number
        time_us = self.simulation.time_us
        self._answer = self.simulation.step(frame.pulses_us)
        self.steps += 1
        if self.simulation.time_us != time_us:
            self._moved(self.simulation)
        return self._answer

    def restart(self) -> None:
        """Put a new drone on the start, at time zero."""
        self._number, self.steps, self._answer = None, 0, b""
        self.simulation = self._new_simulation()


class ArduPilotServer:
    """Runs a drone that ArduPilot flies, until cancelled.

    ArduPilot sets the pace: it sends a frame when the time for a step has come, and waits for the answer.

    Args:
        new_simulation: makes the simulation anew.
        settings: ports and speed; MAVLink is ArduPilot's own.
        ardupilot: how it is started.
        notice: called with lines for people.
    """

    def __init__(
        self,
        new_simulation: Callable[[], ArduPilotSimulation],
        settings: ServerSettings,
        ardupilot: AutopilotStart,
        notice: Callable[[str], None] = lambda line: None,
    ) -> None:
        self._settings, self._ardupilot, self._notice = settings, ardupilot, notice
        self._new = new_simulation
        self._exchange = FrameExchange(self._new_simulation, self._step_video)
        self._video = DroneVideo(self._exchange.simulation, settings)
        self._shown = self._exchange.simulation
        self._frame_s: float | None = None  # wall time of the last frame; None: ArduPilot has sent none yet
        self._is_falling = False  # ArduPilot has ended: its last frames are not answered
        self._failed: asyncio.Future[None] | None = None

    def _new_simulation(self) -> ArduPilotSimulation:
        simulation = self._new()
        simulation.faults.notice = self._notice
        return simulation

    def _step_video(self, simulation: ArduPilotSimulation) -> None:
        if simulation is not self._shown:
            self._shown = simulation
            self._video.show(simulation)
        self._video.step()

    async def run(self) -> None:
        """Open the ports, then run until cancelled.

        Raises:
            LinkError: ArduPilot's port is in use.
            VideoError: the port of the video is in use.
            SettingError: ArduPilot cannot be started.
            AutopilotEndedError: it ended soon after its start.
        """
        loop, port = asyncio.get_running_loop(), self._port
        link = bind_udp((self._settings.bind, port), "choose another --instance")
        self._failed = loop.create_future()
        try:
            await self._video.open()
            self._notice(self._greeting())
            loop.add_reader(link, self._receive, link)
            tasks = [asyncio.ensure_future(self._failed), asyncio.create_task(self._watch())]
            tasks.append(asyncio.create_task(self._run_process()))
            try:
                await asyncio.gather(*tasks)
            finally:
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)
        finally:
            loop.remove_reader(link)
            link.close()
            if self._ardupilot.process is not None:
                await self._ardupilot.process.stop()
            await self._video.close()

    @property
    def _port(self) -> int:
        return FIRST_PORT + PORTS_AN_INSTANCE * self._settings.instance

    def _greeting(self) -> str:
        scenario, settings = self._exchange.simulation.scenario, self._settings
        page = f"http://{settings.bind}:{settings.http_port}/"
        return (
            f"{scenario.airframe} with ArduPilot in {scenario.name}: ArduPilot's MAVLink on UDP "
            f"{14540 + settings.instance} and 14550, video on {page} (Ctrl-C stops)"
        )

    def _receive(self, link: UdpSocket) -> None:
        """Answer the newest frame that has arrived."""
        newest: tuple[ServoFrame, Address] | None = None
        while packet := link.read():
            frame = decode_frame(packet)
            if frame is not None and link.peer is not None:
                newest = frame, link.peer
        if newest is None or self._is_falling:
            return
        if self._frame_s is None:
            self._notice("ArduPilot is connected")
        self._frame_s = time.monotonic()
        try:
            before = self._exchange.simulation
            link.write(self._exchange.answer(newest[0]), newest[1])
            if self._exchange.simulation is not before:
                self._notice(
                    "ArduPilot counts its frames from zero again: a new drone is on the start, at time zero"
                )
        except Exception as error:  # it would be lost in the event loop
            assert self._failed is not None
            if not self._failed.done():
                self._failed.set_exception(error)

    async def _watch(self) -> None:
        """Report when ArduPilot is silent, and when it sends again."""
        silent = False
        while True:
            await asyncio.sleep(_SILENCE_S / 2)
            was_silent, frame_s = silent, self._frame_s
            silent = frame_s is not None and time.monotonic() - frame_s > _SILENCE_S
            if silent and not was_silent:
                held_s = self._exchange.simulation.time_us / 1e6
                self._notice(
                    f"ArduPilot has sent no outputs for {_SILENCE_S:g} s; simulated time waits for it at "
                    f"{held_s:.3f} s"
                )
            elif was_silent and not silent and frame_s is not None:
                self._notice("ArduPilot sends again; no step was skipped")

    async def _run_process(self) -> None:
        """Start ArduPilot, and again when it has ended; without a build, say how."""
        process = self._ardupilot.process
        if process is None:
            self._notice(f"waiting for ArduPilot on UDP {self._port}; start it: {self._ardupilot.command}")
            return
        while True:
            began_s = time.monotonic()
            await process.start()
            reason = await process.ended()
            if time.monotonic() - began_s < _MIN_LIFE_S or self._frame_s is None:
                raise AutopilotEndedError(f"{reason} (its output: {process.log})")
            self._notice(f"{reason}; at {self._exchange.simulation.time_us / 1e6:.1f} s the motors stop")
            self._frame_s, self._is_falling = None, True
            await self._fall()
            self._exchange.restart()
            self._is_falling = False

    async def _fall(self) -> None:
        """Simulate on with standing motors, so that the try ends as it must."""
        simulation = self._exchange.simulation
        end_us = simulation.time_us + _FALL_US
        while simulation.time_us < end_us:
            simulation.step(_STANDING)
            self._step_video(simulation)
            await asyncio.sleep(PHYSICS_PERIOD_US / 1e6 / self._settings.speed)
