"""What makes random scenarios hard beside their layout: wind, faults, camera and light."""

from __future__ import annotations

from math import cos, sin
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from scenarios.air import MAX_TURBULENCE_M_S, MAX_WIND_M_S, Wind, check_gusts
from scenarios.faults.declaration import MAX_TIME_S, Fault, FaultPart
from scenarios.imaging.effects import MAX_K, MAX_P, CameraEffects, LensDistortion
from scenarios.models import Camera, Light
from scenarios.part import Part
from scenarios.random_numbers import Range, random_stream, within

_NONE = Range(low=0.0, high=0.0)
_ALL = Range(low=1.0, high=1.0)
_ALL_ROUND_RAD = Range(low=-3.141, high=3.141)
_QUARTER_RAD = 1.57
_QUAD = 4

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
