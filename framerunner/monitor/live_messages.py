"""The messages of the live channel, see `docs/monitor-channels.md`; the pages' types are made of them.

Numbers are null where they are not finite.
"""

from __future__ import annotations

from typing import (
    Any,
    Literal,
    NotRequired,  # pydantic needs it before Python 3.12
)

from typing_extensions import TypedDict

from framerunner.wire.mission_report import EstimatedPlace, MappedFrame, Plain, ValueNow

Number = float | None
Vector = tuple[float, float, float]


class World(TypedDict):
    """The scenario that is flown, as its file has it; null: not known."""

    kind: Literal["world"]
    scenario: dict[str, Any] | None
    lift_m: float
    source: str


class DronePose(TypedDict):
    """Where a drone is: arena axes, metres, velocity forward, left, up, turn rate to the left.

    `p` is as the vehicle reports; `truth` is where a simulated drone truly is, null if that is not known.
    """

    id: int
    t: float
    p: Vector
    truth: Vector | None
    q: tuple[float, float, float, float]
    v: Vector | None
    r: Number
    c: list[Number] | None
    on: bool
    s: int
    fresh: bool


class Poses(TypedDict):
    """Where all drones are."""

    kind: Literal["pose"]
    drones: list[DronePose]


class LinkStatus(TypedDict):
    """How well a drone is heard."""

    state: Literal["live", "stale", "lost"]
    age_s: float
    loss_percent: Number
    rate_hz: Number


class MissionStatus(TypedDict):
    """What a drone's mission does."""

    name: str
    state: str
    seconds: float
    transitions: int
    paused: bool
    flying: bool
    finished: bool
    alive: bool


class ActiveFault(TypedDict):
    """A fault that has begun."""

    fault: str
    active: bool


class Figures(TypedDict):
    """How a try stands; `final`: as the app's result says."""

    try_time_s: Number
    penalty_s: Number
    total_time_s: Number
    limit_s: Number
    time_over: bool
    crossed: list[str]
    crossing_times_s: list[Number]
    next_colour: str | None
    contacts: int | None
    inside: bool
    motors_on: bool
    over: bool
    verdict: str
    reason: str
    source: str
    final: bool
    faults: NotRequired[list[ActiveFault]]
    failsafe: NotRequired[str]


class DroneStatus(TypedDict):
    """What is known of a drone."""

    id: int
    name: str
    mode: str
    armed: bool
    landed: bool | None
    battery_percent: Number
    voltage_v: Number
    link: LinkStatus
    mission: MissionStatus | None
    pilot: str
    figures: Figures | None
    video: bool
    over: bool


class Status(TypedDict):
    """What is known of all drones."""

    kind: Literal["status"]
    drones: list[DroneStatus]


class FlightHistory(TypedDict):
    """A drone's flight so far; each row is a sample."""

    kind: Literal["history"]
    id: int
    poses: list[list[Number]]


class Detections(TypedDict):
    """What was detected in an image: n, s, e, w, d, a of each colour; null: not seen."""

    kind: Literal["detections"]
    id: int
    t: Number
    width: int
    height: int
    boxes: dict[str, list[Number] | None]


class Map(TypedDict):
    """What a navigator knows and plans; `place` is null if it believes what its vehicle reports."""

    kind: Literal["map"]
    id: int
    t: float
    goal: str
    frames: list[MappedFrame]
    path: list[Vector]
    place: EstimatedPlace | None


class Chart(TypedDict):
    """A drone's mission: its diagram, the ids of its states, and its text."""

    kind: Literal["chart"]
    id: int
    name: str
    mermaid: str
    states: list[str]
    source: str


Transition = TypedDict(
    "Transition",
    {
        "time_s": float,
        "from": str,
        "to": str,
        "when": str,
        "values": list[tuple[str, Plain]],
        "seconds": float,
        "ids": list[str],
    },
)


class Transitions(TypedDict):
    """The last transitions of a mission, newest first."""

    kind: Literal["transitions"]
    id: int
    list: list[Transition]


class GuardState(TypedDict):
    """Whether a transition's guard holds; null: it cannot be evaluated now."""

    id: str
    holds: bool | None


class Guards(TypedDict):
    """The guards of a mission's active states, and how often each transition was taken."""

    kind: Literal["guards"]
    id: int
    time_s: float
    counts: dict[str, int]
    guards: list[GuardState]
    values: list[ValueNow]


Text = TypedDict(
    "Text",
    {
        "kind": Literal["text"],
        "id": int,
        "time_s": float,
        "severity": int,
        "text": str,
        "from": Literal["drone", "mission"],
    },
)


class Notice(TypedDict):
    """What the monitor itself reports, of a drone or of none."""

    kind: Literal["notice"]
    id: int | None
    level: Literal["info", "warning", "error"]
    text: str


LiveMessage = (
    World | Poses | Status | FlightHistory | Detections | Map | Chart | Transitions | Guards | Text | Notice
)
