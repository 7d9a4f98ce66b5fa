"""Random numbers of levels: ranges that they are drawn from, and streams that they come from.

Random numbers are taken from named streams: a stream depends on the seed and its own name only, so one that
is added, left out or drawn from more often changes no other.
"""

from __future__ import annotations

import hashlib
from math import tau
from typing import TYPE_CHECKING, Annotated, Self

from pydantic import AfterValidator, Field, model_validator

from framerunner.files.yaml_file import refusal
from scenarios.models import Arena, ScenarioError, UprightGate
from scenarios.part import Part

if TYPE_CHECKING:
    from numpy.random import Generator

MAX_SEED = 2**63 - 1  # fits the integers of every file format and database
MAX_DRAWS = 20_000  # a fifth of a second; level calm needs two draws on average
STEPS_PER_UNIT = 1000  # what is drawn is a whole number of millimetres or milliradians


class LevelError(ScenarioError):
    """A level or a seed that cannot be used; the message is one line for people."""


class Range(Part):
    """A range from which a number is drawn uniformly, in whole thousandths, both ends included."""

    low: float = Field(ge=-1000, le=1000, description="smallest value")
    high: float = Field(ge=-1000, le=1000, description="largest value")

    @property
    def steps(self) -> tuple[int, int]:
        """Both ends in thousandths."""
        return (round(self.low * STEPS_PER_UNIT), round(self.high * STEPS_PER_UNIT))

    @model_validator(mode="after")
    def _has_whole_steps_upwards(self) -> Self:
        for end, value, steps in zip(("low", "high"), (self.low, self.high), self.steps, strict=True):
            if value != steps / STEPS_PER_UNIT:
                raise refusal(value, "is too fine; use at most three decimals", end)
        if self.low > self.high:
            raise refusal(self.low, f"must not be above high {self.high}", "low")
        return self

    def draw(self, stream: Generator) -> int:
        """Draw a whole number of thousandths, each of the range equally likely."""
        low, high = self.steps
        return low + int(stream.random() * (high - low + 1))

    def draw_value(self, stream: Generator) -> float:
        """Draw a number of at most three decimals."""
        return self.draw(stream) / STEPS_PER_UNIT

    def check(self, lowest: float, highest: float, *at: str) -> None:
        """Refuse a range that goes beyond limits, between which all can be flown.

        Args:
            lowest: what may be drawn.
            highest: what may be drawn.
            *at: keys from the validated part to this range.
        """
        for end, value in (("low", self.low), ("high", self.high)):
            if not lowest <= value <= highest:
                message = f"cannot be flown; keep within {lowest:.4g} and {highest:.4g}"
                raise refusal(value, message, *at, end)


def within(lowest: float, highest: float) -> AfterValidator:
    """Limits of a field that is a `Range`."""

    def checked(drawn: Range) -> Range:
        drawn.check(lowest, highest)
        return drawn

    return AfterValidator(checked)


_ARENA = Arena()
PlaceX = Annotated[Range, within(-_ARENA.length_x_m / 2, _ARENA.length_x_m / 2)]
PlaceY = Annotated[Range, within(-_ARENA.width_y_m / 2, _ARENA.width_y_m / 2)]
FrameHeight = Annotated[
    Range, within(UprightGate.model_fields["outer_height_m"].default / 2, _ARENA.height_m)
]
Heading = Annotated[Range, within(-tau, tau)]


def random_stream(seed: int, name: str) -> Generator:
    """Open a stream of random numbers at its beginning.

    For numbers that must be the same everywhere, draw with `Generator.random()` and calculate in Python:
    numpy promises the other distributions neither through its versions (NEP 19) nor, to the last bit,
    through compilers. Generator, seeding and hash are named here because numpy's and Python's defaults may
    change.

    Args:
        seed: 0 to `MAX_SEED`.
        name: what the numbers are for, such as "layout.places".

    Raises:
        LevelError: the seed is out of range.
    """
    from numpy.random import PCG64, Generator, SeedSequence  # noqa: PLC0415 - reading scenarios needs no numpy

    if not 0 <= seed <= MAX_SEED:
        raise LevelError(f"seed {seed} is out of range; use a whole number from 0 to {MAX_SEED}")
    digest = hashlib.blake2b(name.encode(), digest_size=16).digest()
    key = tuple(int.from_bytes(digest[at : at + 4], "little") for at in range(0, len(digest), 4))
    return Generator(PCG64(SeedSequence(int(seed), spawn_key=key)))
