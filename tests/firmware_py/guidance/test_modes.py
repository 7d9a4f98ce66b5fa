from itertools import pairwise
from math import cos, hypot, inf, isfinite, nan, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_py.commander_table import CommanderState
from firmware_py.guidance.limits import AccelerationLimits, SpeedLimits
from firmware_py.guidance.modes import Guidance
from firmware_py.parameters import Parameters
from firmware_py.setpoints import AttitudeSetpoint, BodyRateSetpoint, MotorSetpoint, TrajectorySetpoint
from firmware_py.types import VehicleState
from framerunner.vehicle.airframe import load_airframe

AIRFRAME = load_airframe("abejorro")
LIMITS = SpeedLimits(AIRFRAME, Parameters())
LIMITS.horizontal_m_s, LIMITS.up_m_s, LIMITS.down_m_s, LIMITS.yaw_rate_rad_s = 2.0, 1.5, 1.0, 2.0
LIMITS.takeoff_m_s, LIMITS.takeoff_m_s2, LIMITS.land_m_s = 1.2, inf, 0.7
LIMITS.cruise_m_s, LIMITS.auto_up_m_s, LIMITS.auto_down_m_s = 5.0, 3.0, 1.5
LIMITS.acceleration, LIMITS.auto_yaw_rate_rad_s = AccelerationLimits(), 1.0
LIMITS.position_gain, LIMITS.height_gain, LIMITS.yaw_gain = 1.0, 1.0, 2.5
LIMITS.land_slow_below_m, LIMITS.land_fast_above_m = 5.0, 10.0

any_float = st.floats(allow_nan=True, allow_infinity=True)
any_vec3 = st.tuples(any_float, any_float, any_float)


def at(north=0.0, east=0.0, down=0.0, yaw=0.0, velocity=(0.0, 0.0, 0.0)):
    return VehicleState(position_ned_m=(north, east, down), velocity_ned_m_s=velocity, yaw_rad=yaw)


def limited():
    guidance = Guidance(AIRFRAME, Parameters())
    guidance.context.limits = LIMITS
    return guidance


def offboard(**setpoint):
    guidance = limited()
    guidance.enter(CommanderState.OFFBOARD, at())
    guidance.accept(TrajectorySetpoint(0, **setpoint))
    return guidance


def test_limits_are_the_smaller_of_airframe_and_parameters():
    airframe = AIRFRAME
    limits = SpeedLimits(airframe, Parameters())
    assert limits.horizontal_m_s == airframe.limits.speed_horizontal_m_s
    assert limits.up_m_s == airframe.limits.speed_up_m_s
    assert limits.land_m_s == 0.7
    slow = SpeedLimits(airframe, Parameters({"MPC_XY_VEL_MAX": 0.5, "MPC_Z_VEL_MAX_DN": 0.3}))
    assert slow.horizontal_m_s == 0.5
    assert slow.down_m_s == slow.land_m_s == 0.3


@given(yaw=st.floats(-pi, pi))
def test_a_velocity_north_is_turned_into_level_axes(yaw):
    forward, right, down = offboard(velocity_ned_m_s=(1.0, 0.0, 0.2)).step(at(yaw=yaw)).velocity_level_m_s
    assert (forward, right, down) == pytest.approx((cos(yaw), -sin(yaw), 0.2))


def test_an_axis_without_a_velocity_brakes():
    command = offboard(velocity_ned_m_s=(nan, 0.4, nan)).step(at(velocity=(1.0, 0.0, 0.0)))
    assert command.velocity_level_m_s == (0.0, 0.4, 0.0)


def test_a_velocity_beside_a_position_is_feed_forward():
    guidance = offboard(position_ned_m=(1.0, nan, -1.0), velocity_ned_m_s=(0.3, 0.5, nan))
    assert guidance.step(at(0.5, 7.0, -0.6)).velocity_level_m_s == pytest.approx((0.8, 0.5, -0.4))


def test_speeds_are_limited_and_keep_their_direction():
    velocity = offboard(velocity_ned_m_s=(30.0, 40.0, -9.0)).step(at()).velocity_level_m_s
    assert velocity == pytest.approx((1.2, 1.6, -1.5))
    assert offboard(position_ned_m=(0.0, 0.0, 99.0)).step(at()).velocity_level_m_s[2] == 1.0


@pytest.mark.parametrize(
    ("yaw", "target", "sign"), [(3.0, -3.0, 1), (-3.0, 3.0, -1), (0.1, 0.2, 1), (0.0, 2 * pi - 0.1, -1)]
)
def test_yaw_takes_the_shorter_turn(yaw, target, sign):
    rate = offboard(velocity_ned_m_s=(0.0, 0.0, 0.0), yaw_rad=target).step(at(yaw=yaw)).yaw_rate_rad_s
    assert rate * sign > 0
    assert abs(rate) <= LIMITS.yaw_rate_rad_s


def test_yaw_rate_alone_with_yaw_and_neither():
    still = (0.0, 0.0, 0.0)
    assert offboard(velocity_ned_m_s=still, yaw_rate_rad_s=0.7).step(at()).yaw_rate_rad_s == 0.7
    assert offboard(velocity_ned_m_s=still, yaw_rate_rad_s=9.0).step(at()).yaw_rate_rad_s == 2.0
    assert offboard(velocity_ned_m_s=still).step(at(yaw=1.0)).yaw_rate_rad_s == 0.0
    both = offboard(velocity_ned_m_s=still, yaw_rad=0.1, yaw_rate_rad_s=0.5).step(at())
    assert both.yaw_rate_rad_s == pytest.approx(0.75)


@given(position=any_vec3, velocity=any_vec3, yaw=any_float, rate=any_float)
def test_the_command_is_finite_and_limited_for_any_setpoint(position, velocity, yaw, rate):
    guidance = offboard(position_ned_m=position, velocity_ned_m_s=velocity, yaw_rad=yaw, yaw_rate_rad_s=rate)
    command = guidance.step(at(1.0, -2.0, -3.0, yaw=0.5))
    forward, right, down = command.velocity_level_m_s
    assert all(map(isfinite, (forward, right, down, command.yaw_rate_rad_s)))
    assert hypot(forward, right) <= LIMITS.horizontal_m_s * (1 + 1e-9)
    assert -LIMITS.up_m_s <= down <= LIMITS.down_m_s
    assert abs(command.yaw_rate_rad_s) <= LIMITS.yaw_rate_rad_s
    assert all(map(isfinite, guidance.mode.setpoint.velocity_ned_m_s))


def test_what_counts_as_a_setpoint():
    assert TrajectorySetpoint(0, velocity_ned_m_s=(nan, 0.0, nan)).is_usable
    assert TrajectorySetpoint(0, position_ned_m=(nan, nan, -1.0)).is_usable
    assert not TrajectorySetpoint(0, yaw_rad=1.0).is_usable
    assert TrajectorySetpoint(0, acceleration_ned_m_s2=(1.0, 0.0, 0.0)).is_usable
    assert not AttitudeSetpoint(0, attitude=(1.0, 0.0, 0.0, 0.0), thrust=nan).is_usable
    assert not AttitudeSetpoint(0, attitude=(nan, 0.0, 0.0, 0.0), thrust=0.5).is_usable
    assert BodyRateSetpoint(0, rate_frd_rad_s=(0.0, 0.0, 0.0), thrust=0.5).is_usable
    assert not MotorSetpoint(0, outputs=(0.5, nan, 0.5, 0.5)).is_usable


def test_an_infinite_component_counts_as_not_controlled_and_brakes():
    setpoint = TrajectorySetpoint(0, position_ned_m=(inf, nan, 1.0), velocity_ned_m_s=(inf, 1.0, -inf))
    safe = setpoint.bounded(LIMITS)
    assert safe.position_ned_m[0] != safe.position_ned_m[0]
    assert safe.velocity_ned_m_s == (0.0, 1.0, 0.0)


def test_hold_brakes_smoothly_and_then_keeps_the_position():
    guidance = limited()
    state = at(velocity=(1.0, 0.0, 0.0), yaw=0.3)
    guidance.enter(CommanderState.HOLD, state)
    speeds = []
    for _ in range(500):
        speeds.append(guidance.step(state).velocity_level_m_s[0])
        state.position_ned_m = guidance.context.trajectory.reference.position_ned_m
    assert all(after < before + 1e-3 for before, after in pairwise(speeds))
    assert speeds[0] == pytest.approx(cos(0.3), rel=0.01)
    north_m, east_m, _ = guidance.mode.setpoint.position_ned_m
    assert 0.3 < north_m < 0.8
    command = guidance.step(at(north_m - 0.2, east_m, 0.1, yaw=0.0))
    assert command.velocity_level_m_s == pytest.approx((0.2, 0.0, -0.1), abs=0.01)
    assert command.yaw_rate_rad_s > 0


def test_hold_at_rest_keeps_the_exact_position():
    guidance = limited()
    guidance.enter(CommanderState.HOLD, at(1.0, 2.0, -3.0))
    guidance.step(at(1.0, 2.0, -3.0))
    assert guidance.mode.setpoint.position_ned_m == (1.0, 2.0, -3.0)
    assert guidance.step(at(0.5, 2.0, -3.1)).velocity_level_m_s == pytest.approx((0.5, 0.0, 0.1))


def test_takeoff_climbs_vertically_reports_its_target_and_hold_keeps_it():
    guidance = limited()
    guidance.enter(CommanderState.TAKEOFF, at(1.0, 2.0, 0.0), target_ned_m=(nan, nan, -2.5))
    command = guidance.step(at(1.1, 2.0, 0.0))
    assert command.velocity_level_m_s == pytest.approx((-0.1, 0.0, -1.2))
    assert not guidance.mode.target_reached
    guidance.step(at(1.0, 2.0, -2.4))
    assert guidance.mode.target_reached
    guidance.enter(CommanderState.HOLD, at(1.0, 2.0, -2.4), keep_target=True)
    guidance.step(at(1.0, 2.0, -2.4))
    assert guidance.mode.setpoint.position_ned_m == (1.0, 2.0, -2.5)


def test_takeoff_to_a_lower_height_stays():
    guidance = limited()
    guidance.enter(CommanderState.TAKEOFF, at(down=-5.0), target_ned_m=(nan, nan, -2.5))
    assert guidance.step(at(down=-5.0)).velocity_level_m_s == (0.0, 0.0, 0.0)
    assert guidance.mode.target_reached


def test_land_accelerates_to_its_speed_and_keeps_the_position():
    guidance = limited()
    guidance.enter(CommanderState.LAND, at(1.0, 1.0, -3.0))
    sinks = [guidance.step(at(1.0, 1.0, -3.0)).velocity_level_m_s[2] for _ in range(500)]
    assert all(after > before - 1e-3 for before, after in pairwise(sinks))
    command = guidance.step(at(0.8, 1.0, -2.0))
    assert command.velocity_level_m_s == pytest.approx((0.2, 0.0, 0.7), abs=0.001)
    assert guidance.command_down_m_s == pytest.approx(0.7, abs=0.001)


def test_setpoints_are_shown_only_while_followed():
    guidance = limited()
    guidance.enter(CommanderState.HOLD, at())
    guidance.accept(TrajectorySetpoint(7, velocity_ned_m_s=(9.0, 0.0, 0.0)))
    assert guidance.mode.setpoint.time_us == 0
    guidance.enter(CommanderState.OFFBOARD, at())
    assert guidance.mode.setpoint.velocity_ned_m_s == (2.0, 0.0, 0.0)
