"""Levels of difficulty: from what ranges random scenarios are drawn, as declared data in YAML files."""

from __future__ import annotations

import difflib
import math
from importlib import resources
from pathlib import Path
from typing import Self

from pydantic import Field, ValidationError, model_validator

from scenarios.complaints import Fault, describe_faults, shorten, show
from scenarios.models import Arena, Frame, Part, ScenarioError, refusal
from scenarios.yaml_file import FileKind, is_path, packaged

STEPS_PER_UNIT = 1000  # what is drawn is a whole number of millimetres or milliradians


class LevelError(ScenarioError):
    """A level, or a scenario of a level, that cannot be had; the message is one line for people."""


class Range(Part):
    """Where a number is drawn from, uniformly, in whole thousandths; both ends can come up."""

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


class Layout(Part):
    """Where base, start and the three frames are; the drone starts on the base's centre."""

    x_m: Range = Field(description="centres of base and frames")
    y_m: Range = Field(description="centres of base and frames")
    apart_m: float = Field(gt=0, le=1000, description="least distance of any two centres, seen from above")
    frame_z_m: Range = Field(description="centres of the openings above the floor")
    frame_yaw_rad: Range = Field(description="headings of the frames' normals")
    start_yaw_rad: Range = Field(description="the drone's heading at first")

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
        for field, (least, most) in limits.items():
            drawn: Range = getattr(self, field)
            for end, value in (("low", drawn.low), ("high", drawn.high)):
                if not least <= value <= most:
                    message = f"cannot be flown; keep within {least:.4g} and {most:.4g}"
                    raise refusal(value, message, field, end)
        return self


class Level(Part):
    """A level of difficulty. What else a level makes harder gets a section of its own beside `layout`."""

    # 60 characters, a dash and the longest seed just fit a scenario's name.
    name: str = Field(
        pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=60, description="small letters, digits, - and _"
    )
    description: str = Field("", description="what is hard about it")
    layout: Layout = Field(description="where things stand")


_KIND = FileKind("level", LevelError)


def list_levels() -> list[str]:
    """Names of the levels that come with the package, sorted."""
    return packaged("levels")


def load_level(name_or_path: str | Path) -> Level:
    """Load a level that comes with the package, or any YAML file.

    Args:
        name_or_path: a name of `list_levels`, or a path: it has a directory or ends in .yaml or .yml.

    Raises:
        LevelError: there is no such level, or the file is not a valid one.
    """
    text = str(name_or_path)
    names = list_levels()
    if is_path(name_or_path):
        return parse_level(_KIND.read(Path(text), names), source=shorten(text))
    if text not in names:
        nearest = difflib.get_close_matches(text.lower(), names, n=1, cutoff=0.5)
        hint = f"; did you mean {nearest[0]}?" if nearest else ";"
        raise LevelError(
            f"unknown level {show(text)}{hint} Known: {', '.join(names)}; or give the path of a .yaml file"
        )
    entry = resources.files("scenarios") / "levels" / f"{text}.yaml"
    return parse_level(entry.read_bytes(), source=entry.name)


def parse_level(content: bytes | str, source: str = "level") -> Level:
    """Check the content of a level file.

    Args:
        content: YAML, as UTF-8 when bytes.
        source: what to call it in messages, usually the file's path.

    Raises:
        LevelError: it is not a valid level; the message names source, line, field, value and what to do.
    """
    tree = _KIND.parse(content, source)
    try:
        return Level.model_validate(tree.value, strict=True)
    except ValidationError as error:
        faults = [_fault(Fault.from_pydantic(detail)) for detail in error.errors(include_url=False)]
        raise LevelError(describe_faults(source, tree, faults)) from None


def _fault(fault: Fault) -> Fault:
    """Say of an unknown field what is known beside it: the scenario's own fields would be of no help."""
    if fault.kind != "extra_forbidden":
        return fault
    parts: tuple[type[Part], ...] = (Level, Layout, Range)  # by depth
    known = parts[len(fault.path) - 1].model_fields
    message = f"is not a known field; known here: {', '.join(known)}"
    return Fault("refused", fault.path, fault.value, {"value": show(fault.value), "message": message})
