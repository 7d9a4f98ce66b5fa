"""What the parts of scenarios and levels have in common: their base class, and kinds of numbers."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field, SerializerFunctionWrapHandler, model_serializer

from framerunner.geometry.rotations import MAX_MOUNTING_RAD

Metres = Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
"""A coordinate in the arena."""
OnDrone = Annotated[float, Field(ge=-10, le=10)]
"""A coordinate on the drone, metres."""
Turn = Annotated[float, Field(ge=-MAX_MOUNTING_RAD, le=MAX_MOUNTING_RAD)]
Component = Annotated[float, Field(ge=-1e6, le=1e6)]
"""Of a direction, whose length does not matter."""


class Part(BaseModel):
    """Base of all scenario parts: frozen, finite numbers, and an unknown field is an error.

    Attributes:
        often_unused: fields that are not written with their defaults: most scenarios do not use them, and
            evaluations compare scenarios by what is written.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    often_unused: ClassVar[tuple[str, ...]] = ()

    @model_serializer(mode="wrap")
    def _without_unused(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        fields, written = type(self).model_fields, write(self)
        unused = [name for name in self.often_unused if getattr(self, name) == fields[name].default]
        return {name: value for name, value in written.items() if name not in unused}
