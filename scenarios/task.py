"""What an app may know of a scenario before it flies: the task, without what is to be found in the arena."""

from __future__ import annotations

import json
from hashlib import sha256
from typing import Self

from pydantic import Field

from framerunner.geometry.gate_shape import GateShape
from scenarios.goals import Goal
from scenarios.models import COLOURS, Arena, Base, Camera, Colour, Origin, Scenario, ScenarioName, StartPose
from scenarios.part import Part

_LAYOUT = {"frames", "decoys", "poles", "walls", "hall", "patches"}
_MARK_DIGITS = 4  # so few that layouts cannot be searched for the one that gives it


class Task(Part):
    """The part of a scenario that a simulator tells everybody who asks; fields as in `Scenario`."""

    name: ScenarioName
    arena: Arena
    base: Base
    start: StartPose
    colours: tuple[Colour, ...] = Field(description="of the frames to cross, in order")
    shapes: dict[str, GateShape] = Field({}, description="of the frames of each colour, decoys' too")
    camera: Camera
    try_limit_s: float
    airframe: str
    origin: Origin
    gripper: bool
    goals: tuple[Goal, ...]
    layout_mark: str = Field(
        max_length=_MARK_DIGITS, description="differs for other layouts, and tells nothing of this one"
    )
    scenario: Scenario | None = Field(None, description="all of it, only where the layout is shown")

    @classmethod
    def of(cls, scenario: Scenario, *, show_layout: bool = False) -> Self:
        """The task of a scenario; for training with the layout."""
        present = {gate.colour for gate in scenario.frames}
        shared = {name: getattr(scenario, name) for name in cls.model_fields.keys() & Scenario.model_fields}
        colours = tuple(colour for colour in COLOURS if colour in present)
        shown = scenario if show_layout else None
        shapes, mark = scenario.gate_shapes, layout_mark(scenario)
        return cls(**shared, colours=colours, shapes=shapes, layout_mark=mark, scenario=shown)


def layout_mark(scenario: Scenario) -> str:
    """A short checksum of what stands in the arena and is not told."""
    content = json.dumps(scenario.model_dump(mode="json", include=_LAYOUT), sort_keys=True)
    return sha256(content.encode()).hexdigest()[:_MARK_DIGITS]
