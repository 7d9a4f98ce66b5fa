"""A vehicle's state from its messages: poses between and beyond its reports, and its flags."""

from math import cos, hypot, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.geometry.rotations import multiply, quaternion_from_euler, yaw_of
from framerunner.wire.dialect import mavlink
from framerunner.wire.px4_modes import OFFBOARD
from framerunner.wire.vehicle_telemetry import AHEAD_US, GAP_US, SPAN_US, VehicleTelemetry

angles = st.floats(-pi, pi)
speeds = st.floats(-12, 12)


def attitude(time_us, yaw=0.0, roll=0.0, rates=(0.0, 0.0, 0.0)):
    return quaternion(time_us, quaternion_from_euler(roll, 0.0, yaw), rates)


def quaternion(time_us, parts, rates=(0.0, 0.0, 0.0)):
    return mavlink.MAVLink_attitude_quaternion_message(time_us // 1000, *parts, *rates)


def angles_told(time_us, yaw=0.0):
    return mavlink.MAVLink_attitude_message(time_us // 1000, 0.0, 0.0, yaw, 0.0, 0.0, 0.0)


def position(time_us, x=0.0, velocity=(0.0, 0.0, 0.0)):
    return mavlink.MAVLink_local_position_ned_message(time_us // 1000, x, 0.0, 0.0, *velocity)


def turned_apart(a, b):
    """Cosine of half the angle between two attitudes, 1 if they are the same."""
    return abs(sum(p * q for p, q in zip(a, b, strict=True)))


def test_there_is_no_pose_before_both_kinds_are_received():
    telemetry = VehicleTelemetry()
    telemetry.take(attitude(20_000))
    assert telemetry.covered_us is None
    assert telemetry.pose(20_000) is None
    telemetry.take(position(30_000))
    assert (telemetry.time_us, telemetry.covered_us) == (30_000, 20_000)
    assert telemetry.pose(30_000) is not None
    assert telemetry.pose(29_999) is None  # before the first position


@given(speed=speeds, yaw_rate=st.floats(-2, 2), at=st.floats(0.1, 0.9), offset_us=st.integers(0, 30_000))
def test_even_motion_is_filled_in_exactly(speed, yaw_rate, at, offset_us):
    """Attitude at 50 Hz, position at 30 Hz, at different times."""
    telemetry = VehicleTelemetry()
    for time_us in range(0, 1_200_000, 1000):
        if time_us % 20_000 == 0:
            telemetry.take(attitude(time_us, yaw_rate * time_us * 1e-6))
        if time_us % 33_000 == 0:
            place = time_us + offset_us // 1000 * 1000
            telemetry.take(position(place, speed * place * 1e-6, (speed, 0.0, 0.0)))
    pose = telemetry.pose(round(at * 1e6))
    assert pose.position_ned_m[0] == pytest.approx(speed * at, abs=1e-4)
    assert pose.velocity_ned_m_s == pytest.approx((speed, 0.0, 0.0))
    wanted = quaternion_from_euler(0.0, 0.0, yaw_rate * at)
    assert turned_apart(pose.attitude_ned, wanted) == pytest.approx(1.0, abs=1e-7)


@given(roll=angles, yaw=angles, turn=st.floats(-1.0, 1.0), flipped=st.booleans(), share=st.floats(0, 1))
def test_attitudes_are_interpolated_the_short_way_with_unit_length(roll, yaw, turn, flipped, share):
    """A quaternion and its negative are one attitude; reports may change between them."""
    first = quaternion_from_euler(roll, 0.2, yaw)
    second = multiply(first, (cos(turn / 2), 0.0, sin(turn / 2), 0.0))
    if flipped:
        second = tuple(-part for part in second)
    telemetry = VehicleTelemetry()
    telemetry.take(quaternion(0, first))
    telemetry.take(quaternion(20_000, second))
    telemetry.take(position(0))
    found = telemetry.pose(round(20_000 * share)).attitude_ned
    assert hypot(*found) == pytest.approx(1.0)
    middle = multiply(first, (cos(share * turn / 2), 0.0, sin(share * turn / 2), 0.0))
    assert turned_apart(found, middle) > cos(0.02)


@given(speed=speeds, rate=st.floats(-3, 3), ahead_us=st.integers(0, AHEAD_US))
def test_the_last_reports_are_carried_on_a_little(speed, rate, ahead_us):
    telemetry = VehicleTelemetry()
    telemetry.take(attitude(1_000_000, 0.5, rates=(0.0, 0.0, rate)))
    telemetry.take(position(1_000_000, 2.0, (speed, 0.0, 0.0)))
    pose = telemetry.pose(1_000_000 + ahead_us)
    assert pose.position_ned_m[0] == pytest.approx(2.0 + speed * ahead_us * 1e-6)
    assert yaw_of(pose.attitude_ned) == pytest.approx(0.5 + rate * ahead_us * 1e-6)
    assert telemetry.pose(1_000_000 + AHEAD_US + 1) is None


def test_nothing_is_interpolated_across_a_gap():
    telemetry = VehicleTelemetry()
    for time_us in (0, 100_000, 100_000 + GAP_US + 1000):
        telemetry.take(attitude(time_us))
        telemetry.take(position(time_us))
    assert telemetry.pose(50_000) is not None
    assert telemetry.pose(250_000) is None


@given(st.permutations(range(12)))
def test_reports_may_come_in_any_order_and_twice(order):
    telemetry = VehicleTelemetry()
    for step in (*order, *order):
        telemetry.take(attitude(step * 20_000, 0.01 * step))
        telemetry.take(position(step * 20_000, float(step)))
    pose = telemetry.pose(130_000)
    assert pose.position_ned_m[0] == pytest.approx(6.5)
    assert yaw_of(pose.attitude_ned) == pytest.approx(0.065, abs=1e-6)


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_reports_that_are_not_finite_are_passed_over(bad):
    telemetry = VehicleTelemetry()
    telemetry.take(quaternion(10_000, (bad, 0.0, 0.0, 0.0)))
    telemetry.take(quaternion(10_000, (0.0, 0.0, 0.0, 0.0)))
    telemetry.take(attitude(10_000, rates=(0.0, bad, 0.0)))
    telemetry.take(position(10_000, bad))
    telemetry.take(position(10_000, velocity=(0.0, 0.0, bad)))
    assert (telemetry.time_us, telemetry.attitude, telemetry.position) == (0, None, None)


def test_a_clock_that_goes_back_starts_a_new_track():
    telemetry = VehicleTelemetry()
    for time_us in (60_000_000, 4_000_000, 4_020_000):
        telemetry.take(attitude(time_us))
        telemetry.take(position(time_us))
    assert telemetry.restarts == 1
    assert telemetry.time_us == 4_020_000
    assert telemetry.pose(4_010_000) is not None


def test_what_is_old_is_forgotten():
    telemetry = VehicleTelemetry()
    for step in range(1000):
        telemetry.take(attitude(step * 20_000))
        telemetry.take(position(step * 20_000))
    assert telemetry.pose(10_000_000) is None
    assert telemetry.pose(19_000_000) is not None
    assert len(telemetry._positions.reports) <= 2 * SPAN_US // 20_000 + 1


def test_a_position_near_a_time_lies_straight_between_two_reports():
    telemetry = VehicleTelemetry()
    for time_us, x, yaw in ((1_000_000, 0.0, 3.0), (1_100_000, 1.0, -3.0)):
        telemetry.take(attitude(time_us, yaw))
        telemetry.take(position(time_us, x))
    near = telemetry.position_near(1_025_000)
    assert near.position_ned_m == pytest.approx((0.25, 0.0, 0.0))
    across_south_rad = 3.0 + (2 * pi - 6.0) / 4
    assert near.yaw_ned_rad == pytest.approx(across_south_rad, abs=1e-6)
    assert telemetry.position_near(1_150_000).position_ned_m == pytest.approx((1.0, 0.0, 0.0))
    assert telemetry.position_near(950_000).position_ned_m == pytest.approx((0.0, 0.0, 0.0))
    assert telemetry.position_near(1_300_000) is None
    assert telemetry.position_near(500_000) is None


def test_late_and_doubled_reports_change_nothing_that_is_newer():
    telemetry = VehicleTelemetry()
    newest = []
    for time_ms, x in ((1000, 0.0), (1100, 1.0), (1050, 0.5), (1100, 1.0), (1120, 1.2), (900, -1.0)):
        newest.append(telemetry.take(position(time_ms * 1000, x), time_ms))
        telemetry.take(angles_told(time_ms * 1000, x / 10), time_ms)
    assert newest == [True, True, False, True, True, False]
    assert (telemetry.time_us, telemetry.restarts) == (1_120_000, 0)
    assert (telemetry.attitude_heard_s, telemetry.position_heard_s) == (1120, 1120)
    assert telemetry.position.position_ned_m[0] == 1.2
    assert telemetry.attitude.yaw_ned_rad == pytest.approx(0.12)
    assert telemetry.position_near(1_025_000).position_ned_m == pytest.approx((0.25, 0.0, 0.0))


def test_of_two_attitudes_of_one_instant_the_quaternion_counts():
    for order in ((angles_told, attitude), (attitude, angles_told)):
        telemetry = VehicleTelemetry()
        for told in order:
            telemetry.take(told(20_000, 0.5))
        assert not telemetry.attitude.by_angles
        telemetry.take(angles_told(40_000, 0.6))
        assert telemetry.attitude.yaw_ned_rad == pytest.approx(0.6)


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-3, 3))
def test_the_turn_rate_is_about_the_vertical_whatever_the_tilt(roll, pitch, rate):
    body = (-sin(pitch) * rate, sin(roll) * cos(pitch) * rate, cos(roll) * cos(pitch) * rate)
    telemetry = VehicleTelemetry()
    telemetry.take(quaternion(0, quaternion_from_euler(roll, pitch, 1.0), body))
    assert telemetry.attitude.turn_rate_ned_rad_s == pytest.approx(rate, abs=1e-9)


def heartbeat(flags=29, autopilot=12, mode=OFFBOARD):
    return mavlink.MAVLink_heartbeat_message(2, autopilot, flags, mode.custom_mode, 4, 3)


def landed(state):
    return mavlink.MAVLink_extended_sys_state_message(0, state)


def test_a_heartbeat_has_arming_and_mode():
    telemetry = VehicleTelemetry()
    assert (telemetry.armed, telemetry.mode, telemetry.mode_name) == (False, None, "")
    telemetry.take(heartbeat(29 | 128))
    assert (telemetry.armed, telemetry.is_px4) == (True, True)
    assert (telemetry.mode, telemetry.mode_name) == (OFFBOARD, "Offboard")
    telemetry.take(heartbeat(autopilot=3))
    assert (telemetry.armed, telemetry.is_px4, telemetry.mode) == (False, False, None)
    assert telemetry.mode_name == f"mode {OFFBOARD.custom_mode}"


def test_it_stands_disarmed_only_when_both_are_known():
    telemetry = VehicleTelemetry()
    telemetry.take(landed(1))
    assert telemetry.landed and not telemetry.stands_disarmed
    telemetry.take(heartbeat())
    assert telemetry.stands_disarmed
    telemetry.take(landed(2))
    assert telemetry.landed is False and not telemetry.stands_disarmed
    telemetry.take(landed(0))
    assert telemetry.landed is None and not telemetry.stands_disarmed


def system_status(millivolts, percent):
    return mavlink.MAVLink_sys_status_message(0, 0, 0, 0, millivolts, -1, percent, 0, 0, 0, 0, 0, 0)


def battery(number, cells_mv, more_mv, percent):
    cells = [*cells_mv, *[0xFFFF] * (10 - len(cells_mv))]
    more = [*more_mv, *[0] * (4 - len(more_mv))]
    return mavlink.MAVLink_battery_status_message(number, 0, 0, 0, cells, -1, 0, 0, percent, 0, 0, more)


def test_the_battery_is_known_best_by_its_own_message():
    telemetry = VehicleTelemetry()
    telemetry.take(system_status(16_100, 77))
    assert (telemetry.voltage_v, telemetry.battery_percent) == (16.1, 77)
    telemetry.take(system_status(0xFFFF, -1))
    assert (telemetry.voltage_v, telemetry.battery_percent) == (None, None)
    telemetry.take(battery(1, [9000], [], 10))
    assert telemetry.voltage_v is None
    telemetry.take(battery(0, [4000] * 10, [4100], 55))
    telemetry.take(system_status(16_100, 77))
    assert (telemetry.voltage_v, telemetry.battery_percent) == (pytest.approx(44.1), 55)


def test_the_boot_is_named_by_the_first_date_that_is_one():
    telemetry = VehicleTelemetry()
    for unix_us in (0, 1_700_000_005_000_000, 1_800_000_005_000_000):
        telemetry.take(mavlink.MAVLink_system_time_message(unix_us, 5000))
    assert telemetry.boot_unix_us == 1_700_000_000_000_000


def test_a_restart_forgets_the_boot_before():
    telemetry = VehicleTelemetry()
    for told in (heartbeat(29 | 128), landed(2), battery(0, [4000], [], 55), position(60_000_000)):
        telemetry.take(told)
    telemetry.take(attitude(1_000_000))
    assert (telemetry.restarts, telemetry.time_us, telemetry.position) == (1, 1_000_000, None)
    assert (telemetry.armed, telemetry.landed, telemetry.voltage_v) == (False, None, None)
    assert telemetry.attitude.time_us == 1_000_000


def test_other_messages_are_passed_over():
    assert not VehicleTelemetry().take(mavlink.MAVLink_ping_message(0, 0, 0, 0))
