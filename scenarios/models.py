"""What is flown: the scenario and its parts, as frozen, validated data in arena axes."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from errors import UserError
from geometry.vectors import Vec3

Colour = Literal["red", "green", "blue"]
COLOURS: tuple[Colour, ...] = ("red", "green", "blue")

Metres = Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
Radians = Annotated[float, Field(ge=-6.3, le=6.3, allow_inf_nan=False)]


class ScenarioError(UserError):
    """A scenario that cannot be used; the message is one line for people."""


def refusal(value: float | str, message: str, *at: str | int) -> PydanticCustomError:
    """A validation error that knows where below the validated part the bad value stands.

    Args:
        value: the bad value, which may be a default.
        message: what is wrong and how to correct it, one line that goes on from the value.
        *at: keys and indices from the validated part to the value; the loader finds its line with them.
    """
    context = {"field": field_path(at), "value": value, "message": message, "at": at}
    return PydanticCustomError("refused", "{field} {value} {message}", context)


def field_path(at: tuple[str | int, ...]) -> str:
    """Write keys and indices as people do: ("frames", 1, "x_m") is "frames[1].x_m"."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in at)
    return text.removeprefix(".")


class Part(BaseModel):
    """Base of all scenario parts: frozen and finite, and an unknown field is an error."""

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
    """Where the drone stands at first; its height follows from what is under it."""

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
    latency_s: float = Field(0.05, ge=0, le=2, description="from exposure to the image's way out")
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

    sun_direction_arena: Vec3 = Field((-0.5, 0.1, -0.9), description="the way its light travels; any length")
    ambient: float = Field(0.5, ge=0, le=1, description="brightness of what the sun does not reach")

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
    """Everything that is given before a flight."""

    name: str = Field(
        pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=80, description="small letters, digits, - and _"
    )
    description: str = Field("", description="what this scenario is and where its numbers come from")
    arena: Arena = Field(Arena(), description="the flying space")
    base: Base = Field(Base(), description="where to land")
    start: Start = Field(Start(), description="where the drone stands at first")
    frames: tuple[Frame, ...] = Field((), description="at most one of each colour, in any order")
    camera: Camera = Field(Camera(), description="the drone's camera")
    light: Light = Field(Light(), description="sun and sky")
    try_limit_s: float = Field(180.0, gt=0, le=36000, description="longest try, motors on to motors off")
    airframe: str = Field("abejorro", description="name of the drone to fly")
    origin: Origin = Field(Origin(), description="where on Earth the arena is")

    @model_validator(mode="after")
    def _one_frame_a_colour(self) -> Self:
        seen: set[str] = set()
        for index, frame in enumerate(self.frames):
            if frame.colour in seen:
                raise refusal(
                    frame.colour, "stands twice; give each frame its own colour", "frames", index, "colour"
                )
            seen.add(frame.colour)
        return self

    @model_validator(mode="after")
    def _all_inside_arena(self) -> Self:
        half_x_m, half_y_m = self.arena.length_x_m / 2, self.arena.width_y_m / 2
        placed: list[tuple[Part, tuple[str | int, ...]]] = [(self.start, ("start",)), (self.base, ("base",))]
        placed += [(frame, ("frames", index)) for index, frame in enumerate(self.frames)]
        for part, at in placed:
            for field, limit_m in (("x_m", half_x_m), ("y_m", half_y_m)):
                value_m: float = getattr(part, field)
                if abs(value_m) > limit_m:
                    raise refusal(
                        value_m,
                        f"is outside the arena; keep within ±{limit_m} or enlarge the arena",
                        *at,
                        field,
                    )
        for index, frame in enumerate(self.frames):
            if frame.z_m > self.arena.height_m:
                limit_m = self.arena.height_m
                raise refusal(frame.z_m, f"is above the arena; use {limit_m} or less", "frames", index, "z_m")
        return self
