"""Resets of a vehicle's estimator in its ODOMETRY, and what becomes of the app's axes."""

import json
from math import cos, radians, sin
from types import SimpleNamespace

import pytest

from framerunner.geometry.axes import ArenaAlignment, Pose
from offboard.drone import DroneError
from offboard.link.resets import ResetFeed, followed

START_ARENA, START_NED = Pose((-3.0, -3.0, 0.5), 1.0), Pose((0.1, 0.2, -0.5), 0.3)
STEP_S = 1 / 30


class Vehicle:
    """Flies straight on while it turns; its estimator may be reset."""

    def __init__(self, body_frame=False):
        self.feed = ResetFeed()
        self.feed.subscribe(self)
        self.x, self.y, self.yaw, self.time_s, self.resets = 0.1, 0.2, 0.3, 5.0, 0
        self.north, self.east, self.turn = 0.5, -0.2, 1.0  # m/s, rad/s
        self.body_frame = body_frame

    def subscribe_message(self, name, callback):
        assert name == "ODOMETRY"
        self.callback = callback

    def fly(self, seconds):
        self.time_s += seconds
        self.x, self.y = self.x + seconds * self.north, self.y + seconds * self.east
        self.yaw += seconds * self.turn
        return self

    def reset(self, turned_rad=0.0, moved_m=0.0):
        self.resets = (self.resets + 1) % 256
        self.yaw, self.x = self.yaw + turned_rad, self.x + moved_m
        return self

    def report(self, *, time_s=None, component=1, **changed):
        c, s = cos(self.yaw), sin(self.yaw)
        forward = (c * self.north + s * self.east, c * self.east - s * self.north)
        vx, vy = forward if self.body_frame else (self.north, self.east)
        fields = {"time_usec": round(1e6 * (time_s or self.time_s)), "frame_id": 1}
        fields |= {"child_frame_id": 12 if self.body_frame else 1, "reset_counter": self.resets}
        fields |= {"x": self.x, "y": self.y, "z": -1.5, "q": [cos(self.yaw / 2), 0.0, 0.0, sin(self.yaw / 2)]}
        fields |= {"vx": vx, "vy": vy, "vz": 0.0, "rollspeed": 0.0, "pitchspeed": 0.0, "yawspeed": self.turn}
        told = json.dumps(fields | changed)
        self.callback(SimpleNamespace(system_id=1, component_id=component, fields_json=told), None)
        return self


@pytest.mark.parametrize("body_frame", [False, True])
@pytest.mark.parametrize("turned_deg", [4.0, -25.0, 179.0])
def test_a_turned_frame_is_followed_and_the_drone_stays_where_it_is(turned_deg, body_frame):
    alignment, vehicle = ArenaAlignment(START_ARENA, START_NED), Vehicle(body_frame)
    vehicle.report().fly(STEP_S)
    true = alignment.pose(Pose((vehicle.x, vehicle.y, -1.5), vehicle.yaw))
    (jump,) = vehicle.reset(radians(turned_deg)).report().feed.take()
    after = followed(alignment, jump, drifts=False)
    now = after.pose(Pose((vehicle.x, vehicle.y, -1.5), vehicle.yaw))
    assert now.position_m == pytest.approx(true.position_m, abs=1e-3)
    assert now.yaw_rad == pytest.approx(true.yaw_rad, abs=1e-3)
    # Flown on in the turned frame, towards where the nose points.
    ahead = Pose((vehicle.x + cos(vehicle.yaw), vehicle.y + sin(vehicle.yaw), -1.5), vehicle.yaw)
    x, y, _ = after.position(ahead.position_m)
    assert (x, y) == pytest.approx(
        (now.position_m[0] + cos(true.yaw_rad), now.position_m[1] + sin(true.yaw_rad))
    )
    assert vehicle.fly(STEP_S).report().feed.take() == []


def test_a_small_change_of_the_position_is_a_correction():
    alignment, vehicle = ArenaAlignment(START_ARENA, START_NED), Vehicle()
    (jump,) = vehicle.report().fly(STEP_S).reset(moved_m=0.1).report().feed.take()
    assert followed(alignment, jump, drifts=False) is alignment


@pytest.mark.parametrize(
    ("gap_s", "moved_m", "changed", "told"),
    [
        (STEP_S, 0.8, {}, "was reset, and moved its position by 0.8 m"),
        (1.0, 0.0, {}, "was reset, and by how much is not known"),
        (STEP_S, 0.0, {"x": None}, "was reset, and by how much is not known"),
    ],
)
def test_a_place_that_is_not_known_ends_the_flight_in_words(gap_s, moved_m, changed, told):
    vehicle = Vehicle().report().fly(gap_s).reset(radians(10), moved_m).report(**changed)
    (jump,) = vehicle.feed.take()
    with pytest.raises(DroneError, match=told):
        followed(ArenaAlignment(START_ARENA, START_NED), jump, drifts=False)


@pytest.mark.parametrize("turned_deg", [0.0, 30.0])
def test_a_drifting_vehicle_is_followed_wherever_its_estimator_moves(turned_deg):
    alignment, vehicle = ArenaAlignment(START_ARENA, START_NED), Vehicle().report().fly(STEP_S)
    true = alignment.pose(Pose((vehicle.x, vehicle.y, -1.5), vehicle.yaw))
    (jump,) = vehicle.reset(radians(turned_deg), moved_m=2.0).report().feed.take()
    after = followed(alignment, jump, drifts=True)
    now = after.pose(Pose((vehicle.x, vehicle.y, -1.5), vehicle.yaw))
    assert now.position_m == pytest.approx(true.position_m, abs=1e-3)
    assert now.yaw_rad == pytest.approx(true.yaw_rad, abs=1e-3)


def test_packets_that_are_late_and_those_of_others_are_no_resets():
    vehicle = Vehicle().report().fly(STEP_S).reset(radians(10)).report()
    assert len(vehicle.feed.take()) == 1
    vehicle.resets -= 1
    vehicle.report(time_s=vehicle.time_s - STEP_S)  # swapped on the link
    vehicle.report(component=197, reset_counter=77)  # a motion capture's, on its way to the vehicle
    vehicle.report(frame_id=20, reset_counter=78)
    vehicle.resets += 1
    vehicle.fly(STEP_S).report()
    assert vehicle.feed.take() == []
    assert vehicle.feed.heard


def test_a_packet_from_before_a_reset_that_is_late_by_more_than_a_step_is_no_reset():
    vehicle = Vehicle().report().fly(STEP_S).reset(radians(10)).report()
    assert len(vehicle.feed.take()) == 1
    vehicle.report(time_s=vehicle.time_s - 0.5, reset_counter=0).fly(STEP_S).report()
    assert vehicle.feed.take() == []
