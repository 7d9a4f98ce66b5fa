"""What the parts of scenarios and levels have in common: their base class, and errors that name a field."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from pydantic_core import PydanticCustomError

from framerunner.geometry.rotations import MAX_MOUNTING_RAD

Metres = Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
"""A coordinate in the arena."""
OnDrone = Annotated[float, Field(ge=-10, le=10)]
"""A coordinate on the drone, metres."""
Turn = Annotated[float, Field(ge=-MAX_MOUNTING_RAD, le=MAX_MOUNTING_RAD)]
Component = Annotated[float, Field(ge=-1e6, le=1e6)]
"""Of a direction, whose length does not matter."""


def refusal(value: float | str, message: str, *at: str | int) -> PydanticCustomError:
    """Make a validation error that has the path of the bad value, so that a file's line can be named.

    Args:
        value: the bad value, which may be a default.
        message: what is wrong and how to correct it; one line that continues after the value.
        *at: keys and indices from the validated part to the value.
    """
    context = {"field": field_path(at), "value": value, "message": message, "at": at}
    return PydanticCustomError("refused", "{field} {value} {message}", context)


def field_path(at: tuple[str | int, ...]) -> str:
    """Write keys and indices as one text: ("frames", 1, "x_m") is "frames[1].x_m"."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in at)
    return text.removeprefix(".")


class Part(BaseModel):
    """Base of all scenario parts: frozen, finite numbers, and an unknown field is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
