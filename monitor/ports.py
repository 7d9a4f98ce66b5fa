"""What the monitor is given by whoever starts it; it opens no link and knows no referee of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from errors import UserError
from scenarios.models import Scenario, TrueState
from scenarios.result import RefereeReport, RefereeSnapshot

Message = Any  # pymavlink's classes are made by a generator and carry no types


class Link(Protocol):
    """A MAVLink link, read and written from one thread.

    Attributes:
        url: as given.
        host: in numbers, from which came what was received last; "" over a wire.
    """

    url: str

    @property
    def host(self) -> str:
        """See above."""
        ...

    def receive(self, timeout_s: float) -> list[Message]:
        """Wait for messages of any system; empty if none came in time. Raises `LinkError`."""
        ...

    def send(self, message: Message) -> None:
        """Send to the message's `target_system` or, if it has none or 0, to everybody heard so far."""

    def close(self) -> None:
        """Let go."""


class Referee(Protocol):
    """Judges a flight by the states it is shown (`scenarios.referee.Referee` is one)."""

    def update(self, state: TrueState) -> None:
        """Look at the next state."""

    def snapshot(self) -> RefereeSnapshot:
        """How the try stands now."""
        ...

    def report(self, mission_state: str = "", ended: str | None = None) -> RefereeReport:
        """Judge what was seen so far."""
        ...


@dataclass(frozen=True, slots=True)
class RunInfo:
    """A run folder, for a list.

    Attributes:
        name: of the folder; names the run everywhere.
        scenario: its name.
        mission: its name; "" if unknown.
        verdict: of the referee; "" if the flight was not judged.
        total_time_s: with penalties; None if not judged.
        started: ISO 8601; "" if unknown.
    """

    name: str
    scenario: str
    mission: str
    verdict: str
    total_time_s: float | None
    started: str


class RunLibrary(Protocol):
    """The flights that can be shown again. Call it in a thread; reading a run may take seconds."""

    def runs(self) -> Sequence[RunInfo]:
        """All runs, newest first."""
        ...

    def recording(self, name: str) -> Mapping[str, Any]:
        """A run as `docs/monitor-channels.md` says, read if it was not. Raises `RunError` with one line."""
        ...

    def kept(self, name: str) -> Mapping[str, Any] | None:
        """A run that needs no reading; None if it does. Raises `RunError` if there is no such run."""
        ...

    def image(self, name: str, index: int) -> bytes:
        """A JPEG of its camera. Raises `RunNotReadError` if the run is to be read first, else `RunError`."""
        ...

    def close(self) -> None:
        """Break off what is being read, and read nothing more."""


class RunError(UserError):
    """A run that cannot be shown; the message is one line for people."""


class RunNotReadError(RunError):
    """A run of which nothing can be had before it has been read."""


@dataclass(frozen=True, slots=True)
class Equipment:
    """All that the monitor is given.

    Attributes:
        open_link: opens the link to the drones; called again when it failed. Raises `LinkError`.
        make_referee: for a drone that brings none, following its telemetry.
        scenario: what is flown, if the one who starts the monitor said so.
        list_scenarios: names that can be drawn.
        load_scenario: one of them; raises `ScenarioError`.
        runs: flights to show again; None if there is no such folder.
        start_pose: where a scenario's drone stands at first: its centre (m) and yaw (rad), arena axes; None:
            a drone that brings no referee cannot be judged.
        camera_hosts: HOST or HOST:PORT from which video and referee may be fetched although a drone's packets
            come from elsewhere.
    """

    open_link: Callable[[], Link]
    make_referee: Callable[[Scenario], Referee]
    scenario: Scenario | None
    list_scenarios: Callable[[], Sequence[str]]
    load_scenario: Callable[[str], Scenario]
    runs: RunLibrary | None
    start_pose: Callable[[Scenario], tuple[float, float, float, float]] | None = None
    camera_hosts: tuple[str, ...] = ()
