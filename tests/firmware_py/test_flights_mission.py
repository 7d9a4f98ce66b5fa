"""The x500 flies missions."""

import pytest

from firmware_py.missions.items import Do, PlanType
from firmware_py.status import CommandResult, FlightMode
from tests.firmware_py.flying import Flight
from tests.firmware_py.missions.mission_world import doing, placed, plan, waypoint


def loaded(*items, **parameters):
    flight = Flight(**parameters)
    flight.autopilot.missions.replace(PlanType.MISSION, plan(*items))
    flight.autopilot.missions.valid = True
    flight.run(0.2)
    assert flight.autopilot.set_mode(FlightMode.MISSION) is CommandResult.ACCEPTED
    return flight


def near(flight, north_m, east_m, within_m=2.5):
    """Samples near a place, at any height."""
    return [sample for sample in flight.track if sample.distance_m(north_m, east_m) < within_m]


@pytest.fixture(scope="module")
def flown():
    """A straight line, a change of speed, a corner, a delay, home."""
    flight = loaded(
        placed(Do.TAKEOFF, 0.0, 0.0, 10.0),
        waypoint(30.0, 0.0, 10.0),
        waypoint(60.0, 0.0, 10.0),
        doing(Do.CHANGE_SPEED, 1.0, 8.0, -1.0),
        waypoint(60.0, 60.0, 15.0),
        doing(Do.DELAY, 3.0, -1.0, -1.0, -1.0),
        waypoint(20.0, 60.0, 15.0),
        doing(Do.RETURN_TO_LAUNCH),
    )
    flight.arm()
    flight.take(150.0, lambda: not flight.armed)
    return flight


def test_it_ends_on_the_ground_at_home(flown):
    assert flown.now.distance_m() < 0.05
    assert flown.autopilot.missions.take_reached() == [0, 1, 2, 3, 4, 5, 6, 7]
    assert max(sample.height_m for sample in flown.track) == pytest.approx(30.0, abs=0.1)


def test_waypoints_in_a_straight_line_are_passed_at_full_speed(flown):
    passed = near(flown, 30.0, 0.0)
    assert passed
    assert min(sample.speed_m_s for sample in passed) > 4.9


def test_a_corner_is_flown_slowly_and_near(flown):
    corner = near(flown, 60.0, 0.0, within_m=3.0)
    assert 0.5 < min(sample.speed_m_s for sample in corner) < 3.0
    assert min(sample.distance_m(60.0, 0.0) for sample in corner) < 1.5


def test_the_speed_changes_and_is_never_exceeded(flown):
    leg = [s for s in flown.track if 25.0 < s.position_ned_m[1] < 35.0 and s.mode is FlightMode.MISSION]
    assert max(sample.speed_m_s for sample in leg) == pytest.approx(8.0, abs=0.15)


def test_a_delay_waits_in_place(flown):
    waiting = near(flown, 60.0, 60.0, within_m=2.0)
    assert 3.0 < waiting[-1].time_s - waiting[0].time_s < 5.5
    assert min(sample.speed_m_s for sample in waiting) < 0.3


def test_the_flight_is_smooth(flown):
    assert max(sample.tilt_deg for sample in flown.track) < 35.0


def test_it_lands_at_the_missions_place_and_can_be_paused():
    flight = loaded(
        placed(Do.TAKEOFF, 0.0, 0.0, 5.0), waypoint(25.0, 0.0, 5.0), placed(Do.LAND, 40.0, 5.0, 0.0)
    )
    flight.arm()
    flight.take(30.0, lambda: flight.now.position_ned_m[0] > 12.0)
    flight.autopilot.set_mode(FlightMode.HOLD)
    flight.run(6.0)
    assert flight.now.speed_m_s < 0.02
    assert 12.0 < flight.now.position_ned_m[0] < 22.0
    flight.autopilot.set_mode(FlightMode.MISSION)
    flight.take(60.0, lambda: not flight.armed)
    assert flight.now.distance_m(40.0, 5.0) < 0.1


def test_after_the_last_waypoint_it_stays_there():
    flight = loaded(placed(Do.TAKEOFF, 0.0, 0.0, 5.0), waypoint(20.0, 0.0, 5.0))
    flight.arm()
    flight.take(30.0, lambda: flight.mode is FlightMode.HOLD)
    flight.run(6.0)
    assert flight.now.distance_m(20.0) < 0.05
