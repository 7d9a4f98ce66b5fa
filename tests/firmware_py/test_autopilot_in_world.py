"""The autopilot with its own stabiliser in the simulated world."""

from math import hypot

import pytest

from firmware_py.autopilot import Autopilot
from firmware_py.setpoints import TrajectorySetpoint
from firmware_py.status import CommandResult, FlightMode, LandedState
from framerunner.vehicle.airframe import load_airframe
from framerunner.vehicle.geodesy import GeodeticPoint
from scenarios.models import Scenario
from sitl.world import World

ORIGIN = GeodeticPoint(47.397742, 8.545594, 489.0)


class Flight:
    def __init__(self):
        airframe = load_airframe("abejorro")
        self.world = World(Scenario(name="field"), airframe)
        self.autopilot = Autopilot(airframe, ORIGIN)

    @property
    def status(self):
        return self.autopilot.status

    @property
    def height_m(self):
        return -self.autopilot.state.position_ned_m[2]

    def run(self, seconds, velocity=None):
        for tick in range(round(seconds * 250)):
            if velocity is not None and tick % 12 == 0:
                self.autopilot.accept_setpoint(
                    TrajectorySetpoint(self.world.time_us, velocity_ned_m_s=velocity)
                )
            self.world.step(self.autopilot.step(self.world.sensors()))
        return self


@pytest.fixture
def flight():
    return Flight().run(1.0)


def test_takeoff_hold_and_landing_where_it_started(flight):
    assert flight.autopilot.takeoff(489.51 + 1.5) is CommandResult.ACCEPTED
    assert flight.autopilot.arm() is CommandResult.ACCEPTED
    flight.run(8.0)
    assert flight.status.mode is FlightMode.HOLD
    assert flight.height_m == pytest.approx(1.5, abs=0.05)
    flight.autopilot.land()
    flight.run(7.0)
    assert not flight.status.armed
    north_m, east_m, down_m = flight.autopilot.state.position_ned_m
    assert hypot(north_m, east_m) < 0.02
    assert down_m == pytest.approx(0.0, abs=0.01)


def test_a_slow_climb_in_offboard_leaves_the_base_at_once(flight):
    flight.run(0.1, (0.0, 0.0, 0.0))
    flight.autopilot.set_mode(FlightMode.OFFBOARD)
    flight.autopilot.arm()
    flight.run(0.5, (0.0, 0.0, 0.0))
    assert abs(flight.height_m) < 0.005
    assert flight.status.landed_state is LandedState.ON_GROUND
    flight.run(0.4, (0.0, 0.0, -0.25))
    assert flight.status.landed_state is LandedState.IN_AIR
    assert flight.height_m > 0.02
    flight.run(1.0, (0.0, 0.0, -0.25))
    assert -flight.autopilot.state.velocity_ned_m_s[2] == pytest.approx(0.25, abs=0.02)


@pytest.mark.parametrize("sink_m_s", [0.15, 0.3, 0.8])
def test_an_offboard_descent_is_flight_until_it_touches_and_then_landed(flight, sink_m_s):
    flight.run(0.1, (0.0, 0.0, 0.0))
    flight.autopilot.set_mode(FlightMode.OFFBOARD)
    flight.autopilot.arm()
    flight.run(2.0, (0.0, 0.0, -0.5))
    for _ in range(2500):
        flight.run(0.004, (0.0, 0.0, sink_m_s))
        if flight.status.landed_state is LandedState.ON_GROUND:
            break
        assert flight.status.armed
    assert abs(flight.height_m) < 0.01
    flight.run(2.1, (0.0, 0.0, sink_m_s))
    assert not flight.status.armed


def test_lost_setpoints_at_speed_stop_land_and_disarm(flight):
    flight.run(0.1, (0.0, 0.0, 0.0))
    flight.autopilot.set_mode(FlightMode.OFFBOARD)
    flight.autopilot.arm()
    flight.run(3.0, (0.0, 0.0, -0.5))
    flight.run(2.0, (1.0, 0.0, 0.0))
    flight.run(3.0)  # the first second to detect it
    assert hypot(*flight.autopilot.state.velocity_ned_m_s) < 0.12  # rest of an overshoot
    flight.run(1.5)
    assert flight.status.failsafe
    assert hypot(*flight.autopilot.state.velocity_ned_m_s) < 0.05
    flight.run(12.0)
    assert not flight.status.armed
    assert flight.status.landed_state is LandedState.ON_GROUND


def test_with_motors_off_in_the_air_it_falls_to_the_ground(flight):
    flight.autopilot.takeoff()
    flight.autopilot.arm()
    flight.run(4.0)
    assert flight.autopilot.disarm(force=True) is CommandResult.ACCEPTED
    flight.run(0.3)
    assert flight.status.landed_state is LandedState.IN_AIR
    flight.run(4.0)
    assert flight.status.landed_state is LandedState.ON_GROUND


def test_hold_keeps_its_position_within_two_centimetres(flight):
    flight.autopilot.takeoff(489.51 + 1.0)
    flight.autopilot.arm()
    flight.run(10.0)
    before = flight.autopilot.state.position_ned_m
    flight.run(10.0)
    after = flight.autopilot.state.position_ned_m
    assert hypot(*(b - a for a, b in zip(before, after, strict=True))) < 0.02
