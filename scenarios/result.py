"""What a referee tells of a try, and the result of a flight: as types, as JSON, and as a JSON Schema."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import CoreSchema

from errors import UserError
from scenarios.crossing import Side
from scenarios.verdict import Verdict

MAX_RESULT_BYTES = 1_000_000
_MAX_TEXT = 2000  # characters; a longer text is cut


def _sound_text(value: object) -> object:
    """A text that every file takes: not endless, and without half a surrogate pair."""
    return value[:_MAX_TEXT].encode("utf-8", "replace").decode() if isinstance(value, str) else value


_LIMITS: dict[str, Any] = {"strict": True, "allow_inf_nan": False, "le": 1e9}
Seconds = Annotated[float, Field(ge=0.0, json_schema_extra={"unit": "s"}, **_LIMITS)]
Metres = Annotated[float, Field(ge=-1e9, json_schema_extra={"unit": "m"}, **_LIMITS)]
Ratio = Annotated[float, Field(ge=0.0, **_LIMITS)]
Count = Annotated[int, Field(ge=0, le=10**9, strict=True)]
Flag = Annotated[bool, Field(strict=True)]
Text = Annotated[str, BeforeValidator(_sound_text)]
Ended = Literal["finished", "timed out", "aborted", "error", ""]


class ResultError(UserError):
    """A result that cannot be used; the message is one line for people: field, then reason."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """The first passage through a frame.

    Attributes:
        colour: the frame.
        time_s: since motors on.
        offset_m: distance of the drone's centre from the opening's centre, in the frame's plane.
        side: the side it came from; "front" is where the frame's normal points.
    """

    colour: str
    time_s: float
    offset_m: float
    side: Side


@dataclass(frozen=True, slots=True)
class RefereeSnapshot:
    """How the try stands now, for displays.

    Attributes:
        began_us: vehicle time of motors on, microseconds; None before.
        try_time_s: since motors on; stands still after motors off.
        penalty_s: so far.
        crossed: colours crossed so far.
        next_colour: the frame whose turn it is; None when all are crossed.
        contacts: contacts with frames so far.
        inside: whether the drone is inside the arena.
        motors_on: whether the try is being flown.
        settled: motors off and at rest.
        over: nothing that comes can change the verdict.
    """

    began_us: int | None
    try_time_s: Seconds
    penalty_s: Seconds
    crossed: Annotated[tuple[Text, ...], Field(max_length=10)]
    next_colour: Text | None
    contacts: int
    inside: bool
    motors_on: bool
    settled: bool
    over: bool


class _Told(BaseModel):
    """Frozen and finite; fields of other versions are passed over."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


class RefereeReport(_Told):
    """What a try was worth, as a referee says."""

    verdict: Verdict = Field(description="see docs/evaluation.md; `error` stands in evaluations only")
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
    contacts: Count = Field(0, description="number of contacts with frames")
    contact_frames: tuple[Text, ...] = Field(
        (), max_length=10_000, description="the frame of each contact, in order"
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
        """All frames crossed in order, and landed on the base within the limit."""
        return self.verdict in (Verdict.CLEAN, Verdict.COMPLETED)

    @property
    def times_s(self) -> dict[str, float]:
        """When each colour was crossed, since motors on; empty if names and times do not match."""
        if len(self.frames_crossed) != len(self.crossing_times_s):
            return {}
        return dict(zip(self.frames_crossed, self.crossing_times_s, strict=True))

    @classmethod
    def from_outside(cls, content: object) -> Self | None:
        """Read what anybody may have sent: a field that makes no sense is left out.

        Args:
            content: as `json.loads` returns it.

        Returns:
            None if there is no verdict in it.
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
        """The fields that are known, in order, as plain data for JSON."""
        return self.model_dump(mode="json", exclude_unset=True)


class Timing(_Told):
    """Whether the machine kept up with a flight in real time."""

    kept_up: Flag = Field(description="nothing came late and the wanted speed was reached")
    vehicle_time_waits: Flag = Field(description="the simulator's time waits for the app at each tick")
    speed: Ratio = Field(description="vehicle time a wall time, as a part of the wanted speed")
    late_ticks: Count = Field(description="ticks of the mission that came late")
    late_images: Count = Field(description="images that came after the tick they were for")
    late_setpoints: Count = Field(description="setpoints that came after the tick they were for")
    oldest_image_s: Seconds = Field(description="age of the oldest image that a tick had to use")


class _What(_Told):
    """What was flown; the first fields of a result."""

    scenario: Text = Field("", description="name of the scenario")
    mission: Text = Field("", description="name of the mission")
    seed: int | None = Field(
        None, strict=True, description="of everything random in a lockstep flight; null in real time"
    )


class FlightResult(RefereeReport, _What):
    """The result of a flight, as it stands in `result.json`.

    A field that was never set is not written: `state_sha256` is of lockstep flights; `timing`, and `lift_m`
    where frames were lifted, are of flights in real time; wall times are not known to recordings.
    """

    mission_state: Text = Field("", description="where the mission was in the end, such as red.turning")
    ended: Ended = Field("", description="how the mission ended; `error` stands in evaluations only")
    seconds_in_state: dict[Text, Seconds] = Field(
        default_factory=dict, max_length=10_000, description="time spent in each kind of state"
    )
    kept_in_box_s: Seconds = Field(
        0.0, description="for how long commands were changed to keep the drone in its box"
    )
    judged_by: Text = Field("", description="what the referee saw by: truth or telemetry")
    state_sha256: str = Field(
        "", max_length=64, description="over the true state of every control tick of a lockstep flight"
    )
    lift_m: Metres = Field(
        0.0, description="how much higher the frames hung than the scenario says, for want of a base"
    )
    timing: Timing | None = Field(None, description="of a flight in real time")
    version: Text = Field("", description="of the framerunner that flew")
    wall_time_s: Seconds | None = Field(None, description="wall time from the first to the last tick")
    real_time_factor: Ratio | None = Field(
        None, description="vehicle time a wall time; null before two ticks"
    )
    started: Text = Field("", description="when the flight began, ISO 8601, UTC")

    @classmethod
    def parse(cls, text: str | bytes) -> Self:
        """Read the text of a `result.json`.

        Raises:
            ResultError: it is too long, no JSON, or a field makes no sense.
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


class LocalFrame(_Told):
    """Where in the arena a vehicle's local frame lies."""

    origin_arena_m: tuple[Metres, Metres, Metres]
    yaw_rad: float = 0.0


class Standing(_Told):
    """How a try stands, as `/referee.json` tells.

    Attributes:
        scenario: its name; "" if unknown.
        source: what the referee sees by: "truth" or "telemetry".
        lift_m: how much higher the frames hang than the scenario says.
        time_us: vehicle time, microseconds; None if not told.
        local_frame: None as long as the arena has no place in it.
        snapshot: how the try stands.
        report: what it would be worth if it ended now.
    """

    scenario: str = Field(max_length=80)
    source: str = Field("truth", max_length=40)
    lift_m: Metres = 0.0
    time_us: int | None = None
    local_frame: LocalFrame | None = None
    snapshot: RefereeSnapshot
    report: RefereeReport

    @property
    def ended(self) -> bool:
        """Nothing more comes of this try: judged, or the motors off and at rest."""
        now = self.snapshot
        return now.began_us is not None and (now.over or (now.settled and not now.motors_on))


def first_error(error: ValidationError) -> str:
    """What is wrong, in one line: field, then reason."""
    first = error.errors(include_url=False, include_input=False)[0]
    return f"{'.'.join(str(step) for step in first['loc'])}: {first['msg']}".removeprefix(": ")


_NOT_ALWAYS = ("state_sha256", "lift_m", "timing", "wall_time_s", "real_time_factor", "started")


class _SchemaWithoutTitles(GenerateJsonSchema):
    """Leaves out titles, which only repeat the names of fields."""

    def field_title_should_be_set(self, schema: CoreSchema) -> bool:
        """Never."""
        return False


def json_schema() -> str:
    """The JSON Schema of `result.json`, as `docs/result.schema.json` has it."""
    schema = FlightResult.model_json_schema(schema_generator=_SchemaWithoutTitles, mode="serialization")
    schema["required"] = [name for name in FlightResult.model_fields if name not in _NOT_ALWAYS]
    about = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return json.dumps({**about, **schema}, indent=2) + "\n"


if __name__ == "__main__":
    print(json_schema(), end="")
