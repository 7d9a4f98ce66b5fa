"""What the parts of scenarios and levels have in common: their base class, and kinds of numbers."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from framerunner.geometry.rotations import MAX_MOUNTING_RAD

Metres = Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
"""A coordinate in the arena."""
OnDrone = Annotated[float, Field(ge=-10, le=10)]
"""A coordinate on the drone, metres."""
Turn = Annotated[float, Field(ge=-MAX_MOUNTING_RAD, le=MAX_MOUNTING_RAD)]
Component = Annotated[float, Field(ge=-1e6, le=1e6)]
"""Of a direction, whose length does not matter."""


class Part(BaseModel):
    """Base of all scenario parts: frozen, finite numbers, and an unknown field is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
