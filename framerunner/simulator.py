"""A simulated drone for the length of a `with` block: a process of its own, on ports that nobody uses."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections.abc import Callable, Coroutine, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Self, TypeVar

from framerunner.child_process import ChildProcess, free_port
from framerunner.errors import SettingError
from framerunner.instances import claimed_instance
from framerunner.wire.simulator_api import SimulatorApi
from scenarios.loader import dump_yaml, load_scenario
from scenarios.models import Scenario, TrueState
from sitl.server_settings import VIDEO_PORT
from sitl.truth_channel import parse_truth

T = TypeVar("T")

_START_S = 60.0  # on the busiest machine
_ANSWER_S = 20.0
_READY = "Ready for takeoff!"


class Simulator:
    """`framerunner sim` with a scenario, from `__enter__` to `__exit__`, also if this program is killed.

    Up to ten run side by side on a machine; each has ports and a system id of its own. All times are of the
    simulated clock, which runs `speed` times as fast as the wall's.

    Args:
        scenario: name or file as of `load_scenario`, or a scenario.
        speed: simulated seconds a second, 0.01 to 1000.
        seed: of everything random.
        sensors: the drone's sensor suite instead of the scenario's, such as "outdoor".
        faults: what fails, such as "gps off at 12 s for 5 s" after arming.

    Attributes:
        drone_url: MAVLink for apps, as MAVSDK takes it; the app listens there.
        ground_url: MAVLink for ground stations, likewise.
        video_url: the camera's images as MJPEG over HTTP.
        system_id: of the drone in MAVLink.

    Raises:
        UserError: there is no such scenario or, when it is entered, the simulator cannot be started; one line
            with the reason.
    """

    drone_url: str
    ground_url: str
    video_url: str
    system_id: int

    def __init__(
        self,
        scenario: str | Path | Scenario = "open-field",
        *,
        speed: float = 1.0,
        seed: int = 0,
        sensors: str | None = None,
        faults: Sequence[str] = (),
    ) -> None:
        self.scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
        self.speed = speed
        self._options = ["--speed", f"{speed:g}", "--seed", str(seed)]
        self._options += [] if sensors is None else ["--sensors", sensors]
        self._options += [word for fault in faults for word in ("--fault", fault)]
        self._lines: list[str] = []
        self._ready = asyncio.Event()
        self._stack = ExitStack()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._process: ChildProcess | None = None
        self._reader: asyncio.StreamReader | None = None
        self._writer: asyncio.StreamWriter | None = None

    def __enter__(self) -> Self:
        """Start it, and wait until all its ports are open."""
        if self._loop is not None:
            raise SettingError("Simulator: is running already; make another for a second drone")
        self._lines, self._ready = [], asyncio.Event()
        with ExitStack() as stack:
            instance = stack.enter_context(claimed_instance())
            folder = stack.enter_context(TemporaryDirectory(prefix="framerunner-simulator-"))
            file = Path(folder) / "scenario.yaml"
            file.write_text(dump_yaml(self.scenario), encoding="utf-8")
            ground = free_port()
            self.drone_url = f"udpin://127.0.0.1:{14540 + instance}"
            self.ground_url = f"udpin://127.0.0.1:{ground}"
            self.video_url = SimulatorApi(f"http://127.0.0.1:{VIDEO_PORT + instance}").video_url
            self.system_id = instance + 1
            options = ["--scenario", str(file), "--instance", str(instance), "--video-rtp", "off"]
            options += ["--ground-remote", f"127.0.0.1:{ground}", *self._options]
            self._loop = asyncio.new_event_loop()
            stack.callback(self._end_loop, self._loop, self._start_thread(self._loop))
            stack.callback(self._wait_for, self._stop)
            self._wait_for(lambda: self._start(options))
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *problem: object) -> None:
        """Stop it."""
        self._stack.close()

    @property
    def log(self) -> str:
        """What it has printed so far."""
        return "\n".join(self._lines)

    def truth(self) -> TrueState:
        """The true state of the drone now: arena axes (x forward, y left, z up), metres, seconds, radians.

        Only this program can ask for it; an app gets what a real drone would send.

        Raises:
            UserError: the simulator has ended; the message is its last line.
        """
        return self._wait_for(self._ask)

    def wait_until_ready(self, timeout_s: float = 30.0) -> None:
        """Wait until the drone can be armed, which takes longer with GPS.

        Args:
            timeout_s: wall time.

        Raises:
            UserError: it could not be armed by then, or the simulator has ended.
        """
        self._wait_for(lambda: self._readiness(timeout_s))

    def _start_thread(self, loop: asyncio.AbstractEventLoop) -> threading.Thread:
        thread = threading.Thread(target=loop.run_forever, name="simulator", daemon=True)
        thread.start()
        return thread

    def _end_loop(self, loop: asyncio.AbstractEventLoop, thread: threading.Thread) -> None:
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()
        self._loop = None

    def _wait_for(self, work: Callable[[], Coroutine[object, object, T]]) -> T:
        """Do some work in the thread of the process."""
        if self._loop is None:
            raise SettingError("Simulator: is not running; use it within `with Simulator() as simulator:`")
        return asyncio.run_coroutine_threadsafe(work(), self._loop).result()

    async def _start(self, options: Sequence[str]) -> None:
        here, there = socket.socketpair()
        words = ["sim", "--lifeline", "--truth", str(there.fileno()), *options]
        self._process = ChildProcess("the simulator", words, self._hear, inherited=there)
        await self._process.__aenter__()
        self._reader, self._writer = await asyncio.open_connection(sock=here)
        await self._line(self._reader, _START_S)

    async def _stop(self) -> None:
        if self._writer is not None:
            self._writer.close()
        if self._process is not None:
            await self._process.__aexit__()
        self._reader = self._writer = self._process = None

    async def _readiness(self, limit_s: float) -> None:
        assert self._process is not None
        try:
            async with asyncio.timeout(limit_s):
                await self._process.guard(asyncio.create_task(self._ready.wait()))
        except TimeoutError:
            raise SettingError(
                f"the drone was not ready within {limit_s:g} s; wait longer, or mend what prevents arming: "
                f"{self._lines[-1] if self._lines else 'the simulator printed nothing'}"
            ) from None

    async def _ask(self) -> TrueState:
        assert self._reader is not None
        assert self._writer is not None
        self._writer.write(b"\n")
        return parse_truth(await self._line(self._reader, _ANSWER_S))

    async def _line(self, reader: asyncio.StreamReader, limit_s: float) -> bytes:
        """The next line of the channel; SettingError if the simulator ends or takes too long."""
        assert self._process is not None
        line = b""
        try:
            async with asyncio.timeout(limit_s):
                with suppress(OSError):  # the channel is closed when the simulator ends
                    line = await reader.readline()
                if not line:
                    raise SettingError(await self._process.failed())
        except TimeoutError:
            raise SettingError(f"the simulator did not answer within {limit_s:g} s") from None
        return line

    def _hear(self, line: str) -> None:
        self._lines.append(line)
        if line == _READY:
            self._ready.set()
