"""What the floor and the walls of a hall look like: a pattern that a seed draws, or a photograph."""

from __future__ import annotations

from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from framerunner.files.yaml_file import refusal
from scenarios.part import Part

Pattern = Literal["wood", "concrete", "carpet", "brick"]
PATTERNS: tuple[Pattern, ...] = ("wood", "concrete", "carpet", "brick")
MAX_TEXTURE_SEED = 10**9 - 1


class Texture(Part):
    """The look of a surface: one of `pattern` and `photograph`."""

    often_unused: ClassVar = ("pattern", "seed", "photograph", "width_m")

    pattern: Pattern | None = Field(None, description="planks, concrete, carpet tiles or bricks")
    seed: int = Field(0, ge=0, le=MAX_TEXTURE_SEED, description="of the pattern")
    photograph: str | None = Field(
        None, min_length=1, max_length=400, description="file of an image, repeated by mirroring"
    )
    width_m: float = Field(4.0, ge=0.05, le=100, description="of the photograph on the surface")

    @model_validator(mode="after")
    def _has_one_source(self) -> Self:
        if (self.pattern is None) == (self.photograph is None):
            found = "nothing" if self.pattern is None else f"{self.pattern} and a photograph"
            raise refusal(found, "is no texture; give either pattern or photograph", "pattern")
        return self
