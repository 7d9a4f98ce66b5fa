"""What makes random scenarios hard beside their layout: wind, faults, camera, light and clutter."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from framerunner.geometry.gate_shape import PAPER_GATE
from scenarios.air import MAX_TURBULENCE_M_S, MAX_WIND_M_S, Wind, check_gusts
from scenarios.faults.declaration import MAX_TIME_S, Fault, FaultPart
from scenarios.imaging.effects import (
    MAX_K,
    MAX_P,
    PATCH_COLOURS,
    SURFACES,
    CameraEffects,
    Hall,
    LensDistortion,
    Patch,
    PatchColour,
    Surface,
)
from scenarios.models import Arena, Camera, Light
from scenarios.part import Part
from scenarios.random_numbers import Range, random_stream, within

if TYPE_CHECKING:
    from numpy.random import Generator

_NONE = Range(low=0.0, high=0.0)
_ALL = Range(low=1.0, high=1.0)
_ALL_ROUND_RAD = Range(low=-3.141, high=3.141)
_QUARTER_RAD = 1.57
_QUAD = 4
_BORDERS = 3  # every third patch is nothing but a border, in the proportions of a gate
_GATE_SHAPE = PAPER_GATE.outer_height_m / PAPER_GATE.outer_width_m
_SLANT_RAD = Range(low=-0.3, high=0.3)

_WindSpeed = Annotated[Range, within(0.0, MAX_WIND_M_S)]
_Radial = Annotated[Range, within(-MAX_K, MAX_K)]
_Tangential = Annotated[Range, within(-MAX_P, MAX_P)]
_ExposureTime = Annotated[Range, within(0.0, 0.05)]
_Noise = Annotated[Range, within(0.0, 20.0)]
_Share = Annotated[Range, within(0.0, 1.0)]


class RandomWind(Part):
    """Ranges of the wind's numbers; each is drawn from a stream of its own, the direction from all round."""

    speed_m_s: _WindSpeed = Field(_NONE, description="mean speed of the air")
    turbulence_m_s: Annotated[Range, within(0.0, MAX_TURBULENCE_M_S)] = Field(
        _NONE, description="standard deviation of each horizontal component"
    )
    gust_m_s: _WindSpeed = Field(_NONE, description="highest speed of each gust")
    length_m: float = Field(Wind().length_m, ge=0.1, le=1000, description="length scale of turbulence")
    gust_period_s: float = Field(
        Wind().gust_period_s, ge=0.1, le=3600, description="mean time from one gust to the next"
    )
    gust_s: float = Field(Wind().gust_s, ge=0.05, le=60, description="length of a gust")

    @model_validator(mode="after")
    def _gusts_fit_their_period(self) -> Self:
        check_gusts(self.gust_s, self.gust_period_s)
        return self

    def draw(self, seed: int) -> Wind:
        """Draw the wind of a scenario, in whole thousandths."""
        return Wind(
            speed_m_s=self.speed_m_s.draw_value(random_stream(seed, "wind.speed")),
            direction_rad=_ALL_ROUND_RAD.draw_value(random_stream(seed, "wind.direction")),
            turbulence_m_s=self.turbulence_m_s.draw_value(random_stream(seed, "wind.turbulence")),
            length_m=self.length_m,
            gust_m_s=self.gust_m_s.draw_value(random_stream(seed, "wind.gust")),
            gust_period_s=self.gust_period_s,
            gust_s=self.gust_s,
        )


class RandomFault(Part):
    """One fault, each of a list equally likely, at a random time; motors without a number are drawn, too."""

    at_s: Annotated[Range, within(0.0, MAX_TIME_S)] = Field(
        description="when it begins: seconds after arming"
    )
    any_of: tuple[Fault, ...] = Field(min_length=1, description="faults, without their times")

    def draw(self, seed: int) -> Fault:
        """Draw the fault of a scenario."""
        at = int(random_stream(seed, "faults.kind").random() * len(self.any_of))
        fault = self.any_of[at]
        changes: dict[str, float] = {"at_s": self.at_s.draw_value(random_stream(seed, "faults.time"))}
        if fault.part is FaultPart.MOTOR and fault.number is None:
            changes["number"] = 1 + int(random_stream(seed, "faults.motor").random() * _QUAD)
        return fault.model_copy(update=changes)


class RandomEffects(Part):
    """Ranges of the numbers of `CameraEffects`; each is drawn from a stream of its own."""

    k1: _Radial = Field(_NONE, description="radial distortion")
    k2: _Radial = Field(_NONE, description="radial distortion")
    p1: _Tangential = Field(_NONE, description="tangential distortion")
    p2: _Tangential = Field(_NONE, description="tangential distortion")
    exposure_s: _ExposureTime = Field(_NONE, description="time of exposure")
    readout_s: _ExposureTime = Field(_NONE, description="read-out of the rolling shutter")
    vignetting: Annotated[Range, within(0.0, 0.9)] = Field(
        _NONE, description="share of the light lost in the corners"
    )
    illumination: Annotated[Range, within(0.02, 1.0)] = Field(
        _ALL, description="light that reaches the sensor"
    )
    warmth: Annotated[Range, within(-0.5, 0.5)] = Field(
        _NONE, description="by which share that light is redder than white, and less blue"
    )
    read_noise: _Noise = Field(_NONE, description="standard deviation of noise in the dark, of 255")
    shot_noise: _Noise = Field(_NONE, description="standard deviation of noise at white, of 255")
    gain: Literal["auto", "fixed"] = Field("fixed", description="whether brightness is regulated")
    white_balance: Literal["auto", "fixed"] = Field("fixed", description="whether colour is regulated")

    @model_validator(mode="after")
    def _no_lens_folds_the_image(self) -> Self:
        for k1 in (self.k1.low, self.k1.high):
            for k2 in (self.k2.low, self.k2.high):
                Camera(effects=CameraEffects(lens=LensDistortion(k1=k1, k2=k2)))
        return self

    def draw(self, seed: int) -> CameraEffects:
        """Draw the effects of a scenario, in whole thousandths."""

        def value(field: str) -> float:
            drawn: Range = getattr(self, field)
            return drawn.draw_value(random_stream(seed, f"camera.{field}"))

        warmth = value("warmth")
        return CameraEffects(
            lens=LensDistortion(k1=value("k1"), k2=value("k2"), p1=value("p1"), p2=value("p2")),
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

    elevation_rad: Annotated[Range, within(0.05, _QUARTER_RAD)] = Field(
        description="of the light's origin above the horizon"
    )
    ambient: _Share = Field(description="brightness of surfaces in shadow")
    turn_rad_s: Annotated[Range, within(-1.0, 1.0)] = Field(_NONE, description="how fast its direction turns")

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
    size_m: Annotated[Range, within(0.05, 10.0)] = Field(
        description="width and height of each; a border has the proportions of a frame"
    )
    up_m: Range = Field(description="centres of the posters above the floor")
    border_m: Annotated[Range, within(0.005, 1.0)] = Field(description="width of borders")
    beyond_m: float = Field(
        Hall().beyond_m, ge=0.01, le=100, description="from the arena to the hall's walls"
    )
    height_m: float = Field(Hall().height_m, ge=0.1, le=100, description="of the hall")

    @model_validator(mode="after")
    def _posters_are_on_the_walls(self) -> Self:
        self.up_m.check(0.0, self.height_m, "up_m")
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
            height_m=round(width * _GATE_SHAPE, 3) if is_border else height,
            turn_rad=turn,
            border_m=border if is_border else None,
        )
