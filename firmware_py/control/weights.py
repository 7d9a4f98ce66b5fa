"""What the stabiliser's design counts as equally bad; an airframe may declare its own."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class Weights(BaseModel):
    """Tuning of the regulator (Bryson's rule: each weight is 1 / value^2) and of the observer beside it.

    Torque and thrust weights are in units of angular and linear acceleration, so the same numbers suit
    airframes of any size.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    tilt_rad: float = Field(0.6, gt=0)
    roll_pitch_rate_rad_s: float = Field(4.0, gt=0)
    yaw_rate_rad_s: float = Field(0.5, gt=0)
    velocity_horizontal_m_s: float = Field(0.6, gt=0)
    velocity_vertical_m_s: float = Field(0.3, gt=0)
    integral_horizontal_m: float = Field(0.3, gt=0, description="only of the level law")
    integral_vertical_m: float = Field(0.1, gt=0, description="only of the level law")
    integral_yaw_rad: float = Field(0.1, gt=0, description="only of the level law")
    acceleration_vertical_m_s2: float = Field(3.0, gt=0)
    acceleration_roll_pitch_rad_s2: float = Field(60.0, gt=0)
    acceleration_yaw_rad_s2: float = Field(6.0, gt=0)
    observer_force_rad_s: float = Field(2.0, gt=0, description="how fast an unknown force is learnt")
    observer_moment_rad_s: float = Field(4.0, gt=0, description="how fast an unknown moment is learnt")
