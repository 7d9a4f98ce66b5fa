"""Where to look next for gates: searches of a drone that flies as asked, without images or physics."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, hypot, pi, radians, remainder, sin, tau

import pytest

from framerunner.geometry.axes import Pose
from framerunner.geometry.gate_shape import GateShapes
from framerunner.geometry.rotations import quaternion_from_yaw
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.exploration import Explorer
from offboard.navigation.search.likelihood import Glimpses, LineOfSight
from scenarios.models import Arena, Camera, Gate, Scenario
from scenarios.random_scenarios import load_level, random_scenario
from vision.types import Detection, Detections, ObstacleEdge

CAMERA = CameraModel.of(Camera())
STEP_S = 0.1  # one image


def recognised(gate, position_m, yaw_rad):
    """Whether a gate is wholly in view, within 6 m and less than 70 degrees off its normal."""
    pose = CAMERA.pose(position_m, quaternion_from_yaw(yaw_rad))
    offset = [a - b for a, b in zip(gate.position_arena_m, pose.position_m, strict=True)]
    distance_m = hypot(*offset)
    normal = (cos(gate.yaw_rad), sin(gate.yaw_rad))
    facing = abs(offset[0] * normal[0] + offset[1] * normal[1])
    if distance_m > 6.0 or facing < distance_m * cos(radians(70.0)):
        return False
    corners = [
        (gate.x_m - side * normal[1], gate.y_m + side * normal[0], gate.z_m + up)
        for side in (-0.21, 0.21)
        for up in (-0.11, 0.11)
    ]
    pixels = [CAMERA.project(pose, corner) for corner in corners]
    return all(each is not None and CAMERA.contains(*each) for each in pixels)


@dataclass
class Search:
    """A drone that flies to viewpoints at 1 m/s and turns at 0.9 rad/s meanwhile; it finds by two images."""

    frames: tuple[Gate, ...]
    position_m: tuple[float, float, float]
    yaw_rad: float
    explorer: Explorer = field(default_factory=lambda: Explorer(CAMERA, Arena()))
    time_s: float = 0.0
    images: dict[str, int] = field(default_factory=dict)
    viewpoints: list[Pose] = field(default_factory=list)

    @classmethod
    def of(cls, scenario: Scenario):
        start = scenario.start
        return cls(scenario.frames, (start.x_m, start.y_m, scenario.base.top_m), start.yaw_rad)

    def found(self):
        return [gate for gate in self.frames if self.images.get(gate.colour, 0) >= 2]

    def run(self, limit_s, colours=("red", "green", "blue")):
        """Search until some gates are found; returns the time."""
        ticks = 0
        while self.time_s < limit_s and not set(colours) <= {each.colour for each in self.found()}:
            for gate in self.frames:
                if recognised(gate, self.position_m, self.yaw_rad):
                    self.images[gate.colour] = self.images.get(gate.colour, 0) + 1
            self.explorer.coverage.update(self.position_m, quaternion_from_yaw(self.yaw_rad))
            if ticks % 5 == 0:
                known = [gate.position_arena_m for gate in self.found()]
                self.viewpoints.append(self.explorer.next_viewpoint(self.position_m, self.yaw_rad, known))
            self.step(self.viewpoints[-1])
            ticks += 1
        return self.time_s

    def step(self, viewpoint):
        way = [b - a for a, b in zip(self.position_m, viewpoint.position_m, strict=True)]
        share = min(STEP_S / max(hypot(*way), 1e-9), 1.0)
        self.position_m = tuple(a + share * d for a, d in zip(self.position_m, way, strict=True))
        turn = remainder(viewpoint.yaw_rad - self.yaw_rad, tau)
        self.yaw_rad = remainder(self.yaw_rad + max(-0.09, min(0.09, turn)), tau)
        self.time_s += STEP_S


def test_random_layouts_are_found_soon():
    level = load_level("calm")
    times_s = sorted(Search.of(random_scenario(level, seed)).run(60.0) for seed in range(20))
    assert times_s[10] < 9.0
    assert times_s[-1] < 40.0


@pytest.mark.parametrize(
    "place",
    [
        (4.85, 4.85, 0.15, -pi / 4),  # in a corner on the floor, across the diagonal
        (-4.85, 4.85, 3.85, pi / 4),  # in a corner under the ceiling
        (4.9, 0.5, 3.9, pi / 2),  # at a wall, its normal along it
        (0.3, 0.2, 0.12, 1.0),  # on the floor, seldom wholly in view from above
    ],
)
def test_a_gate_where_few_views_show_it_is_found(place):
    x_m, y_m, z_m, yaw_rad = place
    gate = Gate(colour="red", x_m=x_m, y_m=y_m, z_m=z_m, yaw_rad=yaw_rad)
    assert Search((gate,), (-1.0, -2.0, 0.5), 2.0).run(150.0, ("red",)) < 150.0


def test_what_is_not_there_is_looked_for_in_ever_new_places():
    search = Search((), (0.0, 0.0, 0.5), 0.0)
    search.run(150.0, ("red",))
    late = [each.position_m for each in search.viewpoints[-60:]]
    assert len({tuple(round(value) for value in place) for place in late}) > 5


def test_the_drone_turns_at_once_and_away_from_what_it_saw():
    explorer = Explorer(CAMERA, Arena())
    explorer.coverage.update((0.0, 0.0, 0.5), quaternion_from_yaw(0.0))
    first = explorer.next_viewpoint((0.0, 0.0, 0.5), 0.0)
    assert abs(first.yaw_rad) > 0.5
    assert hypot(*first.position_m[:2]) < 3.0


def test_a_viewpoint_that_cannot_be_reached_is_followed_by_others():
    explorer, here_m = Explorer(CAMERA, Arena()), (-4.0, -4.0, 0.5)
    explorer.coverage.update(here_m, quaternion_from_yaw(0.0))
    places = []
    for _ in range(40):
        places.append(explorer.next_viewpoint(here_m, 0.0).position_m)
        explorer.refuse()
    assert len({tuple(round(value) for value in place) for place in places}) > 10


def test_a_line_of_sight_is_looked_along_first():
    explorer = Explorer(CAMERA, Arena())
    explorer.coverage.update((0.0, 0.0, 1.0), quaternion_from_yaw(0.0))
    for bearing in (2.0, -2.0):
        hint = LineOfSight((0.08, 0.0, 1.0), (cos(bearing), sin(bearing), 0.0))
        viewpoint = explorer.next_viewpoint((0.0, 0.0, 1.0), 0.0, hints=[hint])
        assert viewpoint.yaw_rad * bearing > 0


def test_viewpoints_keep_clear_of_obstacles_and_turning_is_always_possible():
    search = Search((), (0.0, 0.0, 1.0), 0.0)
    post = (2.0, 0.0, 1.5)
    for _ in range(40):
        viewpoint = search.explorer.next_viewpoint(search.position_m, search.yaw_rad, columns_m=[post])
        assert hypot(viewpoint.position_m[0] - 2.0, viewpoint.position_m[1]) >= 1.5
        search.explorer.coverage.update(search.position_m, quaternion_from_yaw(search.yaw_rad))
        search.step(viewpoint)
    everywhere = (0.0, 0.0, 20.0)
    blocked = search.explorer.next_viewpoint(search.position_m, 0.0, columns_m=[everywhere])
    assert blocked.position_m == search.position_m
    assert blocked.yaw_rad != 0.0


def test_nothing_behind_an_obstacle_counts_as_seen():
    clear, hidden = Explorer(CAMERA, Arena()), Explorer(CAMERA, Arena())
    edges = tuple(ObstacleEdge(float(column), 80.0, cut=False) for column in range(-160, 160, 4))
    clear.coverage.update((-4.0, 0.0, 1.0), quaternion_from_yaw(0.0))
    hidden.coverage.update((-4.0, 0.0, 1.0), quaternion_from_yaw(0.0), edges)  # its lower end is 2 m ahead
    x_m = clear.coverage.grid.blocks().centres()[0]
    assert clear.coverage.blocks()[:, x_m > -1.0].max() > 0.5
    assert hidden.coverage.blocks()[:, x_m > -1.0].max() == 0.0
    assert hidden.coverage.blocks()[:, x_m < -2.0].max() > 0.0


def test_searches_repeat_to_the_last_bit():
    scenario = random_scenario(load_level("calm"), 7)
    first, second = (Search.of(scenario) for _ in range(2))
    first.run(12.0, ("none",))
    second.run(12.0, ("none",))
    assert first.viewpoints == second.viewpoints
    assert first.position_m == second.position_m


def test_a_wall_is_not_looked_through_but_flown_round():
    wall = [(0.0, -4.8 + 0.3 * step, 0.2) for step in range(24)]  # at x = 0, up to y = 2.1
    explorer = Explorer(CAMERA, Arena())
    for x in range(-4, 0):
        for y in range(-4, 5):
            for yaw in (1.5, 2.3, 3.1, -2.3, -1.5):  # all but eastwards
                for z in (0.6, 1.5, 2.7):
                    explorer.coverage.update((float(x), float(y), z), quaternion_from_yaw(yaw))
    open_view = explorer.next_viewpoint((-1.0, -3.0, 1.5), 0.0)
    walled_view = explorer.next_viewpoint((-1.0, -3.0, 1.5), 0.0, columns_m=wall)
    assert open_view.position_m[1] < 0.0
    assert abs(open_view.yaw_rad) < pi / 2
    assert walled_view.position_m[1] > 1.0


def test_a_gate_that_was_glimpsed_draws_a_line_of_sight_until_it_is_known():
    glimpses = Glimpses(CAMERA, GateShapes())
    box = Detection(n=20.0, s=9.0, e=-138.0, w=-159.0)  # as high as a gate 3.2 m away
    level = quaternion_from_yaw(0.0)
    seen = ((0.0, 0.0, 1.0), level, Detections(red=box), ())
    glimpses.update(*seen, is_lookalike=lambda colour, line: colour == "red")
    assert glimpses.lines() == ()
    glimpses.update(*seen, is_lookalike=lambda colour, line: False)
    [line] = glimpses.lines()
    assert line.direction == pytest.approx((0.73, 0.68, 0.07), abs=0.01)
    assert 3.2 < line.farthest_m < 6.0
    glimpses.update((0.0, 0.0, 1.0), level, Detections(), (), lambda colour, line: False)
    assert glimpses.lines() == (line,)
    glimpses.update((0.0, 0.0, 1.0), level, Detections(), ("red",), lambda colour, line: False)
    assert glimpses.lines() == ()
