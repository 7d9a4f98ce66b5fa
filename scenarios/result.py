"""A referee's report on a try and the result of a flight: types, JSON, JSON Schema, cells of a CSV file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import CoreSchema

from framerunner.errors import UserError
from scenarios.crossing import Side
from scenarios.models import MissionClass
from scenarios.verdict import Verdict

MAX_RESULT_BYTES = 1_000_000
_MAX_TEXT = 2000  # characters; a longer text is cut


def _limit_text(value: object) -> object:
    """Make a text that can be written to any file: cut, and without half a surrogate pair."""
    return value[:_MAX_TEXT].encode("utf-8", "replace").decode() if isinstance(value, str) else value


_LIMITS: dict[str, Any] = {"strict": True, "allow_inf_nan": False, "le": 1e9}
Seconds = Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "s"}, **_LIMITS)]
Metres = Annotated[float, Field(ge=-1e9, json_schema_extra={"unit": "m"}, **_LIMITS)]
Ratio = Annotated[float, Field(ge=0.0, **_LIMITS)]
Count = Annotated[int, Field(ge=0, le=10**9, strict=True)]
Flag = Annotated[bool, Field(strict=True)]
Text = Annotated[str, BeforeValidator(_limit_text)]
Ended = Literal["finished", "timed out", "aborted", "error", ""]


class ResultError(UserError):
    """An invalid result; the message is one line: field, then reason."""


@dataclass(frozen=True, slots=True)
class RefereeSnapshot:
    """How the try stands now, for displays."""

    began_us: int | None  # vehicle time of motors on; None before
    try_time_s: Seconds  # from motors on to motors off, or to now
    penalty_s: Seconds
    crossed: Annotated[tuple[Text, ...], Field(max_length=10)]  # colours
    next_colour: Text | None  # the gate to cross next; None when all are crossed
    contacts: int  # with gates and obstacles
    inside: bool  # the drone is inside the arena
    motors_on: bool
    settled: bool  # motors off and at rest
    over: bool  # no later state can change the verdict


class _Record(BaseModel):
    """Frozen and finite; fields of other versions are ignored."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


class RefereeReport(_Record):
    """What a try was worth, as judged by a referee."""

    verdict: Verdict = Field(description="see docs/evaluation.md; `error` occurs in evaluations only")
    reason: Text = Field("", description="one sentence with the mission's state")
    frames_crossed: tuple[Text, ...] = Field(
        (), max_length=10, description="colours in order of their first crossing, wrong ones included"
    )
    crossing_times_s: tuple[Seconds, ...] = Field(
        (), max_length=10, description="since motors on, one for each of frames_crossed"
    )
    crossing_offsets_m: tuple[Metres, ...] = Field(
        (), max_length=10, description="from the opening's centre, in its plane, one for each"
    )
    crossing_sides: tuple[Side, ...] = Field(
        (), max_length=10, description="the side the drone came from, one for each"
    )
    goal_times_s: tuple[Seconds, ...] = Field(
        (),
        max_length=20,
        description="when the scenario's goals were reached, since motors on, in their order",
    )
    contacts: Count = Field(0, description="number of contacts with frames and obstacles")
    contact_frames: tuple[Text, ...] = Field(
        (), max_length=10_000, description="what was touched, in order: a frame's colour, `pole` or `wall`"
    )
    contact_times_s: tuple[Seconds, ...] = Field(
        (), max_length=10_000, description="since motors on, one for each of contact_frames"
    )
    outside_s: Seconds = Field(0.0, description="time outside the arena with motors on")
    try_time_s: Seconds = Field(
        0.0, description="from motors on to motors off, or to the end of the watch; at most the limit"
    )
    penalty_s: Seconds = Field(0.0, description="one second for each second outside")
    total_time_s: Seconds = Field(0.0, description="try time and penalty")
    landed_on_base: Flag = Field(False, description="standing on the base, motors off")
    landing_error_m: Metres | None = Field(
        None, description="plan distance from the base's centre; null when it did not land"
    )
    path_length_m: Metres = Field(0.0, description="flown with motors on")
    ignored_states: Count = Field(0, description="states that were not finite or went back in time")
    longest_gap_s: Seconds = Field(0.0, description="longest time between two states of the try")

    @property
    def completed(self) -> bool:
        """All gates crossed in order, and landed on the base within the limit."""
        return self.verdict in (Verdict.CLEAN, Verdict.COMPLETED)

    @property
    def times_s(self) -> dict[str, float]:
        """Time of each colour's crossing since motors on; empty if colours and times differ in number."""
        if len(self.frames_crossed) != len(self.crossing_times_s):
            return {}
        return dict(zip(self.frames_crossed, self.crossing_times_s, strict=True))

    @classmethod
    def from_outside(cls, content: object) -> Self | None:
        """Read what was received, as `json.loads` returns it; a field with an invalid value is left out.

        Returns:
            None if it has no valid verdict.
        """
        for _ in range(2):
            try:
                return cls.model_validate(content)
            except ValidationError as error:
                bad = {each["loc"][0] for each in error.errors(include_url=False) if each["loc"]}
                if not isinstance(content, dict):
                    break
                content = {name: value for name, value in content.items() if name not in bad}
        return None

    def as_json(self) -> dict[str, Any]:
        """The fields that were set, in order, as plain data for JSON."""
        return self.model_dump(mode="json", exclude_unset=True)


class Timing(_Record):
    """Whether the machine kept up with a flight in real time."""

    kept_up: Flag = Field(description="nothing was late and the requested speed was reached")
    vehicle_time_waits: Flag = Field(description="the simulator's time waits for the app at each tick")
    speed: Ratio = Field(description="vehicle time per wall time, divided by the requested speed")
    ticks: Count = Field(0, description="ticks of the flight, late ones included")
    late_ticks: Count = Field(description="ticks of the mission that were late: passed over or lost")
    late_share: Ratio = Field(0.0, description="late_ticks of ticks")
    late_images: Count = Field(description="images received after the tick they were for")
    late_setpoints: Count = Field(description="setpoints received after the tick they were for")
    oldest_image_s: Seconds = Field(description="age of the oldest image that a tick had to use")
    words: Text = Field("", description="one sentence if the machine did not keep up")


class BegunFault(_Record):
    """A fault that has begun in a try."""

    fault: Text  # in one line, with its time since arming
    began_us: int  # vehicle time
    ended_us: int | None = None  # None: it is active


class FailsafeText(_Record):
    """A failsafe of the autopilot that changed what it flies."""

    time_us: int  # vehicle time
    text: Text  # its status text


class FaultFacts(_Record):
    """The faults of a try, and the autopilot's failsafes; oldest first."""

    begun: tuple[BegunFault, ...] = Field((), max_length=1000)
    failsafes: tuple[FailsafeText, ...] = Field((), max_length=1000)
    autopilot: Text = ""  # PX4 or ArduPilot, if a genuine one flies the simulated drone


class _Flown(_Record):
    """What was flown; the first fields of a result."""

    scenario: Text = Field("", description="name of the scenario")
    mission: Text = Field("", description="name of the mission")
    seed: int | None = Field(
        None, strict=True, description="of everything random in a lockstep flight; null in real time"
    )
    mission_class: MissionClass = Field(
        "contest", description="by which limits it flew; only `contest` counts in a competition"
    )


class FlightResult(RefereeReport, _Flown):
    """The result of a flight, as `result.json` has it.

    A field that was never set is not written: `state_sha256` is set in lockstep flights; `timing`, and
    `lift_m` where frames were lifted, in real time; recordings have no wall times.
    """

    cause: Text = Field("", description="why the flight was not clean, or its mission broken off; else empty")
    mission_state: Text = Field("", description="the mission's last state, such as red.turning")
    ended: Ended = Field("", description="how the mission ended; `error` occurs in evaluations only")
    seconds_in_state: dict[Text, Seconds] = Field(
        default_factory=dict, max_length=10_000, description="time spent in each kind of state"
    )
    kept_in_box_s: Seconds = Field(
        0.0, description="time during which commands were changed to keep the drone in its box"
    )
    bound_s: Seconds | None = Field(
        None, description="no try of this scenario and class is shorter, see docs/bound.md; null if not known"
    )
    times_bound: Ratio | None = Field(None, description="try time divided by bound_s; null if not completed")
    judged_by: Text = Field("", description="source of the referee's states: truth or telemetry")
    response: Text = Field(
        "", description="how late the simulated vehicle answered, as by --response; empty: not late"
    )
    autopilot: Text = Field(
        "", description="PX4 or ArduPilot, if a genuine one flew the simulated drone; empty otherwise"
    )
    faults: tuple[Text, ...] = Field(
        (), max_length=1000, description="faults that began, each as in --fault; its time counts from arming"
    )
    fault_reaction: Text = Field(
        "", description="the first failsafe after the first fault, and how long after it; empty: none"
    )
    fault_expected: Text = Field(
        "", description="how docs/faults.md says that such a flight ends; empty: it has no row for it"
    )
    fault_outcome: Literal["as expected", "not as expected", ""] = Field(
        "", description="whether it ended so; empty: nothing was expected"
    )
    place_errors_m: tuple[Metres, ...] = Field(
        (),
        max_length=10,
        description="how far from the true place that was by which the drone was flown (estimated by the app "
        "or, if it estimated none, reported by the vehicle), one for each of crossing_times_s",
    )
    last_place_error_m: Metres | None = Field(
        None, description="likewise when the motors stopped; null if it is not known"
    )
    largest_place_std_m: Metres | None = Field(
        None,
        description="standard deviation of the place estimated by the app, of x, y or z, when largest; null: "
        "it estimated none",
    )
    largest_reported_error_m: Metres | None = Field(
        None,
        description="how far from the true place that was which the vehicle reported, at most; null if it "
        "is not known",
    )
    false_gates: Count | None = Field(
        None,
        description="places at which the app's map had a certain gate, farther than 1 m from every frame of "
        "its colour; null if the mission has no map",
    )
    state_sha256: str = Field(
        "", max_length=64, description="over the true state of every control tick of a lockstep flight"
    )
    lift_m: Metres = Field(
        0.0, description="how much higher than in the scenario the frames were, for lack of a base"
    )
    timing: Timing | None = Field(None, description="of a flight in real time")
    version: Text = Field("", description="of the framerunner that flew")
    wall_time_s: Seconds | None = Field(None, description="wall time from the first to the last tick")
    real_time_factor: Ratio | None = Field(
        None, description="vehicle time per wall time; null before two ticks"
    )
    started: Text = Field("", description="when the flight began, ISO 8601, UTC")

    @classmethod
    def parse(cls, text: str | bytes) -> Self:
        """Read the text of a `result.json`.

        Raises:
            ResultError: it is too long, no JSON, or a field is invalid.
        """
        if len(text) > MAX_RESULT_BYTES:
            raise ResultError(f"larger than {MAX_RESULT_BYTES} bytes")
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            raise ResultError(first_error(error)) from None

    def text(self) -> str:
        """The text of a `result.json`.

        Raises:
            ValueError: a number is not finite.
        """
        return json.dumps(self.as_json(), indent=2, allow_nan=False) + "\n"


class LocalFrame(_Record):
    """A vehicle's local frame in the arena: position of its origin, and yaw of its north axis."""

    origin_arena_m: tuple[Metres, Metres, Metres]
    yaw_rad: float = 0.0


class StandingPlace(_Record):
    """Where a drone stands: position of its centre, and its heading, arena axes."""

    position_arena_m: tuple[Metres, Metres, Metres]
    yaw_rad: float


TimedPosition: TypeAlias = tuple[float, float, float, float]  # seconds since motors on, arena metres


class Standing(_Record):
    """How a try stands, as `/referee.json` has it."""

    scenario: str = Field(max_length=80)  # its name; "" if unknown
    source: str = Field("truth", max_length=40)  # of the referee's states: "truth" or "telemetry"
    lift_m: Metres = 0.0  # how much higher than in the scenario the gates are
    time_us: int | None = None  # vehicle time
    local_frame: LocalFrame | None = None  # None while it is unknown
    stands_at: StandingPlace | None = (
        None  # None if it does not stand upright with its motors off, or unknown
    )
    position_arena_m: tuple[Metres, Metres, Metres] | None = None  # where it truly is; None if unknown
    snapshot: RefereeSnapshot
    report: RefereeReport  # what the try would be worth if it ended now
    faults: FaultFacts = FaultFacts()
    flown_path: tuple[TimedPosition, ...] = ()  # every 0.1 s; only if a report was asked for

    @property
    def ended(self) -> bool:
        """Whether the try is over: judged, or the motors off and at rest."""
        now = self.snapshot
        return now.began_us is not None and (now.over or (now.settled and not now.motors_on))


def first_error(error: ValidationError) -> str:
    """The first error in one line: field, then reason."""
    first = error.errors(include_url=False, include_input=False)[0]
    return f"{'.'.join(str(step) for step in first['loc'])}: {first['msg']}".removeprefix(": ")


_OPTIONAL = (
    "place_errors_m",
    "last_place_error_m",
    "largest_place_std_m",
    "largest_reported_error_m",
    "false_gates",
    "state_sha256",
    "lift_m",
    "timing",
    "wall_time_s",
    "real_time_factor",
    "started",
)


class _SchemaWithoutTitles(GenerateJsonSchema):
    """Leaves out titles, which only repeat the names of fields."""

    def field_title_should_be_set(self, schema: CoreSchema) -> bool:
        """Never."""
        return False


def json_schema() -> str:
    """The JSON Schema of `result.json`, as `docs/result.schema.json` has it."""
    schema = FlightResult.model_json_schema(schema_generator=_SchemaWithoutTitles, mode="serialization")
    schema["required"] = [name for name in FlightResult.model_fields if name not in _OPTIONAL]
    about = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return json.dumps({**about, **schema}, indent=2) + "\n"


if __name__ == "__main__":
    print(json_schema(), end="")
