"""Data types in arena axes: the scenario and its parts, the ground under a point, the drone's true state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from errors import UserError
from geometry.vectors import Quaternion, Vec3

Colour = Literal["red", "green", "blue"]
COLOURS: tuple[Colour, ...] = ("red", "green", "blue")
MissionClass = Literal["contest", "open"]
"""By which limits a mission flies: the paper's, or what the drone can do. Only `contest` counts."""

Metres = Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
Radians = Annotated[float, Field(ge=-6.3, le=6.3, allow_inf_nan=False)]


class ScenarioError(UserError):
    """A scenario that cannot be used; the message is one line for people."""


def refusal(value: float | str, message: str, *at: str | int) -> PydanticCustomError:
    """Make a validation error that has the path of the bad value, so that a file's line can be named.

    Args:
        value: the bad value, which may be a default.
        message: what is wrong and how to correct it; one line that continues after the value.
        *at: keys and indices from the validated part to the value.
    """
    context = {"field": field_path(at), "value": value, "message": message, "at": at}
    return PydanticCustomError("refused", "{field} {value} {message}", context)


def field_path(at: tuple[str | int, ...]) -> str:
    """Write keys and indices as one text: ("frames", 1, "x_m") is "frames[1].x_m"."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in at)
    return text.removeprefix(".")


class Part(BaseModel):
    """Base of all scenario parts: frozen, finite numbers, and an unknown field is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Arena(Part):
    """The flying space, centred on the origin, its floor at z = 0."""

    length_x_m: float = Field(10.0, gt=0, le=1000, description="extent along x")
    width_y_m: float = Field(10.0, gt=0, le=1000, description="extent along y")
    height_m: float = Field(4.0, gt=0, le=1000, description="ceiling above the floor")
    margin_m: float = Field(1.0, ge=0, le=100, description="how far outside the app lets the drone fly")


class Base(Part):
    """The cube the drone starts from and lands on."""

    x_m: Metres = Field(0.0, description="centre")
    y_m: Metres = Field(0.0, description="centre")
    edge_m: float = Field(0.5, gt=0.1, le=10, description="edge of the square top")
    top_m: float = Field(0.51, gt=0, le=10, description="height of the top above the floor")


class Start(Part):
    """The drone's start pose; its height follows from what is under it."""

    x_m: Metres = Field(0.0, description="centre of the drone")
    y_m: Metres = Field(0.0, description="centre of the drone")
    yaw_rad: Radians = Field(0.0, description="heading, counter-clockwise from x")


class Frame(Part):
    """An upright rectangular frame floating in the arena; its normal is its local x axis."""

    colour: Colour = Field(description="pure red, green or blue; crossed in this order")
    x_m: Metres = Field(description="centre of the opening")
    y_m: Metres = Field(description="centre of the opening")
    z_m: float = Field(gt=0, le=100, description="centre of the opening above the floor")
    yaw_rad: Radians = Field(0.0, description="heading of its normal, counter-clockwise from x")
    outer_width_m: float = Field(0.42, gt=0, le=10, description="horizontal, bars included")
    outer_height_m: float = Field(0.22, gt=0, le=10, description="vertical, bars included")
    bar_m: float = Field(0.02, gt=0, le=1, description="edge of the square bars")

    @property
    def position_arena_m(self) -> Vec3:
        """Centre of the opening."""
        return (self.x_m, self.y_m, self.z_m)

    @property
    def opening_m(self) -> tuple[float, float]:
        """Clear width and height between the bars."""
        return (self.outer_width_m - 2 * self.bar_m, self.outer_height_m - 2 * self.bar_m)

    @model_validator(mode="after")
    def _has_opening_above_floor(self) -> Self:
        if min(self.opening_m) <= 0:
            raise refusal(self.bar_m, "leaves no opening; make it thinner or the frame larger", "bar_m")
        if self.z_m < self.outer_height_m / 2:
            raise refusal(
                self.z_m, f"sinks the frame into the floor; use {self.outer_height_m / 2} or more", "z_m"
            )
        return self


class Camera(Part):
    """A pinhole camera fixed to the drone, looking along its x axis."""

    width_px: int = Field(320, ge=16, le=4096, description="columns of the image")
    height_px: int = Field(240, ge=16, le=4096, description="rows of the image")
    horizontal_fov_rad: float = Field(1.57, gt=0.1, lt=3.0, description="angle of view over the width")
    rate_hz: float = Field(10.0, gt=0, le=120, description="images a second of simulated time")
    latency_s: float = Field(0.05, ge=0, le=2, description="from exposure to sending the image")
    position_flu_m: Vec3 = Field((0.08, 0.0, 0.0), description="in body axes forward, left, up")
    near_m: float = Field(0.01, gt=0, description="nothing nearer is drawn")
    far_m: float = Field(20.0, gt=0, description="nothing farther is drawn")

    @model_validator(mode="after")
    def _sees_something(self) -> Self:
        if self.near_m >= self.far_m:
            raise refusal(self.near_m, f"must be below far_m {self.far_m}", "near_m")
        return self


class Light(Part):
    """One sun and ambient light."""

    sun_direction_arena: Vec3 = Field((-0.5, 0.1, -0.9), description="direction of its light; any length")
    ambient: float = Field(0.5, ge=0, le=1, description="brightness of surfaces in shadow")

    @model_validator(mode="after")
    def _sun_has_direction(self) -> Self:
        if not any(self.sun_direction_arena):
            raise refusal(
                "[0, 0, 0]", "has no direction; one number must differ from 0", "sun_direction_arena"
            )
        return self


class Origin(Part):
    """Where on Earth the arena's centre is; by default PX4's simulated home."""

    latitude_deg: float = Field(47.397742, ge=-90, le=90, description="WGS 84, north positive")
    longitude_deg: float = Field(8.545594, ge=-180, le=180, description="WGS 84, east positive")
    altitude_m: float = Field(489.0, ge=-500, le=9000, description="above mean sea level")


class Scenario(Part):
    """All that is given before a flight."""

    name: str = Field(
        pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=80, description="small letters, digits, - and _"
    )
    description: str = Field("", description="what this scenario is and where its numbers come from")
    arena: Arena = Field(Arena(), description="the flying space")
    base: Base = Field(Base(), description="where to land")
    start: Start = Field(Start(), description="the drone's start pose")
    frames: tuple[Frame, ...] = Field((), description="at most one of each colour, in any order")
    camera: Camera = Field(Camera(), description="the drone's camera")
    light: Light = Field(Light(), description="sun and sky")
    try_limit_s: float = Field(180.0, gt=0, le=36000, description="longest try, motors on to motors off")
    airframe: str = Field("abejorro", description="name of the drone to fly")
    origin: Origin = Field(Origin(), description="where on Earth the arena is")

    @model_validator(mode="after")
    def _one_frame_a_colour(self) -> Self:
        colours = [frame.colour for frame in self.frames]
        for index, colour in enumerate(colours):
            if colour in colours[:index]:
                message = "is used twice; give each frame its own colour"
                raise refusal(colour, message, "frames", index, "colour")
        return self

    @model_validator(mode="after")
    def _all_inside_arena(self) -> Self:
        arena = self.arena
        placed: list[tuple[Part, tuple[str | int, ...]]] = [(self.start, ("start",)), (self.base, ("base",))]
        placed += [(frame, ("frames", index)) for index, frame in enumerate(self.frames)]
        for part, at in placed:
            for field, limit_m in (("x_m", arena.length_x_m / 2), ("y_m", arena.width_y_m / 2)):
                value_m: float = getattr(part, field)
                if abs(value_m) > limit_m:
                    message = f"is outside the arena; keep within ±{limit_m} or enlarge the arena"
                    raise refusal(value_m, message, *at, field)
        for index, frame in enumerate(self.frames):
            if frame.z_m > arena.height_m:
                message = f"is above the arena; use {arena.height_m} or less"
                raise refusal(frame.z_m, message, "frames", index, "z_m")
        return self


@dataclass(slots=True)
class TrueState:
    """State of the drone at one instant, simulated or from a real drone's telemetry."""

    time_us: int  # vehicle time
    position_arena_m: Vec3  # of the drone's centre
    velocity_arena_m_s: Vec3
    attitude_arena: Quaternion  # unit quaternion (w, x, y, z), body FLU to arena
    motors_on: bool
    contacts: tuple[str, ...] = ()  # what the drone touches: names of frames ("red"), "base" or "floor"


def is_over_base(base: Base, x_m: float, y_m: float) -> bool:
    """Whether a point in plan is over the base's square, border included (the base is never turned)."""
    half_m = base.edge_m / 2
    return abs(x_m - base.x_m) <= half_m and abs(y_m - base.y_m) <= half_m


def ground_height(scenario: Scenario, x_m: float, y_m: float, floor_m: float = 0.0) -> float:
    """Height of the base or floor under a point in plan, metres; the floor is at `floor_m`."""
    return scenario.base.top_m if is_over_base(scenario.base, x_m, y_m) else floor_m


def start_position(scenario: Scenario) -> Vec3:
    """Point on the base or floor under the drone's centre at the start, arena axes, metres, shape (3,)."""
    x_m, y_m = scenario.start.x_m, scenario.start.y_m
    return (x_m, y_m, ground_height(scenario, x_m, y_m))
