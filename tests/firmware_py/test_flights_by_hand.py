"""The x500 flown by sticks and by offboard setpoints."""

from itertools import pairwise
from math import cos, degrees, dist, hypot, remainder, sin, tau

import pytest

from firmware_py.missions.items import PlanType
from firmware_py.status import CommandResult, FlightMode
from tests.firmware_py.flying import Flight
from tests.firmware_py.missions.mission_world import plan, waypoint


def by_hand(mode, **parameters):
    """A vehicle armed in a mode, throttle down."""
    flight = Flight(**parameters)
    flight.steer(0.2, up=-1.0)
    flight.arm(mode)
    return flight


def lifted(mode, **parameters):
    """A vehicle in the air in a mode, throttle centred."""
    flight = by_hand(mode, **parameters)
    flight.steer(5.0, up=0.8)
    flight.steer(2.0)
    return flight


def test_position_mode_waits_on_the_ground_until_the_throttle_is_up():
    flight = by_hand(FlightMode.POSITION)
    flight.steer(2.0)
    assert flight.landed and abs(flight.now.height_m) < 0.01
    flight.steer(4.0, up=0.5)
    assert not flight.landed and flight.now.height_m > 0.5


def test_position_mode_flies_fast_brakes_and_stays():
    flight = lifted(FlightMode.POSITION)
    fast = flight.steer(8.0, forward=1.0)
    assert flight.now.speed_m_s == pytest.approx(10.0, abs=0.1)  # MPC_VEL_MANUAL
    assert max(sample.tilt_deg for sample in fast) < 30.0
    start_m = flight.now.position_ned_m[0]
    brake = flight.steer(5.0)
    stopped = flight.now
    assert stopped.speed_m_s < 0.04
    assert 10.0 < stopped.position_ned_m[0] - start_m < 18.0
    assert max(sample.position_ned_m[0] for sample in brake) < stopped.position_ned_m[0] + 0.05
    assert max(dist(s.position_ned_m, stopped.position_ned_m) for s in flight.steer(8.0)) < 0.05


def test_position_mode_has_other_speeds_backwards_and_sideways():
    flight = lifted(FlightMode.POSITION, MPC_VEL_MAN_BACK=2.0, MPC_VEL_MAN_SIDE=3.0)
    flight.steer(5.0, forward=-1.0)
    assert flight.now.velocity_ned_m_s[0] == pytest.approx(-2.0, abs=0.05)
    flight.steer(5.0, right=1.0)
    assert flight.now.velocity_ned_m_s[1] == pytest.approx(3.0, abs=0.05)


def test_position_mode_yaws_in_place_and_ignores_the_dead_zone():
    flight = lifted(FlightMode.POSITION, MAN_DEADZONE=0.2)
    here = flight.now.position_ned_m
    flight.steer(2.0, forward=0.15, right=-0.15, up=0.15)
    turn = flight.steer(2.0, yaw=1.0)
    rate_deg_s = degrees(remainder(turn[-1].yaw_rad - turn[-26].yaw_rad, tau)) / 0.5
    assert rate_deg_s == pytest.approx(150.0, abs=2.0)  # MPC_MAN_Y_MAX
    flight.steer(2.0)
    assert dist(flight.now.position_ned_m, here) < 0.05


@pytest.mark.parametrize("mode", [FlightMode.POSITION, FlightMode.ALTITUDE])
def test_throttle_down_descends_slowly_near_the_ground_lands_and_disarms(mode):
    flight = lifted(mode)
    start = len(flight.track)
    flight.sticks = None
    flight.steer(0.02, up=-1.0)
    flight.take(40.0, lambda: not flight.armed)
    low = [sample.velocity_ned_m_s[2] for sample in flight.track[start:] if 0.1 < sample.height_m < 4.0]
    assert max(low) < 0.8
    assert abs(flight.now.height_m) < 0.01


def test_altitude_mode_tilts_by_the_sticks_and_keeps_its_height():
    flight = lifted(FlightMode.ALTITUDE)
    height_m = flight.now.height_m
    way = flight.steer(4.0, forward=0.5)
    assert flight.now.tilt_deg == pytest.approx(17.5, abs=0.5)  # half of MPC_MAN_TILT_MAX
    assert flight.now.velocity_ned_m_s[0] > 6.0
    assert max(abs(sample.height_m - height_m) for sample in way) < 0.15


@pytest.mark.parametrize("mode", [FlightMode.STABILIZED, FlightMode.MANUAL, FlightMode.ACRO])
def test_without_height_control_the_throttle_commands_thrust_and_lands(mode):
    flight = by_hand(mode)
    flight.steer(2.0, up=-1.0)
    assert flight.landed
    flight.steer(2.0, up=0.3)
    assert flight.now.height_m > 1.0
    flight.steer(0.5, right=0.4)
    assert flight.now.velocity_ned_m_s[1] > 0.2
    assert (flight.now.tilt_deg == pytest.approx(14.0, abs=1.0)) is (mode is not FlightMode.ACRO)
    flight.steer(0.5, right=-0.4 if mode is FlightMode.ACRO else 0.0)
    assert flight.now.tilt_deg < 3.0
    flight.steer(20.0, up=-0.2)
    flight.steer(4.0, up=-1.0)
    assert not flight.armed and flight.landed


def offboard():
    """A vehicle in offboard at rest at a height."""
    flight = Flight()
    flight.send(velocity_ned_m_s=(0.0, 0.0, 0.0))
    flight.run(0.1)
    flight.arm(FlightMode.OFFBOARD)
    flight.fly(6.0, velocity_ned_m_s=(0.0, 0.0, -2.0))
    flight.fly(2.0, velocity_ned_m_s=(0.0, 0.0, 0.0))
    return flight


def test_offboard_takes_off_with_spool_up_and_ramp():
    flight = Flight()
    flight.send(velocity_ned_m_s=(0.0, 0.0, -1.0))
    flight.run(0.1)
    flight.arm(FlightMode.OFFBOARD)
    heights_m = [flight.run(seconds)[-1].height_m for seconds in (2.0, 1.0, 0.5, 0.5, 0.5, 0.5)]
    assert heights_m == pytest.approx([0.0, 0.02, 0.19, 0.46, 0.78, 1.14], abs=0.06)  # PX4's, with this drone


def test_offboard_climbs_from_the_ground_at_once_when_the_motors_turn():
    flight = Flight()
    flight.send(velocity_ned_m_s=(0.0, 0.0, 0.0))
    flight.run(0.1)
    flight.arm(FlightMode.OFFBOARD)
    assert max(sample.height_m for sample in flight.run(2.0)) < 0.01
    flight.fly(1.0, velocity_ned_m_s=(0.0, 0.0, -1.0))
    assert flight.now.height_m < 0.01
    flight.run(4.0)
    assert 1.5 < flight.now.height_m < 2.2  # PX4: 1.5 to 1.9 m
    assert max(-sample.velocity_ned_m_s[2] for sample in flight.track) < 1.1


def test_offboard_position_is_reached_fast_without_overshoot():
    flight = offboard()
    start = flight.now
    way = flight.fly(14.0, position_ned_m=(40.0, 30.0, -10.0), yaw_rad=1.0)
    assert dist(flight.now.position_ned_m, (40.0, 30.0, -10.0)) < 0.02
    assert max(sample.distance_m() for sample in way) < 50.1
    assert 11.0 < max(sample.speed_m_s for sample in way) < 12.1  # MPC_XY_VEL_MAX
    assert min(sample.height_m for sample in way) > min(start.height_m, 10.0) - 0.3
    assert flight.now.yaw_rad == pytest.approx(1.0, abs=0.01)


def test_offboard_velocity_in_ned_and_in_body_axes():
    flight = offboard()
    flight.fly(5.0, velocity_ned_m_s=(3.0, -2.0, 0.5), yaw_rad=2.0)
    assert dist(flight.now.velocity_ned_m_s, (3.0, -2.0, 0.5)) < 0.03
    assert flight.now.yaw_rad == pytest.approx(2.0, abs=0.01)
    ahead = (3.0, 0.0, 0.0)
    turned = flight.fly(8.0, velocity_ned_m_s=ahead, velocity_level_m_s=ahead, yaw_rate_rad_s=0.5)
    north_m_s, east_m_s, _ = flight.now.velocity_ned_m_s
    yaw_rad = flight.now.yaw_rad
    assert cos(yaw_rad) * north_m_s + sin(yaw_rad) * east_m_s == pytest.approx(3.0, abs=0.05)
    assert abs(cos(yaw_rad) * east_m_s - sin(yaw_rad) * north_m_s) < 0.1
    rate_rad_s = remainder(turned[-1].yaw_rad - turned[-51].yaw_rad, tau)
    assert rate_rad_s == pytest.approx(0.5, abs=0.01)


def test_offboard_acceleration_attitude_rates_and_outputs():
    flight = offboard()
    flight.fly(2.0, acceleration_ned_m_s2=(1.0, 0.0, 0.0))
    assert flight.now.velocity_ned_m_s[0] == pytest.approx(1.8, abs=0.15)
    flight.fly(4.0, velocity_ned_m_s=(0.0, 0.0, 0.0))
    hover = flight.autopilot.airframe.weight_n / flight.autopilot.airframe.full_thrust_n
    flight.fly(2.0, attitude=(cos(0.1), 0.0, -sin(0.1), 0.0), thrust=hover / cos(0.2))
    assert flight.now.tilt_deg == pytest.approx(degrees(0.2), abs=0.5)
    assert abs(flight.now.velocity_ned_m_s[2]) < 0.2
    flight.fly(4.0, velocity_ned_m_s=(0.0, 0.0, 0.0))
    turned = flight.fly(2.0, rate_frd_rad_s=(0.0, 0.0, 0.5), thrust=hover)
    assert turned[-1].yaw_rad - turned[-51].yaw_rad == pytest.approx(0.5, abs=0.02)
    flight.fly(4.0, velocity_ned_m_s=(0.0, 0.0, 0.0))
    flight.fly(0.5, outputs=(hover,) * 4)
    assert hypot(*flight.now.velocity_ned_m_s) < 0.1
    flight.fly(3.0, velocity_ned_m_s=(0.0, 0.0, 0.0))
    assert hypot(*flight.now.velocity_ned_m_s) < 0.02


def test_offboard_lands_by_its_setpoints():
    flight = offboard()
    flight.fly(0.02, velocity_ned_m_s=(0.0, 0.0, 1.0))
    flight.take(25.0, lambda: not flight.armed)
    assert abs(flight.now.height_m) < 0.01


FAST = (8.0, 0.0, 0.0)
SWEPT = [mode for mode in FlightMode if mode is not FlightMode.TERMINATION]


@pytest.mark.parametrize("first", SWEPT, ids=lambda mode: mode.name.lower())
def test_every_change_of_mode_at_speed_is_smooth(first):
    flight = Flight(COM_RC_OVERRIDE=0)
    far_away = plan(waypoint(900.0, 0.0, 30.0), waypoint(999.0, 0.0, 30.0))
    flight.autopilot.missions.replace(PlanType.MISSION, far_away)
    flight.autopilot.missions.valid = True
    flight.climb_to(30.0)
    flight.steer(0.1)
    for second in SWEPT:
        if second is first:
            continue
        flight.fly(1.0, velocity_ned_m_s=(*FAST[:2], -2.0 if flight.now.height_m < 28.0 else 0.0))
        flight.take(8.0, lambda: abs(flight.now.speed_m_s - 8.0) < 0.4 and flight.now.tilt_deg < 15.0)
        height_m = flight.now.height_m
        assert flight.autopilot.set_mode(first) is CommandResult.ACCEPTED
        change = flight.run(0.4)
        assert flight.autopilot.set_mode(second) is CommandResult.ACCEPTED
        change += flight.run(1.0)
        assert flight.mode is (FlightMode.HOLD if second is FlightMode.TAKEOFF else second)
        assert max(sample.tilt_deg for sample in change) < 32.0, second
        turns = [abs(after.tilt_deg - before.tilt_deg) for before, after in pairwise(change)]
        assert max(turns) < 3.0, second  # in 20 ms
        assert min(sample.height_m for sample in change) > height_m - 1.0, second
