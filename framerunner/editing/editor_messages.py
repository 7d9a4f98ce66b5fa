"""What the editor's page and the server tell each other; `framerunner.editing.web` says when.

Times are vehicle time, seconds; places are arena axes, metres. A number that is not finite is null.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, StringConstraints, TypeAdapter

from framerunner.runs.track import StateSpan
from framerunner.wire.mission_report import GuardNow, Plain, ValueNow
from offboard.authoring import StrictModel
from offboard.chart.mission_texts import Language

MAX_TEXT = 100_000
"""Characters of a mission."""
MAX_COUNT = 200
"""Flights of one batch."""
MAX_STEPS = 10_000
MAX_SEED = 2**53 - 1
"""The largest whole number that browsers count exactly."""
MAX_BREAKS = 1000

_Name = Annotated[str, StringConstraints(pattern=r"^[a-z0-9][a-z0-9_-]{0,79}$")]
"""Of a scenario or level of the package; never a file."""
_Id = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_-]{1,40}$")]
_StateId = Annotated[str, Field(max_length=300)]
_Text = Annotated[str, Field(max_length=MAX_TEXT)]
_Seed = Annotated[int, Field(ge=0, le=MAX_SEED)]
_Speed = Annotated[float, Field(gt=0, le=100, allow_inf_nan=False)] | None
"""Vehicle seconds a second; null: as fast as possible."""
Json = dict[str, Any]


class _Request(StrictModel):
    """`tag` comes back with the answer; the language of its words is that of the page's connection."""

    tag: int = 0
    language: Language = "en"


class Start(_Request):
    """Fly a mission once, watched and controlled."""

    kind: Literal["start"]
    text: _Text
    scenario: _Name = "test-case-1"
    seed: _Seed = 0
    speed: _Speed = 1.0
    paused: bool = False
    break_on: tuple[_StateId, ...] = Field((), max_length=MAX_BREAKS)


class _OfRun(_Request):
    run: _Id


class Pause(_OfRun):
    """Wait before the next tick."""

    kind: Literal["pause"]


class GoOn(_OfRun):
    """End a pause."""

    kind: Literal["go_on"]


class Step(_OfRun):
    """Let ticks of the mission pass, then pause."""

    kind: Literal["step"]
    ticks: int = Field(1, ge=1, le=MAX_STEPS)


class Speed(_OfRun):
    """Fly faster or slower."""

    kind: Literal["speed"]
    speed: _Speed


class BreakOn(_OfRun):
    """Pause when one of these states is entered; replaces those named before."""

    kind: Literal["break_on"]
    states: tuple[_StateId, ...] = Field((), max_length=MAX_BREAKS)


class Change(_OfRun):
    """Go on with a changed mission in the same active state."""

    kind: Literal["change"]
    text: _Text


class Stop(_OfRun):
    """End a flight."""

    kind: Literal["stop"]


class Watch(_OfRun):
    """Be sent what a flight or the flights of a batch do; `run` may be a batch."""

    kind: Literal["watch"]


class StartBatch(_Request):
    """Fly a mission on random layouts of a level, or on scenarios."""

    kind: Literal["start_batch"]
    text: _Text
    level: _Name | None = "calm"
    count: int = Field(20, ge=1, le=MAX_COUNT)
    first_seed: _Seed = 1
    scenarios: tuple[_Name, ...] = Field((), max_length=MAX_COUNT)  # instead of a level


class Cancel(_Request):
    """End a batch; its results stay."""

    kind: Literal["cancel"]
    batch: _Id


class StartLive(_Request):
    """Fly a mission in a real simulator, seen on the live channel."""

    kind: Literal["start_live"]
    text: _Text
    scenario: _Name = "test-case-1"
    speed: Annotated[float, Field(ge=0.1, le=20, allow_inf_nan=False)] = 1.0


class StopLive(_Request):
    """End the flight in the real simulator."""

    kind: Literal["stop_live"]


Request = Annotated[
    Start
    | Pause
    | GoOn
    | Step
    | Speed
    | BreakOn
    | Change
    | Stop
    | Watch
    | StartBatch
    | Cancel
    | StartLive
    | StopLive,
    Field(discriminator="kind"),
]
REQUEST: TypeAdapter[Request] = TypeAdapter(Request)
Order = Pause | GoOn | Step | Speed | BreakOn | Change | Stop | Watch


class Taken(StrictModel):
    """A transition that was taken; `ids` has it and each `then` it led to."""

    ids: tuple[str, ...]
    source: str
    target: str
    when: str
    values: tuple[tuple[str, Plain], ...]
    time_s: float
    seconds: float  # in `source`


class Contact(StrictModel):
    """A first contact with a frame (its colour), a `pole` or a `wall`."""

    name: str
    time_s: float


class Started(StrictModel):
    """A flight was started; `layout` is the scenario, as its file has it."""

    kind: Literal["started"] = "started"
    tag: int
    run: str
    layout: Json


class Now(StrictModel):
    """What the chart does now.

    Attributes:
        full: `taken`, `counts`, `spans`, `contacts` and `trail` hold all so far and replace what was told
            before; otherwise what is new since the last message, and of `counts` those that changed.
        began_s: when the motors started, from which the referee counts; null before.
        active: full ids of the active states, outermost first.
        stopped_in: the state whose entry paused the flight; "" if something else did.
        taken: the newest hundred.
        spans: of states that were left; the present one is active since `time_s - seconds_in_state`.
        pose: x, y, z and yaw (rad).
        command: forward, left, up (m/s), yaw rate to the left (rad/s).
        trail: time, x, y, z.
    """

    kind: Literal["now"] = "now"
    run: str
    full: bool
    time_s: float
    began_s: float | None
    state: str
    active: tuple[str, ...]
    seconds_in_state: float
    paused: bool
    stopped_in: str
    speed: float | None
    guards: tuple[GuardNow, ...]
    values: tuple[ValueNow, ...]
    taken: tuple[Taken, ...]
    counts: dict[str, int]
    spans: tuple[StateSpan, ...]
    contacts: tuple[Contact, ...]
    pose: tuple[float | None, ...]
    command: tuple[float | None, ...]
    trail: tuple[tuple[float | None, ...], ...]


class Changed(StrictModel):
    """A changed mission took over; `ids` are the ids that transitions have now, by their ids before."""

    kind: Literal["changed"] = "changed"
    run: str
    tag: int
    ids: dict[str, str]


class Refused(StrictModel):
    """A request was refused; `text` is one line, `lines` are all problems of a mission."""

    kind: Literal["refused"] = "refused"
    tag: int
    text: str
    lines: tuple[str, ...] = ()
    run: str = ""


class Waiting(StrictModel):
    """A flight or batch waits until others are over.

    Attributes:
        run: by which it can be stopped, or the batch cancelled.
        place: in the line, from 1.
        seconds: until its turn, as far as those before it tell; null: not known.
    """

    kind: Literal["waiting"] = "waiting"
    tag: int
    run: str
    place: int
    seconds: int | None


class Ready(StrictModel):
    """A worker takes another batch."""

    kind: Literal["ready"] = "ready"


class Done(StrictModel):
    """A request was carried out."""

    kind: Literal["done"] = "done"
    tag: int


class Ended(StrictModel):
    """A flight is over. `result` is as `result.json`; null if a fault of the program ended it."""

    kind: Literal["ended"] = "ended"
    run: str
    text: str  # the verdict's reason, or what went wrong
    lost_in: str  # the state in which it was lost; "" if it was not
    result: Json | None
    counts: dict[str, int]
    spans: tuple[StateSpan, ...]


class FlownTrack(StrictModel):
    """Where a drone was: times since motors on, places, and the index in `states` of each sample's state."""

    time_s: tuple[float | None, ...] = ()
    x: tuple[float | None, ...] = ()
    y: tuple[float | None, ...] = ()
    z: tuple[float | None, ...] = ()
    state: tuple[int, ...] = ()
    states: tuple[str, ...] = ()


class BatchStarted(StrictModel):
    """A batch was started."""

    kind: Literal["batch_started"] = "batch_started"
    tag: int
    batch: str
    count: int


class Flight(StrictModel):
    """A flight of a batch has ended.

    Attributes:
        rank: failures first; sort by it.
        lost_in: the state in which it was lost or first touched something; "" if neither.
        cause: what happened, in one line; "" of a clean flight.
        layout: the scenario, as its file has it.
        counts: how often each transition was taken.
        result: as `result.json`.
        replay: name by which `/api/runs` has it; "" if it was not kept.
    """

    kind: Literal["flight"] = "flight"
    batch: str
    scenario: str
    seed: int
    verdict: str
    completed: bool
    reason: str
    cause: str
    lost_in: str
    rank: float
    total_time_s: float | None
    frames_crossed: tuple[str, ...]
    counts: dict[str, int]
    track: FlownTrack
    layout: Json
    result: Json
    replay: str


class BatchEnded(StrictModel):
    """A batch is over; `text` says why if not all were flown, `order` names the scenarios, failures first."""

    kind: Literal["batch_ended"] = "batch_ended"
    batch: str
    flown: int
    completed: int
    count: int
    text: str
    order: tuple[str, ...]


LiveState = Literal["starting", "flying", "ended", "stopped"]


class Live(StrictModel):
    """The flight in the real simulator; `text` says how it ended, or why it could not begin."""

    kind: Literal["live"] = "live"
    state: LiveState
    scenario: str
    speed: float
    text: str = ""


FromWorker = Annotated[
    Started | Now | Changed | Refused | Done | Ended | BatchStarted | Flight | BatchEnded | Ready,
    Field(discriminator="kind"),
]
FROM_WORKER: TypeAdapter[FromWorker] = TypeAdapter(FromWorker)


ToPage = (
    Started | Now | Changed | Refused | Waiting | Done | Ended | BatchStarted | Flight | BatchEnded | Live
)


class _WorkerTask(StrictModel):
    """What a worker process is given first.

    Attributes:
        pilot: a contestant's file, which is executed, or a pilot's name; only from the server's command line.
        keep: folder in which the flight's run folder is made, for replays; None: nowhere.
        processor_s: processor time of one flight.
        memory_bytes: beyond that of the libraries.
    """

    pilot: str | None
    keep: str | None
    processor_s: float
    memory_bytes: int


class RunTask(_WorkerTask):
    """Fly once, controlled by orders, one a line."""

    kind: Literal["run"] = "run"
    run: str
    start: Start


class BatchTask(_WorkerTask):
    """Fly many times, `jobs` at once."""

    kind: Literal["batch"] = "batch"
    batch: str
    start: StartBatch
    jobs: int


TASK: TypeAdapter[RunTask | BatchTask] = TypeAdapter(
    Annotated[RunTask | BatchTask, Field(discriminator="kind")]
)


class _Tagged(BaseModel):
    tag: int


TAGGED = TypeAdapter(_Tagged)
ORDER: TypeAdapter[Order] = TypeAdapter(Annotated[Order, Field(discriminator="kind")])
