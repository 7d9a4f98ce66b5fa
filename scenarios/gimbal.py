"""The gimbal that a scenario puts under its camera."""

from __future__ import annotations

from math import pi
from typing import Self

from pydantic import Field, model_validator

from framerunner.files.yaml_file import refusal
from scenarios.part import Part


class Gimbal(Part):
    """A gimbal with two axes that carries the camera and keeps it level: pitch and yaw are commanded."""

    pitch_min_rad: float = Field(
        -pi / 2, ge=-pi / 2, le=0, description="lowest, to the horizon; down is below 0"
    )
    pitch_max_rad: float = Field(0.52, ge=0, le=pi / 2, description="highest, to the horizon")
    yaw_max_rad: float = Field(2.79, ge=0, le=pi, description="to either side, from the drone's heading")
    rate_max_rad_s: float = Field(1.57, ge=0.01, le=20, description="at which it turns to a new angle")

    @model_validator(mode="after")
    def _turns(self) -> Self:
        if self.pitch_min_rad == self.pitch_max_rad == self.yaw_max_rad == 0.0:
            raise refusal(self.yaw_max_rad, "lets it turn about no axis; leave the gimbal out", "yaw_max_rad")
        return self
