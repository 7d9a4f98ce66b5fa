"""The simulator as a child process whose time waits for this program at each tick; see `pacing.time_grants`.

What the app receives at a tick is then a function of vehicle time alone, as in lockstep: all images until
then and the telemetry of that tick. The setpoint that answers it arrives one control period later.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import time
from collections import deque
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Self

from framerunner.child_process import ChildProcess
from framerunner.errors import SettingError, UserError
from framerunner.flying.lockstep_drone import TELEMETRY_DELAY_US, sent_yaw_rate, single
from framerunner.wire.simulator_api import SimulatorApi
from offboard.drone import DroneError, VelocityFluCommand
from offboard.perception import IMAGES_KEPT, CameraPerception
from sitl.autopilots import TITLES, WARNING
from sitl.autopilots.process import may_use_real_time
from sitl.pacing.time_grants import FREE_US, Grant, Held, SentImage, Velocity, parse_answer
from sitl.server_settings import VIDEO_PORT
from sitl.world import CONTROL_PERIOD_US
from vision.types import CameraError, CameraFrame

START_S = 60.0  # on the busiest machine
ANSWER_S = 20.0  # wall time in which a simulator runs 50 ms, on the busiest machine
_LAST_LINE_S = 3.0
_READ_BYTES = 1 << 20  # of the channel at once; an image has some hundred kilobytes
IMAGE_S = 10.0  # wall time for an image to arrive and be processed, on the busiest machine
_ANSWER_US = CONTROL_PERIOD_US + TELEMETRY_DELAY_US - 1
"""From a multiple of 50 ms to the last control tick before the one that applies the answer."""
_TELEMETRY_US = CONTROL_PERIOD_US - 1
"""From a multiple of 50 ms to the control tick whose telemetry is the app's tick."""
_GENUINE_ANSWER_US = {"px4": 20_000, "ardupilot": 28_000}
"""Likewise; PX4 sends an attitude each 10 ms, ArduPilot each 20 ms, when it comes to it."""


@dataclass(frozen=True, slots=True)
class GenuineAutopilot:
    """An autopilot that the user has built, which flies the simulated drone instead of our own."""

    name: Literal["px4", "ardupilot"]  # as an option of `framerunner sim`
    folder: Path

    @property
    def title(self) -> str:
        """For people."""
        return TITLES[self.name]

    @property
    def repeats(self) -> bool:
        """Whether it flies the same flight again with the same seed; else it is only alike."""
        return self.name != "px4" or may_use_real_time()


class SitlProcess(ChildProcess):
    """`framerunner sim` as a child process, with its options.

    Args:
        scenario: name or file.
        speed: simulated seconds a second.
        instance: shifts ports and system id.
        links: MAVLink URLs besides the usual ones.
        seed: of everything random.
        autopilot: that flies instead of our own; None: our own does.
        storage: folder of the drone's files; None: in memory.
        on_warning: called with each of its warnings, without "warning: ".
    """

    def __init__(
        self,
        scenario: str,
        speed: float = 1.0,
        instance: int = 0,
        links: tuple[str, ...] = (),
        seed: int = 0,
        *,
        autopilot: GenuineAutopilot | None = None,
        storage: Path | None = None,
        on_warning: Callable[[str], None] = lambda line: None,
    ) -> None:
        here, there = socket.socketpair()
        arguments = [
            *("sim", "--lifeline", "--scenario", scenario, "--seed", str(seed)),
            *("--speed", f"{speed:g}", "--instance", str(instance), "--video-rtp", "off"),
            *("--time-grants", str(there.fileno())),
            *(word for link in links for word in ("--link", link)),
            *(() if autopilot is None else ("--autopilot", autopilot.name)),
            *(() if autopilot is None else (f"--{autopilot.name}", str(autopilot.folder))),
            *(() if storage is None else ("--storage", str(storage))),
        ]

        def hear(line: str) -> None:
            if line.startswith(WARNING):
                on_warning(line.removeprefix(WARNING))

        super().__init__("the simulator", arguments, hear, inherited=there)
        answer_us = _ANSWER_US if autopilot is None else _GENUINE_ANSWER_US[autopilot.name]
        self.clock = SimulatorClock(here, answer_us, answers_take_time=autopilot is not None)
        self.system_id = instance + 1  # MAVLink id of its drone
        self.drone_url = f"udpin://127.0.0.1:{14540 + instance}"
        self.api = SimulatorApi(f"http://127.0.0.1:{VIDEO_PORT + instance}")

    async def __aenter__(self) -> Self:
        """Start it, and wait until all its ports are open; SettingError with its last line if it cannot."""
        await super().__aenter__()
        try:
            await self.guard(asyncio.create_task(self.clock.up()))
        except BaseException:
            await self.__aexit__()
            raise
        return self

    async def failed(self) -> str:
        """As of every child; the drone is gone then."""
        self.clock.gone = await super().failed()
        return self.clock.gone

    async def __aexit__(self, *problem: object) -> None:
        """Stop it; when it had failed, that is the reason of a UserError: SettingError with its last line."""
        self.clock.close()
        await super().__aexit__()
        if self.has_failed and any(isinstance(each, UserError) for each in problem):
            raise SettingError(await self.failed()) from None


class SimulatorImages:
    """All images of the simulator's camera, as they were rendered; a camera of `CameraPerception`."""

    def __init__(self) -> None:
        self._waiting: deque[CameraFrame] = deque(maxlen=IMAGES_KEPT)  # more are not used, either
        self._ended = False
        self._changed = asyncio.Event()

    async def frames(self) -> AsyncIterator[CameraFrame]:
        """In order of exposure; CameraError when the simulator has ended."""
        while True:
            while self._waiting:
                yield self._waiting.popleft()
            if self._ended:
                raise CameraError("the simulator has ended")
            self._changed.clear()
            await self._changed.wait()

    def put(self, frame: CameraFrame) -> None:
        """Add one."""
        self._waiting.append(frame)
        self._changed.set()

    def end(self) -> None:
        """None follows."""
        self._ended = True
        self._changed.set()


class SimulatorClock:
    """This program's end of the simulator's time grants; DroneError: the simulator has ended.

    Args:
        channel: to the simulator.
        answer_us: simulated time from a tick until the telemetry of the tick has been sent.
        answers_take_time: the autopilot answers requests only while simulated time goes on.

    Attributes:
        images: of the camera.
    """

    def __init__(
        self,
        channel: socket.socket,
        answer_us: int = _ANSWER_US,
        *,
        answers_take_time: bool = False,
    ) -> None:
        self.answers_take_time = answers_take_time
        self._answer_us = answer_us
        self.gone = ""  # why the simulator has ended
        self.images_missed = 0  # ticks whose image did not arrive in time
        self.setpoints_missed = 0  # setpoints that did not arrive in time
        self.images = SimulatorImages()
        self._channel = channel
        self._answers: asyncio.Queue[Held | None] = asyncio.Queue()  # None: no other one follows
        self._listening: asyncio.Task[None] | None = None
        self._writer: asyncio.StreamWriter | None = None
        self._perception: CameraPerception | None = None

    def wait_for_images_of(self, perception: CameraPerception) -> None:
        """Wait at each tick until it has processed the image that was sent last."""
        self._perception = perception

    async def up(self) -> None:
        """Wait until the simulator reports that it is up; SettingError if it does not."""
        reader, self._writer = await asyncio.open_connection(sock=self._channel, limit=_READ_BYTES)
        try:
            async with asyncio.timeout(START_S):
                line = await reader.readline()
        except TimeoutError:
            raise SettingError(f"the simulator did not start within {START_S:g} s") from None
        if not line:  # it has ended; `guard` reports its last line
            await asyncio.sleep(START_S)
        self._listening = asyncio.create_task(self._listen(reader), name="simulator's clock")

    async def stop(self) -> int:
        """Stop vehicle time; returns that of the last control tick, microseconds."""
        return (await self._granted(Grant(0))).time_us

    async def advance(
        self, tick_us: int, command: VelocityFluCommand | None, *, at_once: bool = False
    ) -> None:
        """Grant time up to a tick and the control period after it; then wait for the images.

        Args:
            tick_us: multiple of 50 ms.
            command: must be received first; None: time does not wait for a command.
            at_once: up to the tick only, if the autopilot answers while time stands.
        """
        until_us = tick_us + (_TELEMETRY_US if at_once and not self.answers_take_time else self._answer_us)
        held = await self._granted(Grant(until_us, None if command is None else _sent(command)))
        if held.setpoint_missed:
            self.setpoints_missed += 1
        if self._perception is not None and not await self._perception.seen(held.image_us, IMAGE_S):
            self.images_missed += 1

    def release(self) -> None:
        """Let time run freely."""
        if self._writer is not None and not self._writer.is_closing():
            self._writer.write(Grant(FREE_US).line())

    def close(self) -> None:
        """Close the channel."""
        if self._listening is not None:
            self._listening.cancel()
        if self._writer is not None:
            self._writer.close()
        else:
            self._channel.close()

    async def _granted(self, grant: Grant) -> Held:
        assert self._writer is not None, "up() comes first"
        try:
            self._writer.write(grant.line())
            async with asyncio.timeout(ANSWER_S):
                held = await self._answers.get()
        except TimeoutError:
            raise DroneError(f"the simulator did not answer for {ANSWER_S:g} s") from None
        if held is None:
            self._answers.put_nowait(None)
            await asyncio.sleep(_LAST_LINE_S)  # `guard` has a better reason
            raise DroneError("the simulator has ended")
        return held

    async def _listen(self, reader: asyncio.StreamReader) -> None:
        with contextlib.suppress(OSError, asyncio.IncompleteReadError):
            while line := await reader.readline():
                answer = parse_answer(line)
                if isinstance(answer, SentImage):
                    image = answer.image(await reader.readexactly(answer.size_bytes))
                    self.images.put(CameraFrame(image, answer.time_us, time.monotonic()))
                else:
                    self._answers.put_nowait(answer)
        self.images.end()
        self._answers.put_nowait(None)


def _sent(command: VelocityFluCommand) -> Velocity:
    """A command as the autopilot receives it."""
    forward, right, down = single((command.forward_m_s, -command.left_m_s, -command.up_m_s))
    return (forward, right, down, sent_yaw_rate(-command.yaw_rate_rad_s))
