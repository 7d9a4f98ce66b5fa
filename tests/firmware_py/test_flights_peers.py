"""Flights that other programs request, where PX4's behaviour is unexpected."""

import pytest

from firmware_py.status import CommandResult, FlightMode
from tests.firmware_py.flying import Flight


@pytest.fixture
def flight():
    return Flight()


def test_a_reposition_just_after_a_takeoff_command_is_flown_from_the_ground(flight):
    flight.autopilot.arm()
    flight.autopilot.takeoff()
    flight.run(1.0)
    assert flight.landed  # its motors have just started
    flight.autopilot.reposition((2.0, -60.0, -8.0), 0.0)
    flight.run(25.0)
    assert flight.now.position_ned_m == pytest.approx((2.0, -60.0, -8.0), abs=0.5)


def test_a_pause_on_the_ground_stays_there(flight):
    flight.autopilot.arm()
    flight.autopilot.reposition((float("nan"),) * 3)
    flight.run(3.0)
    assert flight.landed


def test_a_target_below_the_ground_is_followed_a_metre_above_it(flight):
    """MAVSDK's example reports a target nine metres below home."""
    flight.autopilot.parameters.set("FLW_TGT_ALT_M", 2)
    flight.climb_to(3.0)
    assert flight.autopilot.set_mode(FlightMode.FOLLOW) is CommandResult.ACCEPTED
    for _ in range(12):
        flight.autopilot.follow_target((20.0, 0.0, 12.0), (0.0, 0.0, 0.0))
        flight.run(1.0)
    assert flight.mode is FlightMode.FOLLOW
    assert flight.now.distance_m() > 5.0
    assert min(sample.height_m for sample in flight.track[-100:]) == pytest.approx(1.0, abs=0.3)
