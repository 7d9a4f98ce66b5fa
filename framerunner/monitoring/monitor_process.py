"""The Game Monitor as a child process, with a link of its own to the drones."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from framerunner.flying.child_process import ChildProcess
from scenarios.loader import dump_yaml
from scenarios.models import Scenario

_START_S = 20.0


class MonitorProcess(ChildProcess):
    """`framerunner monitor` as a child process; what it says is said here.

    Args:
        scenario: for a drone that brings no referee; None if it does.
        runs: folder of flights to show again; None for the monitor's own choice.
        camera_hosts: HOST or HOST:PORT of cameras whose drones' packets come through this process.

    Attributes:
        link: where it listens; whoever speaks for the drones sends there, as `--link` takes it.
    """

    def __init__(
        self,
        scenario: Scenario | None = None,
        runs: Path | None = None,
        camera_hosts: Sequence[str] = (),
    ) -> None:
        port = _free_port()
        self.link = f"udpout://127.0.0.1:{port}"
        arguments = ["monitor", "--lifeline", "--drone", f"udpin://127.0.0.1:{port}"]
        self._folder = TemporaryDirectory(prefix="framerunner-monitor-")
        if scenario is not None:
            # It reads the very scenario that was checked, whatever becomes of its file.
            path = Path(self._folder.name) / "scenario.yaml"
            path.write_text(dump_yaml(scenario), encoding="utf-8")
            arguments += ["--scenario", str(path)]
        if runs is not None:
            arguments += ["--runs", str(runs)]
        for host in camera_hosts:
            arguments += ["--camera-host", host]
        self._open = asyncio.Event()
        self._watching: asyncio.Task[None] | None = None
        super().__init__("the monitor", arguments, self._relay)

    async def opened(self) -> None:
        """Wait until its page can be opened.

        Raises:
            SettingError: it could not start; its own words are the reason.
        """
        await self.guard(asyncio.create_task(self._until_open()))
        self._watching = asyncio.create_task(self._tell_of_its_end())

    async def __aexit__(self, *problem: object) -> None:
        """Stop it."""
        if self._watching is not None:
            self._watching.cancel()
            await asyncio.gather(self._watching, return_exceptions=True)
        await super().__aexit__(*problem)
        self._folder.cleanup()

    async def failed(self) -> str:
        """Return, when the monitor ends by itself, why; its options are not those of the command here."""
        said = await super().failed()
        return said.replace(
            "choose another with --port",
            "stop what listens there, or leave out --monitor and start framerunner monitor --port 8081",
        )

    async def stay(self) -> None:
        """When a person is there, let them look on until they press Ctrl-C; that ends nothing but this."""
        if not sys.stdin.isatty():
            return
        print("the monitor stays open (Ctrl-C ends it)", file=sys.stderr, flush=True)
        try:
            await self.failed()
        except asyncio.CancelledError:
            task = asyncio.current_task()
            if task is not None:
                task.uncancel()

    async def _tell_of_its_end(self) -> None:
        """An onlooker's end must not end a flight."""
        print(f"warning: {await self.failed()}", file=sys.stderr, flush=True)

    async def _until_open(self) -> None:
        with contextlib.suppress(TimeoutError):  # a slow machine may go on without
            await asyncio.wait_for(self._open.wait(), _START_S)

    def _relay(self, line: str) -> None:
        if not line.startswith("error: "):  # the reason of its end is told by whoever waits for it
            print(line, file=sys.stderr, flush=True)
        if "http://" in line:
            self._open.set()


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
