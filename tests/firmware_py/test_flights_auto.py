"""Flights of the x500 in automatic modes: take-off, hold, reposition, orbit, return, landing."""

from itertools import pairwise
from math import atan2, cos, degrees, dist, hypot, isnan, nan, radians, remainder, sin, tau

import pytest

from firmware_py.guidance.orbit import Orbit, OrbitYaw
from firmware_py.missions.items import PlanType
from firmware_py.status import CommandResult, FlightMode
from framerunner.vehicle.geodesy import GeodeticPoint
from tests.firmware_py.flying import ORIGIN, Flight
from tests.firmware_py.missions.mission_world import Do, at


def yaw_error_deg(sample, yaw_rad):
    return abs(degrees(remainder(sample.yaw_rad - yaw_rad, tau)))


@pytest.mark.parametrize(("height_m", "least_s", "most_s"), [(nan, 6.0, 8.0), (10.0, 11.0, 13.0)])
def test_takeoff_spools_up_ramps_and_stops_at_its_height(height_m, least_s, most_s):
    flight = Flight()
    assert flight.autopilot.takeoff(flight.amsl_m(height_m)) is CommandResult.ACCEPTED
    flight.arm()
    assert abs(flight.run(0.9)[-1].height_m) < 0.01
    took_s = 0.9 + flight.take(20.0, lambda: flight.mode is FlightMode.HOLD)
    assert least_s < took_s < most_s  # PX4: 11.3 s to 10 m
    flight.run(4.0)
    target_m = 2.5 if isnan(height_m) else height_m
    assert flight.now.height_m == pytest.approx(target_m, abs=0.03)
    assert max(sample.height_m for sample in flight.track) < target_m + 0.05
    assert max(-sample.velocity_ned_m_s[2] for sample in flight.track) < 1.55  # MPC_TKO_SPEED


@pytest.mark.parametrize("armed_s", [0.0, 2.0])
def test_takeoff_climbs_as_px4_s(armed_s):
    flight = Flight()
    flight.arm()
    flight.run(armed_s)
    assert flight.autopilot.takeoff() is CommandResult.ACCEPTED
    spool_up_s = max(0.0, 1.0 - armed_s)
    heights_m = [flight.run(seconds)[-1].height_m for seconds in (2.0 + spool_up_s, 1.0, 0.5, 0.5, 0.5)]
    assert heights_m == pytest.approx([0.0, 0.02, 0.17, 0.56, 1.05], abs=0.15)  # PX4's, with this drone
    assert max(heights_m[:2]) < 0.05
    climb_m_s = [-sample.velocity_ned_m_s[2] for sample in flight.track]
    assert max(climb_m_s) < 1.3
    steps_m_s = [after - before for before, after in pairwise(climb_m_s)]
    assert max(steps_m_s) < 0.06  # 3 m/s^2: a ramp, no jump


def test_hold_drifts_by_millimetres():
    flight = Flight().climb_to(10.0)
    held = flight.run(20.0)
    assert max(dist(sample.position_ned_m, held[0].position_ned_m) for sample in held) < 0.01


def test_a_landing_is_fast_high_up_and_slow_near_the_ground():
    flight = Flight().climb_to(10.0)
    flight.autopilot.land()
    took_s = flight.take(40.0, lambda: not flight.armed)
    assert 14.0 < took_s < 19.0
    assert flight.now.distance_m() < 0.02
    high, low = (
        max(s.velocity_ned_m_s[2] for s in flight.track if least < s.height_m < most)
        for least, most in ((8.0, 10.0), (0.1, 4.9))
    )
    assert 1.2 < high < 1.5
    assert low == pytest.approx(0.7, abs=0.05)


@pytest.mark.parametrize("course_rad", [0.0, 2.4])
def test_reposition_flies_straight_at_cruise_without_overshoot(course_rad):
    flight = Flight().climb_to(10.0)
    north_m, east_m = 100.0 * cos(course_rad), 100.0 * sin(course_rad)
    assert flight.autopilot.reposition((north_m, east_m, -10.0)) is CommandResult.ACCEPTED
    way = flight.run(32.0)
    assert flight.now.distance_m(north_m, east_m) < 0.02
    assert max(sample.distance_m() for sample in way) < 100.05
    assert max(sample.speed_m_s for sample in way) < 5.2
    assert max(abs(sample.height_m - 10.0) for sample in way) < 0.05
    assert max(sample.tilt_deg for sample in way) < 25.0
    fast = [sample for sample in way if sample.speed_m_s > 4.9]
    assert max(yaw_error_deg(sample, course_rad) for sample in fast[100:]) < 2.0


def test_the_speed_changes_on_the_way():
    flight = Flight().climb_to(10.0)
    flight.autopilot.reposition((150.0, 0.0, -10.0))
    flight.run(6.0)
    flight.autopilot.change_speed(10.0)
    way = flight.run(18.0)
    assert max(sample.speed_m_s for sample in way) == pytest.approx(10.1, abs=0.15)
    assert max(sample.position_ned_m[0] for sample in way) < 150.05


def test_reposition_of_height_or_yaw_alone_keeps_the_rest():
    flight = Flight().climb_to(10.0)
    flight.autopilot.reposition((nan, nan, -20.0))
    climb = flight.run(9.0)
    assert flight.now.height_m == pytest.approx(20.0, abs=0.02)
    assert max(s.height_m for s in climb) < 20.05
    flight.autopilot.reposition((nan, nan, nan), radians(120.0))
    turn = flight.run(5.0)
    assert yaw_error_deg(flight.now, radians(120.0)) < 1.0
    assert max(sample.distance_m() for sample in climb + turn) < 0.02
    assert abs(flight.now.height_m - 20.0) < 0.02


def test_hold_on_the_way_brakes_smoothly_without_flying_back():
    flight = Flight().climb_to(10.0)
    flight.autopilot.reposition((150.0, 0.0, -10.0), speed_m_s=8.0)
    flight.run(8.0)
    flight.autopilot.reposition((nan, nan, nan))
    brake = flight.run(8.0)
    stopped_m = flight.now.position_ned_m[0]
    assert 10.0 < stopped_m - brake[0].position_ned_m[0] < 16.0
    assert max(sample.position_ned_m[0] for sample in brake) - stopped_m < 0.05
    assert max(sample.tilt_deg for sample in brake) < 22.0


def test_the_heading_follows_mpc_yaw_mode():
    for mode, yaw_rad in ((1, -3.14159), (2, 0.0), (3, 1.5708), (5, 0.0)):
        flight = Flight(MPC_YAW_MODE=mode).climb_to(5.0)
        flight.autopilot.reposition((0.0, 30.0, -5.0) if mode in (3, 5) else (30.0, 0.0, -5.0))
        flight.run(6.0)
        assert yaw_error_deg(flight.now, yaw_rad) < 3.0, mode


def test_mpc_yaw_mode_can_turn_before_flying():
    flight = Flight(MPC_YAW_MODE=4).climb_to(5.0)
    flight.autopilot.reposition((-30.0, 0.0, -5.0))
    flight.take(6.0, lambda: yaw_error_deg(flight.now, 3.14159) < 15.0)
    assert flight.now.distance_m() < 0.2
    flight.run(12.0)
    assert flight.now.distance_m(-30.0) < 0.5


@pytest.mark.parametrize("speed_m_s", [3.0, -3.0])
def test_an_orbit_is_round_and_looks_to_its_centre(speed_m_s):
    flight = Flight().climb_to(10.0)
    flight.autopilot.orbit(Orbit((0.0, 0.0, -10.0), 20.0, speed_m_s))
    flight.run(11.0)
    circle = flight.run(30.0)
    assert all(abs(sample.distance_m() - 20.0) < 0.2 for sample in circle)
    assert all(sample.speed_m_s == pytest.approx(3.0, abs=0.15) for sample in circle)
    for sample in circle:
        north_m, east_m, _ = sample.position_ned_m
        assert yaw_error_deg(sample, atan2(-east_m, -north_m)) < 2.0
    before, after = circle[0].position_ned_m, circle[50].position_ned_m
    assert (before[0] * after[1] - before[1] * after[0]) * speed_m_s > 0.0


def test_an_orbit_far_away_is_flown_to_first_and_may_look_along_itself():
    flight = Flight().climb_to(10.0)
    flight.autopilot.orbit(Orbit((100.0, 0.0, -15.0), 20.0, 3.0, OrbitYaw.TANGENT))
    flight.take(25.0, lambda: abs(flight.now.distance_m(100.0) - 20.0) < 0.5)
    flight.run(5.0)
    circle = flight.run(15.0)
    assert all(abs(sample.distance_m(100.0) - 20.0) < 0.3 for sample in circle)
    assert flight.now.height_m == pytest.approx(15.0, abs=0.05)
    assert max(sample.speed_m_s for sample in flight.track) < 5.4
    course_rad = atan2(flight.now.velocity_ned_m_s[1], flight.now.velocity_ned_m_s[0])
    assert yaw_error_deg(flight.now, course_rad) < 3.0


def returned(flight):
    """Return home; the duration and the maximum height."""
    start = len(flight.track)
    assert flight.autopilot.set_mode(FlightMode.RETURN) is CommandResult.ACCEPTED
    took_s = flight.take(120.0, lambda: not flight.armed)
    return took_s, max(sample.height_m for sample in flight.track[start:])


def test_return_climbs_flies_home_waits_and_lands():
    flight = Flight(RTL_LAND_DELAY=4.0).climb_to(20.0)
    flight.autopilot.reposition((60.0, 0.0, -20.0))
    flight.run(20.0)
    _, highest_m = returned(flight)
    assert highest_m == pytest.approx(30.0, abs=0.05)  # RTL_RETURN_ALT
    assert flight.now.distance_m() < 0.02
    waiting = [sample for sample in flight.track[-3000:] if 9.8 < sample.height_m < 10.8]
    assert 4.0 < waiting[-1].time_s - waiting[0].time_s < 5.5


def test_return_from_near_home_climbs_no_higher_than_the_cone():
    flight = Flight().climb_to(5.0)
    flight.autopilot.reposition((8.0, 0.0, -5.0))
    flight.run(8.0)
    took_s, highest_m = returned(flight)
    assert highest_m == pytest.approx(8.0, abs=0.1)
    assert took_s < 25.0
    assert flight.now.distance_m() < 0.05


def test_return_goes_to_a_nearer_rally_point():
    flight = Flight().climb_to(20.0)
    flight.autopilot.missions.replace(PlanType.RALLY, [at(0, Do.RALLY_POINT, 50.0, 10.0, 0.0)])
    flight.autopilot.reposition((60.0, 0.0, -20.0))
    flight.run(18.0)
    returned(flight)
    assert flight.now.distance_m(50.0, 10.0) < 0.1


def follow(flight, seconds, place, velocity):
    """Fly with a target that reports its position once a second; return the samples."""
    samples = []
    for _ in range(seconds):
        flight.autopilot.follow_target((place[0], place[1], 0.0), (*velocity, 0.0))
        samples += flight.run(1.0)
        place[0] += velocity[0]
        place[1] += velocity[1]
    return samples


def test_follow_keeps_behind_a_target_that_moves_turns_and_stops():
    flight = Flight().climb_to(5.0)
    flight.autopilot.set_mode(FlightMode.FOLLOW)
    assert flight.run(2.0)[-1].distance_m() < 0.02  # no target yet
    place = [30.0, 0.0]
    follow(flight, 10, place, (0.0, 0.0))
    assert dist(flight.now.position_ned_m, (22.0, 0.0, -8.0)) < 0.2
    follow(flight, 10, place, (3.0, 0.0))
    steady = follow(flight, 8, place, (3.0, 0.0))
    assert dist(flight.now.position_ned_m, (place[0] - 8.0, 0.0, -8.0)) < 0.3
    assert all(abs(sample.speed_m_s - 3.0) < 0.1 and sample.tilt_deg < 3.0 for sample in steady)
    turning = follow(flight, 14, place, (0.0, 3.0))
    assert dist(flight.now.position_ned_m, (place[0], place[1] - 8.0, -8.0)) < 0.3
    assert yaw_error_deg(flight.now, radians(90.0)) < 2.0
    assert max(sample.tilt_deg for sample in turning) < 25.0
    flight.run(8.0)  # no reports
    assert hypot(*flight.now.velocity_ned_m_s) < 0.02


def test_return_flies_to_a_changed_home():
    flight = Flight().climb_to(5.0)
    home = flight.autopilot.global_position()
    flight.autopilot.reposition((10.0, 0.0, -5.0))
    flight.run(8.0)
    place = flight.autopilot.global_position()
    flight.autopilot.set_home(GeodeticPoint(place.latitude_deg, place.longitude_deg, home.altitude_m - 5.0))
    returned(flight)
    assert flight.now.distance_m(10.0) < 0.1
    assert ORIGIN.latitude_deg < place.latitude_deg
