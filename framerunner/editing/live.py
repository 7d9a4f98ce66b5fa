"""The real flight that pages may start: `framerunner fly` with its simulator, seen on the live channel.

There is one at a time. It is a child process, whose simulator is a child of its own; both end when this
program does, however that ends. Its files are in the folder of runs, so it can be replayed.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from pydantic import BaseModel

from framerunner.child_process import ChildProcess
from framerunner.editing import editor_messages
from framerunner.editing.places import find_scenario
from framerunner.editing.words import Said, reason
from framerunner.errors import SettingError, UserError
from framerunner.runs.run_files import RunFiles
from framerunner.wire.transports.urls import parse_url
from scenarios.loader import dump_yaml
from scenarios.result import ResultError

GROUND_PORT = 14550  # to which simulators always send
_MAX_REASON = 500


@dataclass(frozen=True, slots=True)
class LiveSettings:
    """How real flights are flown.

    Attributes:
        drone_url: where the monitor listens for drones.
        runs: folder of runs.
        pilot: a contestant's file or a pilot's name; None: there is none.
    """

    drone_url: str
    runs: Path
    pilot: str | None = None


class LiveFlight:
    """The flight, started and stopped by pages; call `close` at the end.

    Args:
        settings: how it is flown.
        tell: takes what all pages are told.

    Attributes:
        latest: what was told last; None before the first flight.
    """

    def __init__(self, settings: LiveSettings, tell: Callable[[BaseModel], None]) -> None:
        self._settings = settings
        self._tell = tell
        self._flying: asyncio.Task[None] | None = None
        self.latest: editor_messages.Live | None = None

    async def start(self, request: editor_messages.StartLive) -> Said | None:
        """Start a flight; returns why not, or None."""
        if self._flying is not None and not self._flying.done():
            return Said("live.busy")
        url = parse_url(self._settings.drone_url)
        if url.scheme != "udpin":
            return Said("live.no_link", url=url.text)
        claim = ExitStack()
        try:
            instance = await asyncio.to_thread(_claimed, claim)
        except SettingError:
            return Said("live.no_ports")
        link = () if url.number == GROUND_PORT else (f"udpout://127.0.0.1:{url.number}",)
        self._show(request, "starting")
        self._flying = asyncio.create_task(self._fly(request, instance, link))
        self._flying.add_done_callback(lambda _flown: claim.close())
        return None

    def stop(self) -> bool:
        """Stop the flight; returns whether there is one."""
        if self._flying is None or self._flying.done():
            return False
        self._flying.cancel()
        return True

    async def close(self) -> None:
        """Stop the flight and wait for the end of its processes."""
        if self.stop() and self._flying is not None:
            await asyncio.gather(self._flying, return_exceptions=True)

    async def _fly(self, request: editor_messages.StartLive, instance: int, links: tuple[str, ...]) -> None:
        text, stopped = "", False
        with TemporaryDirectory(prefix="framerunner-live-", ignore_cleanup_errors=True) as folder:
            try:
                before = await asyncio.to_thread(self._runs)
                arguments = await asyncio.to_thread(self._arguments, request, Path(folder), instance, links)
                text = await self._run(request, arguments)
                text = await asyncio.to_thread(self._verdict_of_new_run, before) or text
            except asyncio.CancelledError:
                stopped = True
            except UserError as error:
                text = reason(error, request.language)
            except OSError as error:
                text = str(error)
            finally:
                self._show(request, "stopped" if stopped else "ended", text[:_MAX_REASON])

    async def _run(self, request: editor_messages.StartLive, arguments: list[str]) -> str:
        """Fly to the end; returns the program's error, "" if it flew."""
        problem = ""

        def hear(line: str) -> None:
            nonlocal problem
            if line.startswith("error: "):
                problem = problem or line.removeprefix("error: ")
            elif self.latest is not None and self.latest.state == "starting":
                self._show(request, "flying")

        async with ChildProcess("the flight", arguments, hear) as child:
            how = await child.failed()
        return problem or how

    def _arguments(
        self, request: editor_messages.StartLive, folder: Path, instance: int, links: tuple[str, ...]
    ) -> list[str]:
        """Write what is flown to files, so that it is what was checked; returns the command's words."""
        scenario, mission = folder / "scenario.yaml", folder / "mission.yaml"
        scenario.write_text(dump_yaml(find_scenario(request.scenario)), encoding="utf-8")
        mission.write_text(request.text, encoding="utf-8")
        pilot = self._settings.pilot
        return [
            *("fly", str(scenario), "--mission", str(mission), "--speed", f"{request.speed:g}"),
            *("--instance", str(instance), "--out", str(self._settings.runs), "--lifeline"),
            *(word for link in links for word in ("--monitor-link", link)),
            *(() if pilot is None else ("--pilot", pilot)),
        ]

    def _runs(self) -> set[str]:
        try:
            return {each.name for each in self._settings.runs.iterdir()}
        except OSError:
            return set()

    def _verdict_of_new_run(self, before: set[str]) -> str:
        """The verdict's reason of the run that is new; "" if there is none."""
        for name in sorted(self._runs() - before, reverse=True):
            with suppress(OSError, ResultError):
                result = RunFiles(self._settings.runs / name).load_result()
                if result is not None:
                    return result.reason
        return ""

    def _show(
        self, request: editor_messages.StartLive, state: editor_messages.LiveState, text: str = ""
    ) -> None:
        shown = editor_messages.Live(state=state, scenario=request.scenario, speed=request.speed, text=text)
        self.latest = shown
        self._tell(shown)


def _claimed(claim: ExitStack) -> int:
    """An instance of the simulated drone, until the claim is closed; SettingError: there is none."""
    from framerunner.instances import claimed_instance

    return claim.enter_context(claimed_instance())
