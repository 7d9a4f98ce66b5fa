"""The fault of random scenarios."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from scenarios.faults.declaration import MAX_TIME_S, Fault, FaultPart
from scenarios.part import Part
from scenarios.random_numbers import Range, random_stream

_QUAD = 4


class RandomFault(Part):
    """One fault, each of a list equally likely, at a random time; motors without a number are drawn, too."""

    at_s: Range = Field(description="when it begins: seconds after arming")
    any_of: tuple[Fault, ...] = Field(min_length=1, description="faults, without their times")

    @model_validator(mode="after")
    def _every_time_is_valid(self) -> Self:
        self.at_s.within(0.0, MAX_TIME_S, "at_s")
        return self

    def draw(self, seed: int) -> Fault:
        """Draw the fault of a scenario."""
        at = int(random_stream(seed, "faults.kind").random() * len(self.any_of))
        fault = self.any_of[at]
        changes: dict[str, float] = {"at_s": self.at_s.draw_value(random_stream(seed, "faults.time"))}
        if fault.part is FaultPart.MOTOR and fault.number is None:
            changes["number"] = 1 + int(random_stream(seed, "faults.motor").random() * _QUAD)
        return fault.model_copy(update=changes)
