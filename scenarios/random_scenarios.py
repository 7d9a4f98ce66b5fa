"""Random scenarios: levels, which say from what ranges they are drawn, and the draw by level and seed.

The same level and seed give the same scenario on every machine.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import asdict
from math import ceil, cos, dist, sin
from pathlib import Path

from pydantic import Field

from framerunner.files.yaml_file import FileKind
from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import Vec3
from scenarios.air import Wind
from scenarios.imaging.effects import Hall
from scenarios.models import COLOURS, Arena, Base, BaseMarker, Camera, Gate, Light, Scenario, StartPose
from scenarios.part import Part
from scenarios.random_conditions import RandomEffects, RandomFault, RandomLight, RandomWind
from scenarios.random_hall import RandomClutter, RandomTextures
from scenarios.random_numbers import (
    MAX_DRAWS,
    STEPS_PER_UNIT,
    FrameHeight,
    Heading,
    LevelError,
    PlaceX,
    PlaceY,
    random_stream,
)
from scenarios.random_obstacles import RandomObstacles, add_obstacles
from scenarios.random_shapes import RandomShapes, RandomView

_STEP_M = 0.05  # between the points of a way that are checked


class Closeness(Part):
    """How near frames are, and the straight way through each, along its normal, from one side at least."""

    border_m: float = Field(
        ge=0.01,
        le=100,
        description="the centre of each frame is this near a side of the arena, floor or ceiling",
    )
    together_m: float = Field(
        ge=0.01, le=100, description="the centres of two frames are this near each other"
    )
    apart_m: float = Field(
        ge=0.01, le=100, description="minimum distance of any two frames' centres, in space"
    )
    before_m: float = Field(ge=0.01, le=5, description="length of the way before the opening")
    behind_m: float = Field(ge=0.01, le=5, description="length of the way behind the opening")
    clear_m: float = Field(
        ge=0.01, le=5, description="from the way to the arena's border, the base and the other frames"
    )

    def allows(self, centres_arena_m: Sequence[Vec3]) -> bool:
        """Whether gates with these centres are as near as they should be, and no nearer."""
        gaps_m = [dist(*pair) for pair in itertools.combinations(centres_arena_m, 2)]
        if not self.apart_m < min(gaps_m) <= self.together_m:
            return False
        return all(_from_border_m(centre_m) <= self.border_m for centre_m in centres_arena_m)

    def leaves_ways(self, base: Base, gates: Sequence[Gate]) -> bool:
        """Whether each gate has a free straight way through it."""
        return all(
            self._has_way(gate, [base.solid, *(other.hull for other in gates if other is not gate)])
            for gate in gates
        )

    def _has_way(self, gate: Gate, solids: Sequence[Solid]) -> bool:
        x_m, y_m, z_m = gate.position_arena_m
        along_x, along_y = cos(gate.yaw_rad), sin(gate.yaw_rad)
        steps = ceil((self.before_m + self.behind_m) / _STEP_M)
        way_m = [min(step * _STEP_M - self.before_m, self.behind_m) for step in range(steps + 1)]
        ways = [
            [(x_m + side * at_m * along_x, y_m + side * at_m * along_y, z_m) for at_m in way_m]
            for side in (1, -1)
        ]
        return any(
            all(
                _from_border_m(point_m) >= self.clear_m
                and all(solid.distance_m(point_m) >= self.clear_m for solid in solids)
                for point_m in way
            )
            for way in ways
        )


def _from_border_m(point_m: Vec3) -> float:
    """Distance of a point to the nearest side of the arena, floor or ceiling, below zero outside."""
    arena = Arena()
    x_m, y_m, z_m = point_m
    return min(
        arena.length_x_m / 2 - abs(x_m),
        arena.width_y_m / 2 - abs(y_m),
        z_m,
        arena.height_m - z_m,
    )


class RandomLayout(Part):
    """Where base, start and the three frames are; the drone starts on the base's centre."""

    x_m: PlaceX = Field(description="centres of base and frames")
    y_m: PlaceY = Field(description="centres of base and frames")
    apart_m: float = Field(
        ge=0.01, le=1000, description="minimum distance of any two centres, seen from above"
    )
    frame_z_m: FrameHeight = Field(description="centres of the openings above the floor")
    frame_yaw_rad: Heading = Field(description="headings of the frames' normals")
    start_yaw_rad: Heading = Field(description="the drone's heading at the start")


class Level(Part):
    """A level of difficulty. What else a level makes harder gets a section beside `layout`."""

    # 60 characters, a dash and the longest seed just fit a scenario's name.
    name: str = Field(
        pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=60, description="small letters, digits, - and _"
    )
    description: str = Field("", description="what is hard about it")
    layout: RandomLayout = Field(description="places and headings of base, start and frames")
    closeness: Closeness | None = Field(
        None,
        description="how near each other and the arena's border frames are; layout.apart_m then counts from "
        "the base only",
    )
    shapes: RandomShapes | None = Field(None, description="of the frames; by default the challenge's")
    obstacles: RandomObstacles | None = Field(None, description="what else is in the arena")
    wind: RandomWind | None = Field(None, description="how the air moves; by default it is still")
    faults: RandomFault | None = Field(None, description="what fails; by default nothing")
    camera: RandomEffects | None = Field(
        None, description="what the camera does to images; by default they are ideal"
    )
    view: RandomView | None = Field(
        None, description="size and mounting of the camera; by default the challenge's"
    )
    light: RandomLight | None = Field(None, description="where light comes from; by default the challenge's")
    clutter: RandomClutter | None = Field(
        None, description="a hall around the arena with things on walls and floor"
    )
    textures: RandomTextures | None = Field(
        None, description="what floor and walls look like; by default tatami mats and plain walls"
    )
    base_marker: BaseMarker | None = Field(None, description="printed markers on the base; by default none")
    airframe: str | None = Field(None, description="name of the drone to fly; by default the challenge's")
    sensors: str | None = Field(None, description="name of the drone's sensor suite, or a file of one")


LEVEL_FILES = FileKind("level", Level, LevelError, folder="levels", extension="level")


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
    yaw_rad = level.layout.start_yaw_rad.draw_value(random_stream(seed, "layout.start_yaw"))
    base, gates = _draw_layout(level, seed)
    effects = None if level.camera is None else level.camera.draw(seed)
    scenario = Scenario(
        name=f"{level.name}-{seed}",
        description=f"Random scenario of level {level.name}, seed {seed}.",
        base=base if level.base_marker is None else base.model_copy(update={"marker": level.base_marker}),
        start=StartPose(x_m=base.x_m, y_m=base.y_m, yaw_rad=yaw_rad),
        frames=gates,
        wind=Wind() if level.wind is None else level.wind.draw(seed),
        faults=() if level.faults is None else (level.faults.draw(seed),),
        camera=Camera(effects=effects) if level.view is None else level.view.draw(seed, effects),
        light=Light() if level.light is None else level.light.draw(seed),
        floor_texture=None if level.textures is None else level.textures.draw_floor(seed),
        hall=_draw_hall(level, seed),
        patches=() if level.clutter is None else level.clutter.draw_patches(seed),
        **{name: value for name in ("airframe", "sensors") if (value := getattr(level, name)) is not None},
    )
    return scenario if level.obstacles is None else add_obstacles(scenario, level.obstacles, seed)


def _draw_hall(level: Level, seed: int) -> Hall | None:
    if level.clutter is None:
        return None
    return level.clutter.draw_hall(seed, None if level.textures is None else level.textures.draw_walls(seed))


def _draw_layout(level: Level, seed: int) -> tuple[Base, tuple[Gate, ...]]:
    """Draw base and gates.

    All are drawn again when two are too near: redrawing only the last one would favour some layouts.
    """
    layout, closeness = level.layout, level.closeness
    shapes = None if level.shapes is None else level.shapes.draw(seed)
    stream, heights = random_stream(seed, "layout.places"), random_stream(seed, "layout.frame_heights")
    yaws = random_stream(seed, "layout.frame_yaws")
    count = 1 + len(COLOURS)
    apart_steps_2 = (layout.apart_m * STEPS_PER_UNIT) ** 2
    for _ in range(MAX_DRAWS):
        places = [(layout.x_m.draw(stream), layout.y_m.draw(stream)) for _ in range(count)]
        # Not ">=": places exactly that far apart would be too near when calculated in rounded metres.
        pairs = (
            itertools.combinations(places, 2)
            if closeness is None
            else itertools.product(places[:1], places[1:])
        )
        if any(
            (x - other_x) ** 2 + (y - other_y) ** 2 <= apart_steps_2 for (x, y), (other_x, other_y) in pairs
        ):
            continue
        base_m, *gates_m = [(x / STEPS_PER_UNIT, y / STEPS_PER_UNIT) for x, y in places]
        centres_m = [(x_m, y_m, layout.frame_z_m.draw_value(heights)) for x_m, y_m in gates_m]
        if level.shapes is not None and shapes is not None:
            places_m = zip(centres_m, shapes, strict=True)
            centres_m = [(x, y, level.shapes.height_of(shape, z)) for (x, y, z), shape in places_m]
        if closeness is not None and not closeness.allows(centres_m):
            continue
        base = Base(x_m=base_m[0], y_m=base_m[1])
        gates = tuple(
            Gate(colour=colour, x_m=x_m, y_m=y_m, z_m=z_m, yaw_rad=layout.frame_yaw_rad.draw_value(yaws))
            for colour, (x_m, y_m, z_m) in zip(COLOURS, centres_m, strict=True)
        )
        if shapes is not None:
            shaped = zip(gates, shapes, strict=True)
            gates = tuple(gate.model_copy(update=asdict(shape)) for gate, shape in shaped)
        if closeness is None or closeness.leaves_ways(base, gates):
            return base, gates
    room = " × ".join(f"{span.high - span.low:g}" for span in (layout.x_m, layout.y_m))
    near = "" if closeness is None else " with what closeness demands"
    raise LevelError(
        f"level {level.name}, seed {seed}: {MAX_DRAWS} draws found no room for {count} places "
        f"{layout.apart_m:g} m apart in {room} m{near}; lower layout.apart_m or widen layout.x_m and "
        "layout.y_m"
    )
