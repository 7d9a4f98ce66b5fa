"""Obstacles of random scenarios: decoys, poles and a wall with a doorway, with room between all things."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, dist, hypot, sin, sqrt
from typing import TYPE_CHECKING, Annotated, Self

from pydantic import Field, model_validator

from framerunner.geometry.solids import Solid
from scenarios.models import (
    DECOY_COLOURS,
    Arena,
    Decoy,
    Doorway,
    Pole,
    Scenario,
    Wall,
)
from scenarios.part import Part
from scenarios.random_numbers import (
    MAX_DRAWS,
    FrameHeight,
    Heading,
    LevelError,
    PlaceX,
    PlaceY,
    Range,
    random_stream,
    within,
)

if TYPE_CHECKING:
    from numpy.random import Generator

_BESIDE_DOORWAY_M = 0.5  # of wall, at least, on each side


class RandomDecoys(Part):
    """Frames of other colours."""

    count: int = Field(ge=1, le=20, description="how many, cyan and magenta by turns")
    z_m: FrameHeight = Field(description="centres of the openings above the floor")
    yaw_rad: Heading = Field(description="headings of their normals")


class RandomPoles(Part):
    """Poles from the floor to the ceiling."""

    count: int = Field(ge=1, le=20, description="how many")
    edge_m: Annotated[Range, within(0.02, 2.0)] = Field(description="edges of their squares")


class RandomWall(Part):
    """A wall from the floor to the ceiling, anywhere that both its ends are inside the arena."""

    length_m: Range = Field(description="from end to end, doorway included")
    yaw_rad: Heading = Field(description="heading from where it begins to where it ends")
    doorway_m: float = Field(1.2, ge=1.0, le=10, description="width of its doorway, which is anywhere in it")

    @model_validator(mode="after")
    def _doorway_fits(self) -> Self:
        arena, shortest_m = Arena(), self.doorway_m + 2 * _BESIDE_DOORWAY_M
        self.length_m.check(shortest_m, hypot(arena.length_x_m, arena.width_y_m), "length_m")
        return self


class RandomObstacles(Part):
    """What else is in the arena, beside base and frames."""

    x_m: PlaceX = Field(description="centres of the obstacles")
    y_m: PlaceY = Field(description="centres of the obstacles")
    free_m: float = Field(
        ge=0.01,
        le=10,
        description="least gap, seen from above, between an obstacle and any other thing; a doorway counts "
        "as wall, so that this is free before and behind it",
    )
    decoys: RandomDecoys | None = Field(None, description="frames of other colours")
    poles: RandomPoles | None = Field(None, description="poles")
    wall: RandomWall | None = Field(None, description="a wall with a doorway")


@dataclass(frozen=True, slots=True)
class _Disc:
    """The circle around a thing, seen from above."""

    x_m: float
    y_m: float
    radius_m: float

    def gap_m(self, other: _Disc | Solid) -> float:
        """Gap to another thing, below zero where they overlap."""
        if isinstance(other, Solid):
            return other.plan_distance_m(self.x_m, self.y_m) - self.radius_m
        return dist((self.x_m, self.y_m), (other.x_m, other.y_m)) - self.radius_m - other.radius_m


def add_obstacles(scenario: Scenario, obstacles: RandomObstacles, seed: int) -> Scenario:
    """Draw obstacles for a scenario that has base and gates, each kind from its own streams.

    The wall is placed first, then the poles, then the decoys: what needs most room, first. All of a kind are
    drawn again when one of them has no room: redrawing only that one would favour some places.

    Raises:
        LevelError: there is (nearly) no room.
    """
    room = _Room(scenario, obstacles, seed)
    added = {
        "walls": () if obstacles.wall is None else (room.draw_wall(obstacles.wall),),
        "poles": () if obstacles.poles is None else room.draw_poles(obstacles.poles),
        "decoys": () if obstacles.decoys is None else room.draw_decoys(obstacles.decoys),
    }
    return Scenario.model_validate(dict(scenario) | added)


class _Room:
    """What is free of things, seen from above."""

    def __init__(self, scenario: Scenario, obstacles: RandomObstacles, seed: int) -> None:
        base = scenario.base
        self._things: list[_Disc | Solid] = [_Disc(base.x_m, base.y_m, hypot(base.edge_m, base.edge_m) / 2)]
        self._things += [_Disc(one.x_m, one.y_m, one.outer_width_m / 2) for one in scenario.frames]
        self._scenario, self._obstacles, self._seed = scenario, obstacles, seed

    def draw_wall(self, ranges: RandomWall) -> Wall:
        """Draw a wall and add it to the things."""
        arena, stream = self._scenario.arena, random_stream(self._seed, "obstacles.wall")
        for _ in range(MAX_DRAWS):
            x_m, y_m = self._draw_place(stream)
            length_m, yaw_rad = ranges.length_m.draw_value(stream), ranges.yaw_rad.draw_value(stream)
            half_x_m, half_y_m = length_m / 2 * cos(yaw_rad), length_m / 2 * sin(yaw_rad)
            # Away from its ends by half the doorway and the least wall beside it.
            nearest_m = round(ranges.doorway_m / 2 + _BESIDE_DOORWAY_M, 3)
            offset_m = Range(low=nearest_m, high=round(length_m - nearest_m, 3)).draw_value(stream)
            if (
                abs(x_m) + abs(half_x_m) > arena.length_x_m / 2
                or abs(y_m) + abs(half_y_m) > arena.width_y_m / 2
            ):
                continue
            wall = Wall(
                x_m=round(x_m - half_x_m, 3),
                y_m=round(y_m - half_y_m, 3),
                end_x_m=round(x_m + half_x_m, 3),
                end_y_m=round(y_m + half_y_m, 3),
                doorway=Doorway(offset_m=offset_m, width_m=ranges.doorway_m),
            )
            (filled,) = wall.model_copy(update={"doorway": None}).solids(arena.height_m)
            if all(
                thing.gap_m(filled) >= self._obstacles.free_m
                for thing in self._things
                if isinstance(thing, _Disc)
            ):
                self._things.append(filled)
                return wall
        raise self._no_room("wall")

    def draw_poles(self, ranges: RandomPoles) -> tuple[Pole, ...]:
        """Draw poles and add them to the things."""
        sizes = random_stream(self._seed, "obstacles.pole_edges")
        edges_m = [ranges.edge_m.draw_value(sizes) for _ in range(ranges.count)]
        discs = self._draw_discs("poles", [edge_m / sqrt(2.0) for edge_m in edges_m])
        return tuple(
            Pole(x_m=disc.x_m, y_m=disc.y_m, edge_m=edge_m)
            for disc, edge_m in zip(discs, edges_m, strict=True)
        )

    def draw_decoys(self, ranges: RandomDecoys) -> tuple[Decoy, ...]:
        """Draw decoys and add them to the things."""
        radius_m: float = Decoy.model_fields["outer_width_m"].default / 2
        discs = self._draw_discs("decoys", [radius_m] * ranges.count)
        heights = random_stream(self._seed, "obstacles.decoy_heights")
        yaws = random_stream(self._seed, "obstacles.decoy_yaws")
        return tuple(
            Decoy(
                colour=colour,
                x_m=disc.x_m,
                y_m=disc.y_m,
                z_m=ranges.z_m.draw_value(heights),
                yaw_rad=ranges.yaw_rad.draw_value(yaws),
            )
            for disc, colour in zip(discs, itertools.cycle(DECOY_COLOURS), strict=False)
        )

    def _draw_discs(self, kind: str, radii_m: Sequence[float]) -> list[_Disc]:
        """Draw places for all things of a kind, and add them to the things."""
        stream, free_m = random_stream(self._seed, f"obstacles.{kind}"), self._obstacles.free_m
        for _ in range(MAX_DRAWS):
            things = list(self._things)
            for radius_m in radii_m:
                disc = _Disc(*self._draw_place(stream), radius_m)
                if any(disc.gap_m(thing) < free_m for thing in things):
                    break
                things.append(disc)
            else:
                self._things, drawn = things, things[len(self._things) :]
                return [disc for disc in drawn if isinstance(disc, _Disc)]
        raise self._no_room(kind)

    def _draw_place(self, stream: Generator) -> tuple[float, float]:
        return (self._obstacles.x_m.draw_value(stream), self._obstacles.y_m.draw_value(stream))

    def _no_room(self, kind: str) -> LevelError:
        return LevelError(
            f"{self._scenario.name}: {MAX_DRAWS} draws found no room for obstacles.{kind}; lower "
            f"obstacles.free_m or widen obstacles.x_m and obstacles.y_m"
        )
