"""Random scenarios: levels, which say from what ranges they are drawn, and the draw by level and seed.

The same level and seed give the same scenario on every machine. Random numbers are taken from named streams:
a stream depends on the seed and its own name only, so one that is added, left out or drawn from more often
changes no other.
"""

from __future__ import annotations

import hashlib
import itertools
import math
from pathlib import Path
from typing import TYPE_CHECKING, Self

from pydantic import Field, model_validator

from scenarios.models import COLOURS, Arena, Base, Frame, Part, Scenario, ScenarioError, Start, refusal
from scenarios.yaml_file import FileKind

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


class Layout(Part):
    """Where base, start and the three frames are; the drone starts on the base's centre."""

    x_m: Range = Field(description="centres of base and frames")
    y_m: Range = Field(description="centres of base and frames")
    apart_m: float = Field(gt=0, le=1000, description="minimum distance of any two centres, seen from above")
    frame_z_m: Range = Field(description="centres of the openings above the floor")
    frame_yaw_rad: Range = Field(description="headings of the frames' normals")
    start_yaw_rad: Range = Field(description="the drone's heading at the start")

    @model_validator(mode="after")
    def _every_draw_is_a_valid_scenario(self) -> Self:
        arena = Arena()
        half_x_m, half_y_m = arena.length_x_m / 2, arena.width_y_m / 2
        half_frame_m: float = Frame.model_fields["outer_height_m"].default / 2
        limits = {
            "x_m": (-half_x_m, half_x_m),
            "y_m": (-half_y_m, half_y_m),
            "frame_z_m": (half_frame_m, arena.height_m),
            "frame_yaw_rad": (-math.tau, math.tau),
            "start_yaw_rad": (-math.tau, math.tau),
        }
        for field, (lowest, highest) in limits.items():
            drawn: Range = getattr(self, field)
            for end, value in (("low", drawn.low), ("high", drawn.high)):
                if not lowest <= value <= highest:
                    message = f"cannot be flown; keep within {lowest:.4g} and {highest:.4g}"
                    raise refusal(value, message, field, end)
        return self


class Level(Part):
    """A level of difficulty. What else a level makes harder gets a section beside `layout`."""

    # 60 characters, a dash and the longest seed just fit a scenario's name.
    name: str = Field(
        pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=60, description="small letters, digits, - and _"
    )
    description: str = Field("", description="what is hard about it")
    layout: Layout = Field(description="places and headings of base, start and frames")


LEVEL_FILES = FileKind("level", Level, LevelError, folder="levels")


def load_level(name_or_path: str | Path) -> Level:
    """Load an installed level, or any YAML file.

    Args:
        name_or_path: a name of `LEVEL_FILES`, or a path: it has a directory or ends in .yaml or .yml.

    Raises:
        LevelError: there is no such level, or the file is not a valid one; the message names file, line,
            field, value and what to do.
    """
    level = LEVEL_FILES.load(name_or_path)
    if level is None:
        raise LEVEL_FILES.unknown(str(name_or_path))
    return level


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


def random_scenario(level: Level, seed: int) -> Scenario:
    """Draw a scenario, uniformly over all that the level allows.

    The level's name does not affect the draw: levels with one layout have the same places for the same seed,
    so that what else they make harder can be compared flight by flight.

    Args:
        level: what to draw from, see `load_level`.
        seed: 0 to `MAX_SEED`.

    Returns:
        A scenario named `<level>-<seed>`, in whole millimetres and milliradians.

    Raises:
        LevelError: the seed is out of range, or the level's distances leave (nearly) no room.
    """
    layout = level.layout
    (base_x_m, base_y_m), *frame_places = _draw_places(level, seed)
    heights = random_stream(seed, "layout.frame_heights")
    yaws = random_stream(seed, "layout.frame_yaws")
    start_yaw_rad = layout.start_yaw_rad.draw(random_stream(seed, "layout.start_yaw")) / STEPS_PER_UNIT
    return Scenario(
        name=f"{level.name}-{seed}",
        description=f"Random scenario of level {level.name}, seed {seed}.",
        base=Base(x_m=base_x_m, y_m=base_y_m),
        start=Start(x_m=base_x_m, y_m=base_y_m, yaw_rad=start_yaw_rad),
        frames=tuple(
            Frame(
                colour=colour,
                x_m=x_m,
                y_m=y_m,
                z_m=layout.frame_z_m.draw(heights) / STEPS_PER_UNIT,
                yaw_rad=layout.frame_yaw_rad.draw(yaws) / STEPS_PER_UNIT,
            )
            for colour, (x_m, y_m) in zip(COLOURS, frame_places, strict=True)
        ),
    )


def _draw_places(level: Level, seed: int) -> list[tuple[float, float]]:
    """Draw x and y of base and frames, metres.

    All are drawn again when two are too near: redrawing only the last one would favour some layouts.
    """
    layout, stream = level.layout, random_stream(seed, "layout.places")
    count = 1 + len(COLOURS)
    apart_steps_2 = (layout.apart_m * STEPS_PER_UNIT) ** 2
    for _ in range(MAX_DRAWS):
        places = [(layout.x_m.draw(stream), layout.y_m.draw(stream)) for _ in range(count)]
        # Not ">=": places exactly that far apart would be too near when calculated in rounded metres.
        if all(
            (x - other_x) ** 2 + (y - other_y) ** 2 > apart_steps_2
            for (x, y), (other_x, other_y) in itertools.combinations(places, 2)
        ):
            return [(x / STEPS_PER_UNIT, y / STEPS_PER_UNIT) for x, y in places]
    room = " × ".join(f"{span.high - span.low:g}" for span in (layout.x_m, layout.y_m))
    raise LevelError(
        f"level {level.name}, seed {seed}: {MAX_DRAWS} draws found no room for {count} places "
        f"{layout.apart_m:g} m apart in {room} m; lower layout.apart_m or widen layout.x_m and layout.y_m"
    )
