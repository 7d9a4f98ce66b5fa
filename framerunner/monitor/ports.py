"""What the monitor is given at its start; it opens no link and contains no referee."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from framerunner.errors import UserError
from framerunner.wire.transports.vehicle_link import VehicleLink
from scenarios.models import Scenario, TrueState
from scenarios.result import RefereeReport, RefereeSnapshot

if TYPE_CHECKING:  # slow to import
    from fastapi import APIRouter
    from starlette.requests import HTTPConnection

    from framerunner.monitor.access import Visitor


class RefereePort(Protocol):
    """Judges a flight by its states; `scenarios.referee.RefereePort` is one."""

    def update(self, state: TrueState) -> None:
        """Take the next state."""

    def snapshot(self) -> RefereeSnapshot:
        """How the try stands now."""
        ...

    def report(self, mission_state: str = "", ended: str | None = None) -> RefereeReport:
        """Judge the states so far."""
        ...


@dataclass(frozen=True, slots=True)
class RunInfo:
    """A run folder, for a list."""

    name: str  # of the folder; identifies the run everywhere
    scenario: str
    mission: str  # "" if unknown
    verdict: str  # of the referee; "" if the flight was not judged
    total_time_s: float | None  # with penalties; None if not judged
    started: str  # ISO 8601; "" if unknown
    session: bool = False  # flown from a page of this program; kept until it ends


class RunLibrary(Protocol):
    """Recorded flights. Call it in a thread; reading a run may take seconds."""

    def runs(self) -> Sequence[RunInfo]:
        """All runs, newest first."""
        ...

    def recording(self, name: str) -> Mapping[str, Any]:
        """A run as in `docs/monitor-channels.md`, read if necessary. Raises `RunError` with one line."""
        ...

    def kept(self, name: str) -> Mapping[str, Any] | None:
        """A run that was read before; None if it was not. Raises `RunError` if there is no such run."""
        ...

    def image(self, name: str, index: int) -> bytes:
        """A JPEG of its camera. Raises `RunNotReadError` if the run has to be read first, else `RunError`."""
        ...

    def close(self) -> None:
        """Stop reading, and read nothing more."""


class RunError(UserError):
    """A run that cannot be shown; the message is one line for people."""


class RunNotReadError(RunError):
    """A run that has to be read before its images can be had."""


class ServerExtension(Protocol):
    """Addresses of the server that another room adds, such as the editor's flights."""

    def router(self, who: Callable[[HTTPConnection], Visitor]) -> APIRouter:
        """The addresses; `who` tells who has sent a request or opened a WebSocket, and what they may do."""
        ...

    async def run(self) -> None:
        """Serve until cancelled, then end all that was started."""


@dataclass(frozen=True, slots=True)
class Equipment:
    """What the monitor is given.

    Attributes:
        open_link: opens the link to the drones; called again when it failed. Raises `LinkError`.
        make_referee: for a drone without one of its own; follows its telemetry.
        scenario: what is flown, if that was specified when the monitor was started.
        list_scenarios: names that can be drawn.
        load_scenario: one of them, or of another name, never a path; raises `ScenarioError`.
        scenario_argument: what `framerunner fly` is given to fly one of them.
        runs: recorded flights; None if there is no such folder.
        start_pose: where a scenario's drone stands at first: its centre (m) and yaw (rad), arena axes; None:
            a drone without a referee of its own cannot be judged.
        camera_hosts: HOST or HOST:PORT from which video and referee may be fetched although a drone's packets
            come from elsewhere.
        extensions: more addresses.
    """

    open_link: Callable[[], VehicleLink]
    make_referee: Callable[[Scenario], RefereePort]
    scenario: Scenario | None
    list_scenarios: Callable[[], Sequence[str]]
    load_scenario: Callable[[str], Scenario]
    runs: RunLibrary | None
    start_pose: Callable[[Scenario], tuple[float, float, float, float]] | None = None
    camera_hosts: tuple[str, ...] = ()
    extensions: tuple[ServerExtension, ...] = ()
    scenario_argument: Callable[[str], str] = str
