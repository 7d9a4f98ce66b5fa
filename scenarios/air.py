"""How the air moves in a scenario: mean wind, turbulence and gusts."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from framerunner.files.yaml_file import refusal
from scenarios.part import Part

MAX_WIND_M_S = 25.0
MAX_TURBULENCE_M_S = 10.0


class Wind(Part):
    """Horizontal mean wind, Dryden turbulence and discrete gusts; by default the air is still.

    Turbulence and gusts are drawn from the seed of a flight. Length scale and ratios follow the low-altitude
    model of MIL-F-8785C, section 3.7.3.4 (also MIL-HDBK-1797), in feet: L_u = h / (0.177 + 0.000823 h)^1.2.
    There L_u is 4 m at a height of 0.5 m, and 15 m at 2 m; in a hall, eddies are not larger than the hall.
    """

    speed_m_s: float = Field(0.0, ge=0, le=MAX_WIND_M_S, description="mean speed of the air")
    direction_rad: float = Field(
        0.0, ge=-6.3, le=6.3, description="where the air moves to, counter-clockwise from x"
    )
    turbulence_m_s: float = Field(
        0.0,
        ge=0,
        le=MAX_TURBULENCE_M_S,
        description="standard deviation of each horizontal component; half as much vertically; 0: none",
    )
    length_m: float = Field(
        4.0, ge=0.1, le=1000, description="length scale of turbulence, horizontal; an eighth vertically"
    )
    gust_m_s: float = Field(0.0, ge=0, le=MAX_WIND_M_S, description="highest speed of each gust; 0: none")
    gust_period_s: float = Field(
        10.0, ge=0.1, le=3600, description="mean time from the beginning of a gust to that of the next"
    )
    gust_s: float = Field(1.0, ge=0.05, le=60, description="length of a gust")

    @property
    def blows(self) -> bool:
        """Whether the air moves at all."""
        return self.speed_m_s > 0.0 or self.turbulence_m_s > 0.0 or self.gust_m_s > 0.0

    @property
    def highest_m_s(self) -> float:
        """A speed of the air that is hardly ever exceeded: with five standard deviations of turbulence."""
        return self.speed_m_s + 5.0 * self.turbulence_m_s + self.gust_m_s

    @model_validator(mode="after")
    def _gusts_fit_their_period(self) -> Self:
        check_gusts(self.gust_s, self.gust_period_s)
        return self


def check_gusts(gust_s: float, gust_period_s: float) -> None:
    """Refuse gusts that are as long as the time from one to the next, or longer."""
    if gust_s >= gust_period_s:
        message = f"leaves no time between gusts; use less than gust_period_s {gust_period_s:g}"
        raise refusal(gust_s, message, "gust_s")
