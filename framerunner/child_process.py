"""Commands of this program as child processes that never outlive their parent; both ends of that lifeline."""

from __future__ import annotations

import asyncio
import contextlib
import os
import resource
import socket
import sys
import threading
from asyncio.subprocess import DEVNULL, PIPE, Process
from collections.abc import Callable, Coroutine, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Self, TypeVar

from framerunner.errors import SettingError
from framerunner.monitor import FIRST_VIEWER
from framerunner.terminal import say, warn
from scenarios.loader import dump_yaml
from scenarios.models import Scenario

T = TypeVar("T")

_GRACE_S = 3.0
_LAST_LINE_S = 1.0
_MONITOR_START_S = 20.0


class ChildProcess:
    """`framerunner …` as a child process.

    The child stops when its standard input ends, so it ends even if this process is killed. It runs in a
    session of its own: a Ctrl-C in the terminal is first handled here.

    Args:
        name: for people: "the simulator".
        arguments: of the command, `--lifeline` among them.
        on_line: called with each line that it prints on standard error.
        inherited: a socket that it inherits, with its number; closed here once it has started.
    """

    def __init__(
        self,
        name: str,
        arguments: Sequence[str],
        on_line: Callable[[str], None] = lambda line: None,
        inherited: socket.socket | None = None,
    ) -> None:
        self._name = name
        self._arguments = [sys.executable, "-m", "framerunner", *arguments]
        self._on_line = on_line
        self._inherited = inherited
        self._process: Process | None = None
        self._last_line = "it printed nothing"
        self._reader: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        """Start it."""
        inherited = self._inherited
        try:
            self._process = await asyncio.create_subprocess_exec(
                *self._arguments,
                stdin=PIPE,
                stdout=DEVNULL,
                stderr=PIPE,
                start_new_session=True,
                pass_fds=() if inherited is None else (inherited.fileno(),),
            )
        finally:
            if inherited is not None:
                inherited.close()
        self._reader = asyncio.create_task(self._read())
        return self

    async def __aexit__(self, *_: object) -> None:
        """Stop it: first by closing its standard input, then by force."""
        process = self._process
        assert process is not None
        if process.stdin is not None:
            process.stdin.close()
        try:
            async with asyncio.timeout(_GRACE_S):
                await process.wait()
        except TimeoutError:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()
        if self._reader is not None:
            await asyncio.wait({self._reader}, timeout=_LAST_LINE_S)
            self._reader.cancel()
            await asyncio.gather(self._reader, return_exceptions=True)

    @property
    def has_failed(self) -> bool:
        """Whether it has ended by itself with an error."""
        return self._process is not None and (self._process.returncode or 0) > 0

    async def failed(self) -> str:
        """Wait until the process ends by itself, and return why: its last line. Waits forever otherwise."""
        assert self._process is not None
        code = await self._process.wait()
        if code < 0:  # its last line says nothing of that
            return f"{self._name} was ended by signal {-code}"
        if self._reader is not None:
            await asyncio.wait({self._reader}, timeout=_LAST_LINE_S)
        return f"{self._name} ended with code {code}: {self._last_line.removeprefix('error: ')}"

    async def guard(self, work: asyncio.Task[T]) -> T:
        """Wait for some work, but not longer than the child lives.

        When this is cancelled or the child ends, so is the work; if it still ends with a result, that is
        returned.

        Raises:
            SettingError: the child could not start or ended; its last line is the reason.
        """
        watching = asyncio.create_task(self.failed())
        try:
            await _wait_or_cancel(work, watching)
            if not work.done():
                work.cancel()
                await asyncio.wait({work}, timeout=_GRACE_S)
                work.cancel()  # what it still asks of the child is not answered
                await asyncio.gather(work, return_exceptions=True)
                if work.cancelled() or work.exception() is not None:
                    raise SettingError(watching.result())
            return work.result()
        finally:
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)

    async def _read(self) -> None:
        assert self._process is not None
        assert self._process.stderr is not None
        async for line in self._process.stderr:
            text = line.decode(errors="replace").rstrip()
            if text:
                self._last_line = text
                self._on_line(text)


class MonitorProcess(ChildProcess):
    """`framerunner monitor` as a child process; what it prints is printed here.

    Args:
        scenario: what is flown.
        judges: it judges that by telemetry: the drone has no referee.
        runs: folder of recorded flights; None for the monitor's own default.
        camera_hosts: HOST or HOST:PORT of cameras whose drones' packets are sent by this process.
    """

    def __init__(
        self,
        scenario: Scenario,
        runs: Path | None = None,
        camera_hosts: Sequence[str] = (),
        *,
        judges: bool = False,
    ) -> None:
        port = free_port()
        self.link = f"udpout://127.0.0.1:{port}"  # to which the drones' packets are to be sent
        arguments = ["monitor", "--lifeline", "--drone", f"udpin://127.0.0.1:{port}"]
        self._folder = TemporaryDirectory(prefix="framerunner-monitor-")  # only this user may read it
        self.operator_socket = Path(self._folder.name) / "operator.sock"
        arguments += ["--operator-socket", str(self.operator_socket)]
        # It reads the scenario that was checked here, even if the user's file changes.
        path = Path(self._folder.name) / "scenario.yaml"
        path.write_text(dump_yaml(scenario), encoding="utf-8")
        arguments += ["--scenarios", "scenarios", "--scenarios", str(path)]
        if judges:
            arguments += ["--scenario", str(path)]
        if runs is not None:
            arguments += ["--runs", str(runs)]
        for host in camera_hosts:
            arguments += ["--camera-host", host]
        self._open = asyncio.Event()
        self._viewed = asyncio.Event()
        self._watching: asyncio.Task[None] | None = None
        super().__init__("the monitor", arguments, self._relay)

    async def opened(self) -> None:
        """Wait until its pages are served, for 20 s at most; SettingError with its last line if it ends."""
        with contextlib.suppress(TimeoutError):
            await self.guard(asyncio.create_task(self._opening()))
        self._watching = asyncio.create_task(self._warn_of_its_end())

    async def _opening(self) -> None:
        async with asyncio.timeout(_MONITOR_START_S):
            await self._open.wait()

    async def __aexit__(self, *problem: object) -> None:
        """Stop it."""
        if self._watching is not None:
            self._watching.cancel()
            await asyncio.gather(self._watching, return_exceptions=True)
        await super().__aexit__(*problem)
        self._folder.cleanup()

    async def failed(self) -> str:
        """As of every child, but its advice names options that this process's command has."""
        reason = await super().failed()
        return reason.replace(
            "choose another with --port",
            "stop what listens there, or leave out --monitor and start framerunner monitor --port 8081",
        )

    async def viewed(self) -> None:
        """Wait until a browser shows it; SettingError with its last line if it ends."""
        say("the flight begins when a browser shows the monitor (Ctrl-C stops)")
        await self.guard(asyncio.create_task(self._viewed.wait()))

    async def stay(self) -> None:
        """Wait for Ctrl-C or SIGTERM, which then ends only this wait."""
        say("the monitor stays open (Ctrl-C or SIGTERM ends it)")
        try:
            await self.failed()
        except asyncio.CancelledError:
            _uncancel()

    async def _warn_of_its_end(self) -> None:
        """The monitor's end must not end a flight."""
        warn(await self.failed())

    def _relay(self, line: str) -> None:
        if not line.startswith("error: "):  # the reason of its end is printed by what waits for it
            say(line)
        if "http://" in line:
            self._open.set()
        if line == FIRST_VIEWER:
            self._viewed.set()


def free_port() -> int:
    """A UDP port of this machine that is free now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _uncancel() -> None:
    task = asyncio.current_task()
    if task is not None:
        task.uncancel()


async def _wait_or_cancel(work: asyncio.Task[T], watching: asyncio.Task[str]) -> None:
    """Wait for one of two tasks; pass a cancellation on to the work, and wait for the result it may have."""
    try:
        await asyncio.wait({work, watching}, return_when=asyncio.FIRST_COMPLETED)
    except asyncio.CancelledError:
        work.cancel()
        await asyncio.wait({work})
        if work.cancelled():
            raise
        _uncancel()  # the work's result says that it was interrupted


async def until_standard_input_ends(work: Coroutine[object, object, T]) -> T | None:
    """Do some work until it is done; cancel it if standard input ends, because the parent has ended.

    Returns:
        The work's result; None if it was cancelled.
    """
    running = asyncio.create_task(work)
    watching = asyncio.create_task(_standard_input_ends())
    done, _ = await asyncio.wait({running, watching}, return_when=asyncio.FIRST_COMPLETED)
    for task in (running, watching):
        task.cancel()
    await asyncio.gather(running, watching, return_exceptions=True)
    return running.result() if running in done else None


async def _standard_input_ends() -> None:
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    while await reader.read(1024):
        pass


def end_with_standard_input(clean_up: Callable[[], None]) -> None:
    """Have this process, which has no event loop, clean up and end at once when standard input ends."""

    def watch() -> None:
        while os.read(0, 1024):
            pass
        clean_up()
        os._exit(1)

    threading.Thread(target=watch, name="lifeline", daemon=True).start()


def limit_resources(memory_bytes: int, processor_s: int) -> None:
    """Have this process fail with MemoryError, or be killed, above so much more memory or processor time."""
    with open("/proc/self/statm", encoding="ascii") as file:
        held_bytes = int(file.read().split()[5]) * resource.getpagesize()  # data and stacks
    for what, limit in (
        (resource.RLIMIT_DATA, held_bytes + memory_bytes),
        (resource.RLIMIT_CPU, processor_s),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(what)[1]
        wanted = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
        resource.setrlimit(what, (wanted, wanted))
