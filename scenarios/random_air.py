"""The wind of random scenarios."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from scenarios.air import MAX_TURBULENCE_M_S, MAX_WIND_M_S, Wind, check_gusts
from scenarios.part import Part
from scenarios.random_numbers import Range, random_stream

_STILL = Range(low=0.0, high=0.0)
_ALL_ROUND_RAD = Range(low=-3.141, high=3.141)


class RandomWind(Part):
    """Ranges of the wind's numbers; each is drawn from a stream of its own, the direction from all round."""

    speed_m_s: Range = Field(_STILL, description="mean speed of the air")
    turbulence_m_s: Range = Field(_STILL, description="standard deviation of each horizontal component")
    gust_m_s: Range = Field(_STILL, description="highest speed of each gust")
    length_m: float = Field(Wind().length_m, ge=0.1, le=1000, description="length scale of turbulence")
    gust_period_s: float = Field(
        Wind().gust_period_s, ge=0.1, le=3600, description="mean time from one gust to the next"
    )
    gust_s: float = Field(Wind().gust_s, ge=0.05, le=60, description="length of a gust")

    @model_validator(mode="after")
    def _every_draw_is_a_valid_wind(self) -> Self:
        self.speed_m_s.within(0.0, MAX_WIND_M_S, "speed_m_s")
        self.turbulence_m_s.within(0.0, MAX_TURBULENCE_M_S, "turbulence_m_s")
        self.gust_m_s.within(0.0, MAX_WIND_M_S, "gust_m_s")
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
