"""Several drones in one world: their starting positions, and their contact with each other.

Each drone has its own physics. While two are near, each is a solid box for the other at its position in this
control period, so they push each other away. The downwash of one does not affect another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import dist

from framerunner.geometry.solids import Solid
from scenarios.models import Scenario, StartPose, is_over_base
from sitl.world import World

_SPACING_M = 1.5  # between starting positions, more for large drones
_NEAR_M = 1.0  # between the centres, beyond the drones' own size
_APART_TICKS = 5  # between checks of drones that are not near; 0.02 s


class Fleet:
    """Places the drones of one world as solids in each other's world.

    Args:
        worlds: one a drone.
        notice: called with a line for people when two drones touch.
    """

    def __init__(self, worlds: Sequence[World], notice: Callable[[str], None] = lambda line: None) -> None:
        self._worlds = worlds
        self._notice = notice
        self._reach_m = _NEAR_M + 2 * max(world.radius_m for world in worlds)
        self._ticks = 0
        self._touching: set[tuple[int, int]] = set()
        self._near = False

    def tick(self) -> None:
        """Update the neighbours of each drone; to be called after all have advanced."""
        if len(self._worlds) < 2:
            return
        self._ticks += 1
        if not self._near and self._ticks % _APART_TICKS:
            return
        worlds = self._worlds
        at = [world.position_arena_m for world in worlds]
        pairs = [(i, j) for i in range(len(worlds)) for j in range(i) if dist(at[i], at[j]) < self._reach_m]
        if not pairs and not self._near:
            return
        self._near = bool(pairs)
        boxes = [world.box(_name(number)) for number, world in enumerate(worlds)]
        for i, world in enumerate(worlds):
            world.set_neighbours(tuple(boxes[a + b - i] for a, b in pairs if i in (a, b)))
        self._report_touching(pairs)

    def others(self, number: int) -> list[Solid]:
        """The boxes of all drones but one, for its camera."""
        return [world.box(_name(i)) for i, world in enumerate(self._worlds) if i != number]

    def _report_touching(self, pairs: list[tuple[int, int]]) -> None:
        touching = {
            (i, j)
            for i, j in pairs
            if _name(j) in self._worlds[i].touched or _name(i) in self._worlds[j].touched
        }
        for i, j in sorted(touching - self._touching):
            self._notice(f"{_name(j)} and {_name(i)} touch each other")
        self._touching = touching


def _name(number: int) -> str:
    return f"drone {number + 1}"


def side_by_side(scenario: Scenario, count: int, width_m: float) -> list[Scenario]:
    """The scenario once for each drone: the first at its start, the others around it on the floor.

    Positions are those of a square grid around the start, the nearest first, inside the arena, beside the
    base, gates and obstacles, 1.5 m or more apart; all have the heading of the scenario.

    Args:
        scenario: of the first drone.
        count: number of drones.
        width_m: of a drone.

    Raises:
        ValueError: the arena has no room for them.
    """
    spacing_m = max(_SPACING_M, 2 * width_m)
    places = [(scenario.start.x_m, scenario.start.y_m)]
    reach = int(max(scenario.arena.length_x_m, scenario.arena.width_y_m) / spacing_m) + 1
    steps = range(-reach, reach + 1)
    grid = sorted(((i, j) for i in steps for j in steps if (i, j) != (0, 0)), key=_order)
    for i, j in grid:
        if len(places) == count:
            break
        place = (places[0][0] + i * spacing_m, places[0][1] + j * spacing_m)
        if _has_room(scenario, place, width_m):
            places.append(place)
    if len(places) < count:
        raise ValueError(f"{scenario.name} has room for {len(places)}, not for {count} drones")
    yaw_rad = scenario.start.yaw_rad
    return [
        scenario.model_copy(update={"start": StartPose(x_m=x_m, y_m=y_m, yaw_rad=yaw_rad)})
        for x_m, y_m in places
    ]


def _order(cell: tuple[int, int]) -> tuple[int, int, int]:
    """Order of starting positions: near ones first, then left and right before front and back."""
    i, j = cell
    return (i * i + j * j, abs(i), -j * 10 - i)


def _has_room(scenario: Scenario, place: tuple[float, float], width_m: float) -> bool:
    x_m, y_m = place
    arena = scenario.arena
    if abs(x_m) > arena.length_x_m / 2 - width_m or abs(y_m) > arena.width_y_m / 2 - width_m:
        return False
    base = scenario.base.model_copy(update={"edge_m": scenario.base.edge_m + 2 * width_m})
    if is_over_base(base, x_m, y_m):
        return False
    if any(prism.plan_distance_m(x_m, y_m) <= width_m for prism in scenario.prisms):
        return False
    return all(
        dist(place, (gate.x_m, gate.y_m)) > gate.outer_width_m / 2 + width_m for gate in scenario.all_gates
    )
