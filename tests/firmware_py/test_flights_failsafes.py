"""Failsafes of the x500 in flight."""

from dataclasses import replace
from math import hypot

import pytest

from firmware_py.status import CommandResult, FlightMode
from firmware_py.types import ManualInput
from tests.firmware_py.flying import Flight, without_gps


def offboard(speed_m_s=3.0, **parameters):
    flight = Flight(**parameters).climb_to(10.0)
    flight.fly(4.0, velocity_ned_m_s=(speed_m_s, 0.0, 0.0))
    return flight


LOST = [
    (0, FlightMode.RETURN),  # position mode, but there is no manual control
    (3, FlightMode.RETURN),
    (4, FlightMode.LAND),
    (5, FlightMode.HOLD),
    (6, FlightMode.TERMINATION),
]


@pytest.mark.parametrize(("action", "mode"), LOST)
def test_lost_setpoints_follow_com_obl_rc_act(action, mode):
    flight = offboard(COM_OBL_RC_ACT=action)
    flight.setpoint = None
    took_s = flight.take(2.0, lambda: flight.mode is not FlightMode.OFFBOARD)
    assert 0.95 < took_s < 1.1  # PX4: 1.01 to 1.11 s
    assert flight.mode is mode
    assert flight.autopilot.status.failsafe
    flight.run(1.0)
    flight.send(velocity_ned_m_s=(1.0, 0.0, 0.0))
    flight.run(0.1)
    assert flight.mode is (FlightMode.OFFBOARD if mode is not FlightMode.TERMINATION else mode)


def test_lost_setpoints_with_manual_control_enter_position_mode():
    flight = offboard()
    flight.steer(0.1)
    flight.setpoint = None
    flight.take(2.0, lambda: flight.mode is FlightMode.POSITION)
    flight.run(4.0)
    assert flight.now.speed_m_s < 0.05


@pytest.mark.parametrize(("action", "mode"), [(2, FlightMode.RETURN), (3, FlightMode.LAND)])
def test_a_lost_ground_station_holds_and_then_acts(action, mode):
    flight = Flight(NAV_DLL_ACT=action)
    flight.ground_station = True
    flight.run(0.1)
    flight.climb_to(10.0)
    flight.ground_station = False
    noticed_s = flight.take(14.0, lambda: flight.autopilot.status.failsafe)
    assert noticed_s == pytest.approx(12.28, abs=0.1)
    assert flight.mode is FlightMode.HOLD
    assert flight.take(6.0, lambda: flight.mode is mode) == pytest.approx(5.0, abs=0.05)


def takeoff_after_one_stick_message(quiet_s=0.05):
    """Send sticks once, then arm and take off."""
    flight = Flight()
    flight.autopilot.manual_input(ManualInput(flight.world.time_us))
    flight.run(quiet_s)
    flight.arm()
    assert flight.autopilot.takeoff() is CommandResult.ACCEPTED
    return flight


def test_sticks_sent_once_before_arming_let_it_take_off():
    flight = takeoff_after_one_stick_message()
    assert flight.take(1.0, lambda: flight.mode is FlightMode.HOLD) == pytest.approx(0.45, abs=0.1)
    flight.take(5.0, lambda: flight.now.height_m > 0.5)  # PX4: 5 s after the command
    flight.take(4.0, lambda: flight.mode is FlightMode.RETURN)
    assert flight.now.height_m < 2.55
    flight.take(20.0, lambda: not flight.armed)
    assert abs(flight.now.height_m) < 0.01


def test_sticks_that_return_after_such_a_takeoff_are_used():
    flight = takeoff_after_one_stick_message()
    flight.run(5.0)
    flight.steer(0.1)
    assert flight.autopilot.set_mode(FlightMode.POSITION) is CommandResult.ACCEPTED
    flight.steer(3.0, forward=0.5)
    assert flight.mode is FlightMode.POSITION
    assert flight.now.height_m > 0.5
    assert flight.now.speed_m_s > 1.0


def test_hold_commanded_on_the_ground_cancels_a_takeoff():
    flight = Flight()
    flight.arm()
    flight.autopilot.takeoff()
    flight.run(0.5)
    assert flight.autopilot.set_mode(FlightMode.HOLD) is CommandResult.ACCEPTED
    assert max(sample.height_m for sample in flight.run(6.0)) < 0.01


def test_lost_sticks_hold_and_then_return():
    flight = Flight().climb_to(10.0)
    flight.steer(0.1)
    flight.autopilot.set_mode(FlightMode.POSITION)
    flight.steer(3.0, forward=0.5)
    flight.sticks = None
    assert flight.take(1.0, lambda: flight.mode is FlightMode.HOLD) == pytest.approx(0.5, abs=0.1)
    flight.run(4.5)
    assert flight.now.speed_m_s < 0.05
    flight.take(1.0, lambda: flight.mode is FlightMode.RETURN)


@pytest.mark.parametrize(
    ("charge", "warning", "mode"),
    [(0.12, 2, FlightMode.HOLD), (0.06, 3, FlightMode.RETURN), (0.03, 4, FlightMode.LAND)],
)
def test_a_discharged_battery(charge, warning, mode):
    flight = Flight().climb_to(10.0)
    cell_v = 3.6 + charge * (4.05 - 3.6)  # BAT1_V_EMPTY, BAT1_V_CHARGED
    flight.sensed = lambda sensors: replace(sensors, battery_voltage_v=4 * cell_v, battery_current_a=0.0)
    flight.run(0.5)
    assert flight.autopilot.battery.warning == warning
    assert flight.mode is mode


@pytest.mark.parametrize(
    ("action", "mode"),
    [
        (0, FlightMode.OFFBOARD),
        (1, FlightMode.OFFBOARD),
        (2, FlightMode.HOLD),
        (3, FlightMode.RETURN),
        (4, FlightMode.TERMINATION),
        (5, FlightMode.LAND),
    ],
)
def test_a_fence_breach_follows_gf_action(action, mode):
    flight = Flight(GF_MAX_HOR_DIST=20.0, GF_ACTION=action).climb_to(10.0)
    flight.fly(0.02, velocity_ned_m_s=(5.0, 0.0, 0.0))
    flight.take(10.0, lambda: flight.now.distance_m() > 20.0)
    flight.run(0.3)
    assert flight.mode is mode
    assert "Geofence violation: farther from home than 20 m" in flight.texts
    if mode is FlightMode.HOLD:
        flight.run(4.0)
        assert 20.0 < flight.now.distance_m() < 28.0
        assert flight.now.speed_m_s < 0.05


@pytest.mark.parametrize(("speed_m_s", "drift_m"), [(0.0, 0.1), (3.0, 8.0)])
def test_without_a_position_it_brakes_descends_and_disarms(speed_m_s, drift_m):
    flight = offboard(speed_m_s)
    lost = flight.now
    flight.sensed = without_gps
    assert flight.take(2.0, lambda: flight.mode is FlightMode.LAND) == pytest.approx(1.0, abs=0.05)
    flight.take(40.0, lambda: not flight.armed)
    assert abs(flight.now.position_ned_m[0] - lost.position_ned_m[0]) < drift_m
    assert hypot(*flight.now.velocity_ned_m_s) < 0.05


def test_a_broken_motor_ends_in_termination_on_the_ground():
    flight = Flight().climb_to(10.0)
    flight.world.dynamics.fail_motor(0)
    flight.take(1.5, lambda: flight.mode is FlightMode.TERMINATION)
    flight.run(4.0)
    assert set(flight.autopilot.output.speeds_rad_s) == {0.0}
    assert flight.now.height_m < 0.5
