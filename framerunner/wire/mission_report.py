"""What a mission does now: one model for the app that flies it and for all who are told.

The engine makes transitions, guards and their values; reports over MAVLink, recordings, the editor's page and
the monitor's pages hold the same. The documents are those that an app sends, see
`framerunner.wire.mission_tunnel`; a reader that gets them from outside checks them with pydantic's
`TypeAdapter`, which leaves fields out that it does not know, so that newer apps can send more.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from math import nan
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from framerunner.wire.finite_json import finite

MAX_NAME = 200
MAX_GUARD = 2000
_MAX_TEXT = 80  # characters of a guard's value that is not a number
_DIGITS = 6  # of a guard's value in a report: more would take more pieces, and so longer to arrive
_EXACT = 2**53  # larger integers lose digits in some JSON readers

Json = dict[str, Any]
Plain = float | bool | int | str | None
"""A value of a guard."""
Name = Annotated[str, Field(max_length=MAX_NAME)]
Crc = Annotated[int, Field(ge=0, lt=2**32)]
"""Of the MISSION document to which another one belongs."""
TimeUs = Annotated[int, Field(ge=0, le=2**53)]
_Seconds = Annotated[float, BeforeValidator(lambda value: nan if value is None else value)]
_Metres = Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
_Deviation = Annotated[float, Field(ge=0, le=1000, allow_inf_nan=False)]
_Size = Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)]
_Radians = Annotated[float, Field(ge=-7, le=7, allow_inf_nan=False)]
_Point = tuple[_Metres, _Metres, _Metres]
_Text = Annotated[str, Field(max_length=80)]


@dataclass(frozen=True, slots=True)
class TransitionTaken:
    """A change of state, and why.

    Attributes:
        source: full id of the leaf that was left.
        target: full id of the present state; if a superstate was finished, the state after it.
        when: the guard that held; "" for a transition without one, "done" if a superstate was finished,
            "resume" after a pause.
        values: each name of the guard that held with its value then, such as ("frame.d", 0.44), in the order
            of the guard; a name that could not be read is left out.
        time_us: vehicle time.
        seconds_in_source: vehicle time without pauses; NaN if it is not known.
        ids: the transition, and then each `then` that it led to; see `offboard.chart.spec.transition_id`.
            Older apps and recordings have none.
    """

    source: Annotated[Name, Field(alias="from")] = ""
    target: Annotated[Name, Field(alias="to")] = ""
    when: Annotated[str, Field(max_length=MAX_GUARD)] = ""
    values: Annotated[tuple[tuple[Name, Plain], ...], Field(max_length=100)] = ()
    time_us: Annotated[int, Field(ge=0, le=2**63)] = 0
    seconds_in_source: Annotated[_Seconds, Field(alias="seconds")] = nan
    ids: Annotated[tuple[Name, ...], Field(max_length=100)] = ()

    def as_json(self) -> Json:
        """All but its time, which each medium has in its own way; numbers may be infinite or NaN."""
        return {
            "from": self.source[:MAX_NAME],
            "to": self.target[:MAX_NAME],
            "when": self.when[:MAX_GUARD],
            "values": [[name[:MAX_NAME], rounded(value)] for name, value in self.values],
            "seconds": round(self.seconds_in_source, 3),
            "ids": [name[:MAX_NAME] for name in self.ids],
        }


@dataclass(frozen=True, slots=True)
class GuardNow:
    """A transition out of the active states, and whether its guard holds.

    Attributes:
        id: of the transition, see `offboard.chart.spec.transition_id`.
        to: full id of its target.
        when: its guard; "" for a transition without one.
        holds: None if the guard cannot be evaluated now.
    """

    id: str
    to: str
    when: str
    holds: bool | None


@dataclass(frozen=True, slots=True)
class ValueNow:
    """A value that a guard reads.

    Attributes:
        name: as the guard has it, such as "frame.d".
        unit: such as "m"; "" if it has none or none is known.
    """

    name: str
    value: Plain
    unit: str


@dataclass(frozen=True, slots=True)
class MissionDocument:
    """The MISSION document: what is flown; parts that would make it too large are empty."""

    name: Name = ""
    description: str = ""
    scenario: str = ""
    states: Annotated[tuple[Name, ...], Field(max_length=2000)] = ()
    mermaid: str = ""
    source: str = ""


@dataclass(frozen=True, slots=True)
class HistoryDocument:
    """The HISTORY document: the last transitions, the newest last."""

    transitions: Annotated[tuple[TransitionTaken, ...], Field(max_length=100)] = ()


@dataclass(frozen=True, slots=True)
class GuardsDocument:
    """The GUARDS document.

    Attributes:
        counts: how often each transition was taken.
        guards: ids of the transitions out of the active states, and whether each holds.
        values: name, value and unit.
    """

    mission_crc: Crc = 0
    time_us: TimeUs = 0
    counts: Annotated[dict[Name, Annotated[int, Field(ge=0, le=2**53)]], Field(max_length=1000)] = field(
        default_factory=dict
    )
    guards: Annotated[tuple[tuple[Name, bool | None], ...], Field(max_length=100)] = ()
    values: Annotated[tuple[tuple[Name, Plain, Name], ...], Field(max_length=100)] = ()


@dataclass(frozen=True, slots=True)
class MappedFrame:
    """A frame as estimated, in arena axes; a standard deviation that is not known is None.

    `size` is its outer width and height; older apps do not tell it.
    """

    colour: _Text
    p: _Point
    yaw: _Radians
    std: tuple[_Deviation, _Deviation, _Deviation] | None = None
    yaw_std: _Deviation | None = None
    certain: bool = False
    ambiguous: bool = False
    views: Annotated[int, Field(ge=0, le=2**31)] = 0
    size: tuple[_Size, _Size] | None = None


@dataclass(frozen=True, slots=True)
class EstimatedPlace:
    """Where an app itself has estimated its drone to be, in arena axes, with standard deviations."""

    p: _Point
    yaw: _Radians
    std: tuple[_Deviation, _Deviation, _Deviation]
    yaw_std: _Deviation


@dataclass(frozen=True, slots=True)
class MapDocument:
    """The MAP document: the navigator's goal, map and planned path.

    `place` is None if it believes what the vehicle reports; older apps do not tell it.
    """

    mission_crc: Crc = 0
    time_us: TimeUs = 0
    goal: _Text = ""
    frames: Annotated[tuple[MappedFrame, ...], Field(max_length=50)] = ()
    path: Annotated[tuple[_Point, ...], Field(max_length=100)] = ()
    place: EstimatedPlace | None = None

    def as_json(self) -> Json:
        """What it says, without mission and time."""
        frames = [asdict(each) for each in self.frames]
        place = None if self.place is None else asdict(self.place)
        content: Json = finite({"goal": self.goal, "frames": frames, "path": self.path, "place": place})
        return content


def plain_value(value: object) -> Plain:
    """A value that a guard has read, with all its digits; a contestant's pilot may hold any type."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int) and abs(value) < _EXACT:
        return int(value)
    try:
        if not isinstance(value, str) and hasattr(value, "__float__"):
            return float(value)
        return str(value)[:_MAX_TEXT]
    except Exception:  # any that a contestant's conversion raises
        return type(value).__name__


def rounded(value: Plain) -> Plain:
    """A value of a guard as reports have it."""
    return float(f"{value:.{_DIGITS}g}") if isinstance(value, float) else value
