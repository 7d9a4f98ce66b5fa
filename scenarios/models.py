"""What is flown: the scenario and its parts, as frozen, validated data in arena axes."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from scenarios.axes import Vec3

Colour = Literal["red", "green", "blue"]
COLOURS: tuple[Colour, ...] = ("red", "green", "blue")

Metres = Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
Radians = Annotated[float, Field(ge=-6.3, le=6.3, allow_inf_nan=False)]


class Part(BaseModel):
    """Base of all scenario parts: frozen, and an unknown field is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Arena(Part):
    """The flying space, centred on the origin, its floor at z = 0."""

    length_x_m: float = Field(10.0, gt=0, le=1000, description="extent along x")
    width_y_m: float = Field(10.0, gt=0, le=1000, description="extent along y")
    height_m: float = Field(4.0, gt=0, le=1000, description="ceiling above the floor")


class Base(Part):
    """The cube the drone starts from and lands on."""

    x_m: Metres = Field(0.0, description="centre")
    y_m: Metres = Field(0.0, description="centre")
    edge_m: float = Field(0.5, gt=0.1, le=10, description="edge of the square top")
    top_m: float = Field(0.51, gt=0, le=10, description="height of the top above the floor")


class Start(Part):
    """Where the drone stands at first; its height follows from what is under it."""

    x_m: Metres = 0.0
    y_m: Metres = 0.0
    yaw_rad: Radians = 0.0


class Frame(Part):
    """An upright rectangular frame floating in the arena; its normal is its local x axis."""

    colour: Colour
    x_m: Metres = Field(description="centre of the opening")
    y_m: Metres = Field(description="centre of the opening")
    z_m: float = Field(gt=0, le=100, description="centre of the opening above the floor")
    yaw_rad: Radians = 0.0
    outer_width_m: float = Field(0.42, gt=0, le=10, description="horizontal, bars included")
    outer_height_m: float = Field(0.22, gt=0, le=10, description="vertical, bars included")
    bar_m: float = Field(0.02, gt=0, le=1, description="edge of the square bars")

    @property
    def position_arena_m(self) -> Vec3:
        """Centre of the opening."""
        return (self.x_m, self.y_m, self.z_m)

    @model_validator(mode="after")
    def _has_opening(self) -> Self:
        if 2 * self.bar_m >= min(self.outer_width_m, self.outer_height_m):
            raise ValueError(f"bar_m {self.bar_m} leaves no opening; make it thinner or the frame larger")
        return self


class Camera(Part):
    """A pinhole camera fixed to the drone, looking along its x axis."""

    width_px: int = Field(320, ge=16, le=4096)
    height_px: int = Field(240, ge=16, le=4096)
    horizontal_fov_rad: float = Field(1.57, gt=0.1, lt=3.0)
    rate_hz: float = Field(10.0, gt=0, le=120)
    position_flu_m: Vec3 = Field((0.08, 0.0, 0.0), description="in body axes forward, left, up")
    near_m: float = Field(0.01, gt=0)
    far_m: float = Field(20.0, gt=0)


class Light(Part):
    """One sun and ambient light."""

    sun_direction_arena: Vec3 = Field((-0.5, 0.1, -0.9), description="the way its light travels")
    ambient: float = Field(0.5, ge=0, le=1)


class Origin(Part):
    """Where on Earth the arena's centre is; by default PX4's simulated home."""

    latitude_deg: float = Field(47.397742, ge=-90, le=90)
    longitude_deg: float = Field(8.545594, ge=-180, le=180)
    altitude_m: float = Field(489.0, ge=-500, le=9000, description="above mean sea level")


class Scenario(Part):
    """Everything that is given before a flight."""

    name: str = Field(pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=80)
    description: str = ""
    arena: Arena = Arena()
    base: Base = Base()
    start: Start = Start()
    frames: tuple[Frame, ...] = ()
    camera: Camera = Camera()
    light: Light = Light()
    try_limit_s: float = Field(180.0, gt=0, le=36000)
    airframe: str = "abejorro"
    origin: Origin = Origin()

    @model_validator(mode="after")
    def _one_frame_a_colour(self) -> Self:
        colours = [frame.colour for frame in self.frames]
        twice = sorted({colour for colour in colours if colours.count(colour) > 1})
        if twice:
            raise ValueError(f"frames: colour {twice[0]} stands twice; give each frame its own colour")
        return self
