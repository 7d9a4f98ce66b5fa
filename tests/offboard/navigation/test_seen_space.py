"""Space that was seen to be free, and flights that stop before space that was not."""

from __future__ import annotations

from dataclasses import replace
from math import atan2, cos, dist, hypot, pi, sin

import pytest

from framerunner.geometry.gate_shape import GateShape, GateShapes
from framerunner.geometry.rotations import quaternion_from_yaw
from offboard.drone import DroneState
from offboard.limits import CONTEST as CONTEST_LIMITS
from offboard.navigation import path_flight
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.goals import CONTEST, Obstacles, PathGate, Point
from offboard.navigation.path_flight import TICK_WORK, PathFlight
from offboard.navigation.seen_space import SeenSpace, ViewedSpace
from scenarios.models import Arena, Base, Camera
from tests.offboard.navigation.flown_layouts import flown
from tests.offboard.navigation.test_obstacle_map import edges_of

CAMERA = CameraModel.of(Camera(position_flu_m=(0.0, 0.0, 0.0)))
POSTS = [(3.0, 0.0, 0.2)]
HERE = (0.0, 0.0, 1.0)
VIEWED = ViewedSpace(CAMERA, Base(x_m=-4.0, y_m=-4.0), GateShapes())  # without a view: nothing is asked of it


def seen_from(position_m=HERE, yaw_rad=0.0, posts=POSTS):
    seen = SeenSpace(CAMERA, Arena())
    edges = edges_of(posts, position_m, yaw_rad)
    seen.update(position_m, quaternion_from_yaw(yaw_rad), edges)
    return seen


def test_space_is_seen_before_and_beside_an_obstacle_but_not_behind_it_or_outside_the_view():
    seen = seen_from()
    for free in [(0.5, 0.0), (2.3, 0.0), (2.0, 1.5), (4.5, 2.0), (0.0, 0.1)]:
        assert seen.is_seen((*free, 1.0)), free
    for unknown in [(3.0, 0.0), (4.0, 0.0), (0.5, 1.0), (-1.0, 0.0), (1.0, -2.0)]:
        assert not seen.is_seen((*unknown, 1.0)), unknown


def test_a_way_must_have_been_seen_once_an_obstacle_was():
    way = [(0.0, 0.1 * step, 1.0) for step in range(1, 15)]
    assert seen_from(posts=[]).first_unseen(way, HERE) is None
    stopped_by = seen_from().first_unseen(way, HERE)
    assert stopped_by is not None
    assert 0.1 < hypot(*stopped_by[:2]) < 1.0
    assert seen_from().first_unseen([(0.1 * step, 0.0, 1.0) for step in range(1, 20)], HERE) is None


def test_before_an_obstacle_whose_foot_is_below_the_image_nothing_is_seen():
    assert not seen_from(posts=[(1.0, 0.0, 0.2)]).is_seen((0.5, 0.0, 1.0))


def test_a_place_is_not_viewed_from_where_a_small_gate_there_would_not_be_recognised():
    small = GateShapes(other=GateShape(0.3, 0.15, 0.01, 0.01))
    for shapes, viewed in ((GateShapes(), True), (small, False)):
        space = ViewedSpace(CAMERA, Base(x_m=-4.0, y_m=-4.0), shapes)
        space.update(CAMERA.pose(HERE, quaternion_from_yaw(0.0)))
        assert space.is_viewed((1.5, 0.0, 1.0))
        assert space.is_viewed((4.0, 0.0, 1.0)) is viewed


def test_a_suspect_is_forgotten_when_it_is_seen_to_be_free():
    seen = seen_from()
    seen.suspect((0.0, 1.0, 1.0))
    assert len(seen.suspects_m) == 1
    seen.update(HERE, quaternion_from_yaw(pi / 2), ())
    assert seen.suspects_m == ()


@pytest.mark.parametrize("goal_m", [(0.0, 2.0, 1.0), (-2.0, 0.5, 1.0), (-1.0, -2.0, 1.0)])
def test_drone_looks_where_it_will_fly_and_then_flies_there(goal_m):
    seen, flight = seen_from(), PathFlight(Arena(), CONTEST, CONTEST_LIMITS)
    state = DroneState(0, *HERE, yaw=0.0)
    for tick in range(200):
        command = flight.fly([Point(goal_m)], Obstacles(), state, seen, VIEWED)
        if command.forward_m_s or command.left_m_s:
            break
        yaw_rad = state.yaw + 0.05 * command.yaw_rate_rad_s
        state = replace(state, time_us=tick * 50_000, yaw=yaw_rad)
        seen.update(HERE, quaternion_from_yaw(yaw_rad), ())
    assert abs(state.yaw - atan2(goal_m[1], goal_m[0])) < pi / 4
    assert flight.path is not None


def test_a_path_that_is_obstructed_is_planned_again_at_once():
    seen, flight = SeenSpace(CAMERA, Arena()), PathFlight(Arena(), CONTEST, CONTEST_LIMITS)
    state = DroneState(0, *HERE, yaw=0.0)
    flight.fly([Point((3.0, 0.0, 1.0))], Obstacles(), state, seen, VIEWED)
    before = flight.path
    flight.fly(
        [Point((3.0, 0.0, 1.0))],
        Obstacles(columns_m=((0.6, 0.0, 0.1),)),
        replace(state, time_us=50_000),
        seen,
        VIEWED,
    )
    assert flight.path is not None
    assert flight.path is not before
    assert all(hypot(x - 0.6, y) > 0.3 for x, y, _ in flight.path.points_m)


def test_a_drone_that_is_held_near_its_path_plans_from_where_it_is():
    seen, flight = SeenSpace(CAMERA, Arena()), PathFlight(Arena(), CONTEST, CONTEST_LIMITS)
    paths = []
    for tick in range(100):
        state = DroneState(50_000 * tick, *HERE, yaw=0.0)
        flight.fly([Point((0.2, 0.0, 1.0))], Obstacles(), state, seen, VIEWED)
        if flight.path is not None and flight.path not in paths:
            paths.append(flight.path)
    assert 2 <= len(paths) <= 5  # not at every tick, either
    assert all(dist(path.at(0.0).position_m, HERE) < 0.02 for path in paths)


def test_a_path_after_a_pause_begins_at_its_start():
    seen, flight = SeenSpace(CAMERA, Arena()), PathFlight(Arena(), CONTEST, CONTEST_LIMITS)
    goals, state = [Point((2.0, 0.0, 1.0))], DroneState(0, *HERE, yaw=0.0)
    for tick in range(10):
        flight.fly(goals, Obstacles(), replace(state, time_us=50_000 * tick), seen, VIEWED)
    flight.stop()
    flight.fly(goals, Obstacles(), replace(state, time_us=1_500_000), seen, VIEWED)
    assert flight.path is not None
    assert flight._follower.progress_on(flight.path) == 0.0
    for tick in (1, 2):  # what is commanded first is flown after the vehicle's dead time
        flight.fly(goals, Obstacles(), replace(state, time_us=1_500_000 + 50_000 * tick), seen, VIEWED)
        assert flight._follower.progress_on(flight.path) == pytest.approx(max(0.05 * tick - 0.0625, 0.0))


def test_a_drone_that_stops_before_unseen_space_does_not_fly_on_while_it_plans():
    """It finds ways round what may be there, and leaves each at once, because nothing of them was seen."""
    seen, flight = seen_from(), PathFlight(Arena(), CONTEST, CONTEST_LIMITS)
    state, stopping_m_s, most_m_s = DroneState(0, *HERE, yaw=0.0), [], 0.0
    for _ in range(160):
        command = flight.fly([Point((4.0, 0.0, 1.0))], Obstacles((), seen.suspects_m), state, seen, VIEWED)
        state = flown(state, command)
        stopping_m_s = [*stopping_m_s, hypot(*state.velocity_arena_m_s)] if flight.path is None else []
        most_m_s = max(most_m_s, *stopping_m_s[20:], 0.0)
    assert len(seen.suspects_m) > 3  # for each of them it has planned again
    assert most_m_s < 0.1


def test_a_drone_stops_before_a_gate_that_turns_out_to_be_turned_if_there_is_no_other_way():
    beside = ((2.31, 0.32, 0.05), (1.69, -0.32, 0.05))  # before and behind its opening as it is
    seen, flight = SeenSpace(CAMERA, Arena()), PathFlight(Arena(), CONTEST, CONTEST_LIMITS)
    state = DroneState(0, *HERE, yaw=0.0)
    for _ in range(80):
        gate = PathGate((2.0, 0.0, 1.0), 0.0 if state.x < 1.2 else 0.8)
        obstacles = Obstacles((gate,), () if state.x < 1.2 else beside)
        state = flown(state, flight.fly([gate], obstacles, state, seen, VIEWED))
    assert flight.path is None
    assert 1.2 < state.x < 1.75


def test_where_obstacles_block_a_gate_no_tick_searches_for_long():
    ring = tuple((2.0 + 1.2 * cos(0.2 * i), 1.2 * sin(0.2 * i), 0.15) for i in range(32))
    gate, obstacles = PathGate((2.0, 0.0, 1.5), 0.3), Obstacles((PathGate((2.0, 0.0, 1.5), 0.3),), ring)
    seen, flight = SeenSpace(CAMERA, Arena()), PathFlight(Arena(), CONTEST, CONTEST_LIMITS)
    works = []
    while not flight.refusal:
        state = DroneState(50_000 * len(works), -1.0, 0.3, 1.0, yaw=0.0)
        flight.fly([gate, Point((0.0, 0.0, 1.0))], obstacles, state, seen, VIEWED)
        works.append(flight.work)
        assert len(works) < 60
    assert flight.refusal == "obstacles block the way to gate 1"
    assert sum(works) > 4 * TICK_WORK  # what a tick would do without a limit
    assert max(works) < 2.5 * TICK_WORK


def test_a_drone_that_stands_in_an_opening_finds_a_path_in_several_ticks(monkeypatch):
    monkeypatch.setattr(path_flight, "TICK_WORK", 1)
    seen, flight = SeenSpace(CAMERA, Arena()), PathFlight(Arena(), CONTEST, CONTEST_LIMITS)
    gate = PathGate((2.0, 0.0, 1.5), 0.0)
    for tick in range(10):
        state = DroneState(50_000 * tick, 1.9, 0.002 * (tick % 2), 1.5, yaw=0.0)
        flight.fly([gate], Obstacles((gate,)), state, seen, VIEWED)
        if flight.path is not None:
            break
    assert tick > 0
    assert flight.path is not None


def test_a_path_is_made_at_the_next_tick_if_it_does_not_fit_into_this_one(monkeypatch):
    """The work of making it counts: a search that just fits leaves no room for it."""
    goals, state = [Point((2.0, 0.0, 1.0))], DroneState(0, *HERE, yaw=0.0)
    works = {}
    for limit in (10**6, None):
        seen, flight = SeenSpace(CAMERA, Arena()), PathFlight(Arena(), CONTEST, CONTEST_LIMITS)
        monkeypatch.setattr(path_flight, "TICK_WORK", limit or sum(works[10**6]) - 1)
        works[limit] = []
        while flight.path is None:
            flight.fly(goals, Obstacles(), replace(state, time_us=50_000 * len(works[limit])), seen, VIEWED)
            works[limit].append(flight.work)
    assert len(works[10**6]) == 1
    assert len(works[None]) == 2
    assert sum(works[None]) == sum(works[10**6])


def height_after_a_metre(gate: PathGate, *, needed: bool) -> float:
    """The height of a drone that flies to a gate as it is told, where it is a metre nearer."""
    seen, viewed = SeenSpace(CAMERA, Arena()), ViewedSpace(CAMERA, Base(x_m=-4.0, y_m=-4.0), GateShapes())
    flight = PathFlight(Arena(), CONTEST, CONTEST_LIMITS)
    viewed.needed = needed
    state = DroneState(0, *HERE, yaw=0.0)
    for tick in range(200):
        viewed.update(CAMERA.pose((state.x, state.y, state.z), quaternion_from_yaw(0.0)))
        command = flight.fly([gate], Obstacles((gate,)), state, seen, viewed)
        x, z = state.x + 0.05 * command.forward_m_s, state.z + 0.05 * command.up_m_s
        velocity = (command.forward_m_s, 0.0, command.up_m_s)
        state = replace(state, time_us=50_000 * tick, x=x, z=z, velocity_arena_m_s=velocity)
        if x > 1.0:
            break
    return state.z


def test_before_a_steep_flight_to_a_gate_the_drone_climbs_until_the_way_is_in_view():
    gate = PathGate((3.0, 0.0, 3.0), 0.0)
    assert height_after_a_metre(gate, needed=True) > height_after_a_metre(gate, needed=False) + 0.3


def test_among_obstacles_a_drone_stops_on_its_path_and_looks_up_from_there():
    """Beside its path may be what it has not seen."""
    seen, viewed = (
        seen_from(posts=[(4.0, 3.0, 0.2)]),
        ViewedSpace(CAMERA, Base(x_m=-4.0, y_m=-4.0), GateShapes()),
    )
    flight, gate = PathFlight(Arena(), CONTEST, CONTEST_LIMITS), PathGate((3.0, 0.0, 3.0), 0.0)
    state, looking_m_s = DroneState(0, *HERE, yaw=0.0), []
    for _ in range(60):
        viewed.update(CAMERA.pose((state.x, state.y, state.z), quaternion_from_yaw(state.yaw)))
        command = flight.fly([gate], Obstacles((gate,)), state, seen, viewed)
        state = flown(state, command)
        if flight.looks:
            looking_m_s.append(hypot(command.forward_m_s, command.left_m_s))
    assert len(looking_m_s) > 10
    assert looking_m_s[-1] == 0.0
    assert sum(looking_m_s) * 0.05 < 0.3
