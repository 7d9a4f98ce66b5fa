"""The simulator with ArduPilot as its autopilot: each frame of its outputs is one step with one answer."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

from framerunner.wire.transports.sockets import Address, UdpSocket, bind_udp
from sitl.ardupilot.json_interface import FIRST_PORT, PORTS_AN_INSTANCE, ServoFrame, decode_frame
from sitl.ardupilot.relay import HEARTBEAT_S, RELAY_PORT, AppRelay
from sitl.ardupilot.sensor_link import SENSOR_PORT, SensorLink
from sitl.ardupilot.simulation import ArduPilotSimulation
from sitl.ardupilot.sole_sender import SoleSender, mavlink_sender
from sitl.autopilots.process import AutopilotEndedError
from sitl.autopilots.server import AutopilotServer
from sitl.pacing.pacer import Pacer
from sitl.pacing.time_grants import FREE_US

_SILENCE_S = 2.0  # wall time without a frame that is reported
_LOST_S = 0.5  # wall time after which an answer to a frame that is repeated was lost
_GONE_S = 3.5  # wall time without a frame after which another is accepted; it repeats one each 1.1 s


class FrameExchange:
    """Steps a simulation with ArduPilot's frames, one step for each.

    ArduPilot sends a frame again when it has waited a second for the answer, and counts from zero when it
    starts. An answer that it gets twice would be read as the answer to its next frame, and all later ones
    would be late by a step. So of frames that wait together only the newest is answered, and one that was
    answered is answered again only when the answer must have been lost.

    Args:
        simulation: of the drone.
        clock: monotonic wall time, seconds.

    Attributes:
        steps: how many were taken.
        repeated: frames that came again after their answer.
    """

    def __init__(
        self,
        simulation: ArduPilotSimulation,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._simulation, self._clock = simulation, clock
        self.steps = self.repeated = 0
        self._number = -1  # of the last frame; negative: none was received
        self._answer = b""
        self._answered_s = 0.0

    def is_new(self, frame: ServoFrame) -> bool:
        """Whether a frame asks for a step."""
        return frame.number != self._number

    def is_restart(self, frame: ServoFrame) -> bool:
        """Whether ArduPilot has started again."""
        return frame.number < self._number

    def answer(self, frame: ServoFrame) -> bytes | None:
        """The line for a frame; None: it has been answered."""
        if not self.is_new(frame):
            self.repeated += 1
            if self._clock() - self._answered_s < _LOST_S:
                return None
        else:
            self._number = frame.number
            self._answer = self._simulation.step(frame.pulses_us)
            self.steps += 1
        self._answered_s = self._clock()
        return self._answer


class ArduPilotServer(AutopilotServer[ArduPilotSimulation]):
    """Runs a drone that ArduPilot flies, until cancelled; see `AutopilotServer`.

    ArduPilot sets the pace: it sends a frame when the time for a step has come, and waits for the answer.

    Attributes:
        exchange: with the present ArduPilot, from `run` on.
    """

    exchange: FrameExchange
    _link: UdpSocket | None = None
    _sensors: SensorLink | None = None
    _relay: AppRelay | None = None  # with a program that grants time
    _pacer: Pacer | None = None  # until that has granted time
    _sender: SoleSender[ServoFrame]
    _waiting: tuple[ServoFrame, Address] | None = None  # the last frame and its sender
    _frame_s = 0.0  # wall time of the last frame
    _connected: asyncio.Event
    _is_falling = False  # ArduPilot has ended: its last frames are not answered
    _holding: asyncio.Task[None] | None = None  # until time is granted
    _failed: asyncio.Future[None] | None = None

    def _open(self) -> None:
        self.exchange, self._connected = FrameExchange(self._simulation), asyncio.Event()
        self._sender = SoleSender[ServoFrame]("ArduPilot", self._port, self._notice, _GONE_S)
        bind, instance = self._settings.bind, self._settings.instance
        self._link = bind_udp((bind, self._port), "choose another --instance")
        self._opened.callback(self._link.close)
        if self._simulation.sends_sensors:
            port, place = SENSOR_PORT + PORTS_AN_INSTANCE * instance, self._simulation.place
            self._sensors = SensorLink(bind, port, instance + 1, place, self._notice)
            self._opened.callback(self._sensors.close)
        app = self._settings.onboard.remote
        if self._grants is not None and app is not None:
            port = RELAY_PORT + PORTS_AN_INSTANCE * instance
            listening = bind_udp((bind, port), "choose another --instance")
            sender = mavlink_sender(port, instance + 1, self._notice)
            self._relay = AppRelay(listening, app, sender, instance + 1)
            self._opened.callback(self._relay.close)

    async def _serve(self) -> None:
        loop, link = asyncio.get_running_loop(), self._link
        assert link is not None, "it was opened"
        self._failed = loop.create_future()
        loop.add_reader(link, self._receive)
        tasks = [asyncio.ensure_future(self._failed), asyncio.create_task(self._watch())]
        tasks.append(asyncio.create_task(self._run_process()))
        if self._relay is not None:
            tasks.append(asyncio.create_task(self._serve_relay(self._relay)))
        try:
            await asyncio.gather(*tasks)
        finally:
            loop.remove_reader(link)
            if self._holding is not None:
                tasks.append(self._holding)
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _serve_relay(self, relay: AppRelay) -> None:
        """Pass on what arrives there, until cancelled."""
        loop = asyncio.get_running_loop()
        loop.add_reader(relay.ardupilot, relay.from_ardupilot)
        loop.add_reader(relay.app, relay.from_app)
        try:
            while True:
                if not self._is_starting:
                    relay.send_heartbeat()
                await asyncio.sleep(HEARTBEAT_S)
        finally:
            loop.remove_reader(relay.ardupilot)
            loop.remove_reader(relay.app)

    @property
    def _port(self) -> int:
        return FIRST_PORT + PORTS_AN_INSTANCE * self._settings.instance

    def _receive(self) -> None:
        """Answer ArduPilot's newest frame that has arrived, as soon as time is granted."""
        link, before = self._link, self._sender.address
        assert link is not None, "it was opened"
        received = [(decode_frame(packet), peer) for packet, peer in link.read_all()]
        if self._is_falling:
            return
        frames = self._sender.select([(frame, peer) for frame, peer in received if frame is not None])
        if not frames:
            return
        assert self._sender.address is not None, "it has sent frames"
        self._waiting, self._frame_s = (frames[-1], self._sender.address), time.monotonic()
        if not self._connected.is_set():
            self._connected.set()
            self._notice("ArduPilot is connected")
        try:
            self._take(frames[-1], is_other=before not in (None, self._sender.address))
        except Exception as error:  # it would be lost in the event loop
            self._fail(error)

    def _take(self, frame: ServoFrame, *, is_other: bool) -> None:
        if is_other or self.exchange.is_restart(frame):
            self._restart()
        if self._holding is not None:
            return
        simulation = self._simulation
        is_held = simulation.time_us > self._until_us or self._is_starting or not self._video_is_open.is_set()
        if is_held and simulation.is_at_control_tick and self.exchange.is_new(frame):
            self._holding = asyncio.create_task(self._answer_when_granted())
        else:
            self._answer(holds=self._until_us == FREE_US)

    def _answer(self, *, holds: bool) -> None:
        """Answer the last frame.

        Args:
            holds: simulated time was held, or is free: what the app has sent goes to ArduPilot first.
        """
        assert self._waiting is not None
        assert self._link is not None
        frame, peer = self._waiting
        is_new, simulation = self.exchange.is_new(frame), self._simulation
        line = self.exchange.answer(frame)
        if line is None:
            return
        if is_new and self._sensors is not None:  # before the answer that lets ArduPilot's time advance
            if simulation.pose is not None:
                self._sensors.send_pose(simulation.pose)
            if simulation.flow is not None:
                self._sensors.send_flow(simulation.flow)
        if holds and self._relay is not None:
            self._relay.flush()
        self._link.write(line, peer)
        if is_new and simulation.is_at_control_tick:
            self._video.step()  # while ArduPilot computes

    async def _keep_pace(self) -> None:
        """Wait until a step is due while the autopilot starts."""
        time_us, now_s, pace = self._simulation.time_us, time.monotonic(), self._starting_speed()
        if self._pacer is None or self._pacer.speed != pace:
            self._pacer = Pacer(pace, now_s, time_us)
        self._pacer.give_up_lag(now_s, time_us)
        await asyncio.sleep(self._pacer.wait_s(now_s, time_us))

    async def _answer_when_granted(self) -> None:
        try:
            await self._video_is_open.wait()
            if self._is_starting:
                await self._keep_pace()
            while self._simulation.time_us > self._until_us:
                await self._hold()
            self._holding = None
            self._answer(holds=True)
        except Exception as error:  # nobody waits for this task
            self._fail(error)

    def _fail(self, error: Exception) -> None:
        assert self._failed is not None
        if not self._failed.done():
            self._failed.set_exception(error)

    def _restart(self) -> None:
        reason = "ArduPilot has started again"
        if self._grants is not None:
            at_s = self._simulation.time_us / 1e6
            raise AutopilotEndedError(f"at {at_s:.1f} s of simulated time {reason}")
        self._renew()
        self._notice(f"{reason}: a new drone is on the start, at time zero")

    def _renew(self) -> None:
        super()._renew()
        self.exchange = FrameExchange(self._simulation)

    def _coast(self) -> None:
        self._simulation.coast()

    async def _watch(self) -> None:
        """Report when ArduPilot is silent, and when it sends again."""
        silent = False
        while True:
            await asyncio.sleep(_SILENCE_S / 2)
            was_silent = silent
            silent = self._connected.is_set() and time.monotonic() - self._frame_s > _SILENCE_S
            if silent and not was_silent and self._holding is None:
                held_s = self._simulation.time_us / 1e6
                self._notice(
                    f"ArduPilot has sent no outputs for {_SILENCE_S:g} s; simulated time waits for it at "
                    f"{held_s:.3f} s"
                )
            elif was_silent and not silent and self._connected.is_set():
                self._notice("ArduPilot sends again; no step was skipped")

    async def _run_process(self) -> None:
        """Start ArduPilot, and again when it has ended; without a build, say how."""
        process = self._autopilot.process
        if process is None:
            self._notice(f"waiting for ArduPilot on UDP {self._port}; start it: {self._autopilot.command}")
            await self._open_grants()
            return
        while True:
            await process.start()
            ended = asyncio.create_task(process.ended())
            opened = asyncio.create_task(self._open_grants())
            try:
                reason = await ended
            finally:
                for task in (ended, opened):
                    task.cancel()
                await asyncio.gather(ended, opened, return_exceptions=True)
            if not self._connected.is_set():
                raise AutopilotEndedError(f"{reason} ({process.where_its_output_is})")
            self._connected.clear()
            self._sender.forget()
            if self._holding is not None:  # a frame that need not be answered any more
                self._holding.cancel()
                self._holding = None
            self._is_falling = True
            await self._end_try(reason)
            self._is_falling = False

    async def _open_grants(self) -> None:
        """Once ArduPilot and video are connected, let the program that started this one grant time."""
        await self._connected.wait()
        await self._video_is_open.wait()
        if self._grants is not None:
            await self._grants.open()
