"""What makes the images of random scenarios hard: the camera's effects, light and clutter."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING, Literal, Self

from pydantic import Field, model_validator

from scenarios.imaging.clutter import PATCH_COLOURS, SURFACES, Hall, Patch, PatchColour, Surface
from scenarios.imaging.effects import MAX_K, MAX_P, CameraEffects, Lens
from scenarios.models import Arena, Camera, Light
from scenarios.part import Part
from scenarios.random_numbers import Range, random_stream

if TYPE_CHECKING:
    from numpy.random import Generator

_NONE = Range(low=0.0, high=0.0)
_ALL = Range(low=1.0, high=1.0)
_ALL_ROUND_RAD = Range(low=-3.141, high=3.141)
_QUARTER_RAD = 1.57
_BORDERS = 3  # every third patch is nothing but a border, in the proportions of a frame
_FRAME_SHAPE = 0.22 / 0.42
_SLANT_RAD = Range(low=-0.3, high=0.3)


class RandomEffects(Part):
    """Ranges of the numbers of `CameraEffects`; each is drawn from a stream of its own."""

    k1: Range = Field(_NONE, description="radial distortion")
    k2: Range = Field(_NONE, description="radial distortion")
    p1: Range = Field(_NONE, description="tangential distortion")
    p2: Range = Field(_NONE, description="tangential distortion")
    exposure_s: Range = Field(_NONE, description="time of exposure")
    readout_s: Range = Field(_NONE, description="read-out of the rolling shutter")
    vignetting: Range = Field(_NONE, description="share of the light lost in the corners")
    illumination: Range = Field(_ALL, description="light that reaches the sensor")
    warmth: Range = Field(_NONE, description="by which share that light is redder than white, and less blue")
    read_noise: Range = Field(_NONE, description="standard deviation of noise in the dark, of 255")
    shot_noise: Range = Field(_NONE, description="standard deviation of noise at white, of 255")
    gain: Literal["auto", "fixed"] = Field("fixed", description="whether brightness is regulated")
    white_balance: Literal["auto", "fixed"] = Field("fixed", description="whether colour is regulated")

    @model_validator(mode="after")
    def _every_draw_is_valid(self) -> Self:
        limits = {
            "k1": (-MAX_K, MAX_K),
            "k2": (-MAX_K, MAX_K),
            "p1": (-MAX_P, MAX_P),
            "p2": (-MAX_P, MAX_P),
            "exposure_s": (0.0, 0.05),
            "readout_s": (0.0, 0.05),
            "vignetting": (0.0, 0.9),
            "illumination": (0.02, 1.0),
            "warmth": (-0.5, 0.5),
            "read_noise": (0.0, 20.0),
            "shot_noise": (0.0, 20.0),
        }
        for field, (lowest, highest) in limits.items():
            drawn: Range = getattr(self, field)
            drawn.within(lowest, highest, field)
        for k1 in (self.k1.low, self.k1.high):
            for k2 in (self.k2.low, self.k2.high):
                Camera(effects=CameraEffects(lens=Lens(k1=k1, k2=k2)))
        return self

    def draw(self, seed: int) -> CameraEffects:
        """Draw the effects of a scenario, in whole thousandths."""

        def value(field: str) -> float:
            drawn: Range = getattr(self, field)
            return drawn.draw_value(random_stream(seed, f"camera.{field}"))

        warmth = value("warmth")
        return CameraEffects(
            lens=Lens(k1=value("k1"), k2=value("k2"), p1=value("p1"), p2=value("p2")),
            exposure_s=value("exposure_s"),
            readout_s=value("readout_s"),
            vignetting=value("vignetting"),
            illumination=value("illumination"),
            light_rgb=(1.0 + warmth, 1.0, 1.0 - warmth),
            read_noise=value("read_noise"),
            shot_noise=value("shot_noise"),
            gain=self.gain,
            white_balance=self.white_balance,
        )


class RandomLight(Part):
    """Ranges of the light's numbers; it may come from all round."""

    elevation_rad: Range = Field(description="of the light's origin above the horizon")
    ambient: Range = Field(description="brightness of surfaces in shadow")
    turn_rad_s: Range = Field(_NONE, description="how fast its direction turns")

    @model_validator(mode="after")
    def _every_draw_is_a_valid_light(self) -> Self:
        self.elevation_rad.within(0.05, _QUARTER_RAD, "elevation_rad")
        self.ambient.within(0.0, 1.0, "ambient")
        self.turn_rad_s.within(-1.0, 1.0, "turn_rad_s")
        return self

    def draw(self, seed: int) -> Light:
        """Draw the light of a scenario."""
        elevation = self.elevation_rad.draw_value(random_stream(seed, "light.elevation"))
        azimuth = _ALL_ROUND_RAD.draw_value(random_stream(seed, "light.azimuth"))
        level = cos(elevation)
        # Rounded, so that a different cosine in the last digit makes no other scenario.
        direction = (level * cos(azimuth), level * sin(azimuth), -sin(elevation))
        x, y, z = (round(component, 4) for component in direction)
        return Light(
            sun_direction_arena=(x, y, z),
            ambient=self.ambient.draw_value(random_stream(seed, "light.ambient")),
            turn_rad_s=self.turn_rad_s.draw_value(random_stream(seed, "light.turn")),
        )


class RandomClutter(Part):
    """Flat things in all colours on the floor and on the walls of a hall; every third is only a border."""

    posters: int = Field(0, ge=0, le=100, description="how many things on the walls")
    marks: int = Field(0, ge=0, le=100, description="how many things on the floor")
    size_m: Range = Field(description="width and height of each; a border has the proportions of a frame")
    up_m: Range = Field(description="centres of the posters above the floor")
    border_m: Range = Field(description="width of borders")
    beyond_m: float = Field(
        Hall().beyond_m, ge=0.01, le=100, description="from the arena to the hall's walls"
    )
    height_m: float = Field(Hall().height_m, ge=0.1, le=100, description="of the hall")

    @model_validator(mode="after")
    def _every_draw_is_valid(self) -> Self:
        self.size_m.within(0.05, 10.0, "size_m")
        self.up_m.within(0.0, self.height_m, "up_m")
        self.border_m.within(0.005, 1.0, "border_m")
        return self

    @property
    def hall(self) -> Hall:
        """The hall on whose walls they are."""
        return Hall(beyond_m=self.beyond_m, height_m=self.height_m)

    def draw(self, seed: int) -> tuple[Patch, ...]:
        """Draw all that lies and hangs around."""
        stream = random_stream(seed, "clutter")
        surfaces = [SURFACES[1 + index % 4] for index in range(self.posters)] + [SURFACES[0]] * self.marks
        return tuple(self._patch(surface, index, stream) for index, surface in enumerate(surfaces))

    def _patch(self, surface: Surface, index: int, stream: Generator) -> Patch:
        arena = Arena()
        colour: PatchColour = PATCH_COLOURS[int(stream.random() * len(PATCH_COLOURS))]
        x_m, y_m = arena.length_x_m / 2, arena.width_y_m / 2
        if surface == "floor":
            across = Range(low=-x_m, high=x_m).draw_value(stream)
            up = Range(low=-y_m, high=y_m).draw_value(stream)
            turn = _ALL_ROUND_RAD.draw_value(stream)
        else:
            half = (y_m if surface in {"front", "back"} else x_m) + self.beyond_m - 1.0
            across = Range(low=-half, high=half).draw_value(stream)
            up = self.up_m.draw_value(stream)
            turn = _SLANT_RAD.draw_value(stream)
        width, height = self.size_m.draw_value(stream), self.size_m.draw_value(stream)
        border = self.border_m.draw_value(stream)
        is_border = index % _BORDERS == 0
        return Patch(
            surface=surface,
            colour=colour,
            across_m=across,
            up_m=up,
            width_m=width,
            height_m=round(width * _FRAME_SHAPE, 3) if is_border else height,
            turn_rad=turn,
            border_m=border if is_border else None,
        )
