from math import cos, inf, isnan, nan, pi, sin

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_py.offboard_requests import (
    LocalTarget,
    SetpointRefusal,
    TargetMask,
    setpoint_from_body_velocity,
    setpoint_from_target,
)
from firmware_py.setpoints import Setpoint
from firmware_py.types import VehicleState

BODY_VELOCITY = 0x5C7
LOCAL, BODY = 1, 8
STATE = VehicleState(yaw_rad=pi / 6, attitude=(cos(pi / 12), 0.0, 0.0, sin(pi / 12)))
INVALID = SetpointRefusal("SET_POSITION_TARGET_LOCAL_NED invalid")


def body(velocity, mask=BODY_VELOCITY, **fields):
    return setpoint_from_target(LocalTarget(BODY, mask, velocity_m_s=velocity, **fields), STATE, 5)


def local(mask, **fields):
    return setpoint_from_target(LocalTarget(LOCAL, mask, **fields), STATE, 5)


def all_nan(vector):
    return all(isnan(value) for value in vector)


def test_body_velocity_turns_with_the_yaw_only():
    tilted = VehicleState(yaw_rad=pi / 2, roll_rad=0.3, pitch_rad=0.2, attitude=(0.7, 0.2, 0.1, 0.67))
    setpoint = setpoint_from_target(LocalTarget(BODY, BODY_VELOCITY, velocity_m_s=(2.0, 1.0, 0.5)), tilted, 5)
    assert setpoint.velocity_ned_m_s == pytest.approx((-1.0, 2.0, 0.5))
    assert all_nan(setpoint.trajectory.position_ned_m)
    assert all_nan(setpoint.acceleration_ned_m_s2)
    assert isnan(setpoint.yaw_rad)
    assert setpoint.time_us == 5


def test_body_acceleration_turns_with_the_whole_attitude():
    rolled = VehicleState(attitude=(cos(pi / 4), sin(pi / 4), 0.0, 0.0))  # right side down
    mask = BODY_VELOCITY & ~0x1C0 | 0x38
    target = LocalTarget(BODY, mask, acceleration_m_s2=(1.0, 2.0, 3.0))
    assert setpoint_from_target(target, rolled, 5).acceleration_ned_m_s2 == pytest.approx((1.0, -3.0, 2.0))


@pytest.mark.parametrize("bit", [TargetMask.VX, TargetMask.VY, TargetMask.VZ])
def test_one_ignored_body_velocity_ignores_all_three(bit):
    assert body((1.0, 1.0, 1.0), BODY_VELOCITY | bit) == INVALID


def test_body_position_is_discarded():
    assert all_nan(body((1.0, 0.0, 0.0), mask=0x5C0, position_m=(9.0, 9.0, 9.0)).trajectory.position_ned_m)


def test_local_components_are_taken_as_masked():
    setpoint = local(0xDF8, position_m=(1.0, 2.0, -3.0), yaw_rad=0.5)
    assert setpoint.position_ned_m == (1.0, 2.0, -3.0)
    assert all_nan(setpoint.velocity_ned_m_s)
    assert isnan(setpoint.yaw_rad)
    assert isnan(setpoint.yaw_rate_rad_s)


def test_height_held_and_horizontal_velocity_flown_together():
    mask = 0xFFF & ~(TargetMask.Z | TargetMask.VX | TargetMask.VY | TargetMask.YAW)
    setpoint = local(mask, position_m=(0, 0, -2.0), velocity_m_s=(1.0, 0.5, 9.0), yaw_rad=1.0)
    assert setpoint.position_ned_m[2] == -2.0
    assert setpoint.velocity_ned_m_s[:2] == (1.0, 0.5)
    assert isnan(setpoint.velocity_ned_m_s[2])
    assert setpoint.yaw_rad == 1.0


def test_yaw_and_yaw_rate_may_both_be_given():
    setpoint = body((1.0, 0.0, 0.0), BODY_VELOCITY & ~TargetMask.YAW, yaw_rad=0.5, yaw_rate_rad_s=0.1)
    assert (setpoint.yaw_rad, setpoint.yaw_rate_rad_s) == (0.5, 0.1)


@pytest.mark.parametrize("frame", [0, 2, 7, 9, 12, 13, 18, 21, 99, 255])
def test_other_frames_are_refused(frame):
    refused = setpoint_from_target(LocalTarget(frame, BODY_VELOCITY, velocity_m_s=(1, 0, 0)), STATE, 5)
    assert refused.text == f"SET_POSITION_TARGET_LOCAL_NED coordinate frame {frame} unsupported"


def test_a_request_without_components_is_refused():
    assert local(0xFFF) == INVALID
    assert body((nan, nan, nan)) == INVALID
    assert body((inf, inf, -inf)) == INVALID


def test_force_is_refused_where_there_is_an_acceleration():
    refused = local(0xE3F, acceleration_m_s2=(1, 1, 1))
    assert refused.text == "SET_POSITION_TARGET_LOCAL_NED force not supported"
    assert isinstance(local(0xFC7, velocity_m_s=(1, 1, 1)), Setpoint)


@pytest.mark.parametrize("velocity", [(nan, 0.5, 0.1), (1.0, 0.5, nan), (inf, 0.0, 0.0), (1.0, -inf, 0.0)])
@pytest.mark.parametrize("make", [body, lambda velocity: local(0xDC7, velocity_m_s=velocity)])
def test_one_component_not_finite_brakes(make, velocity):
    assert make(velocity).velocity_ned_m_s == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "mask",
    [
        0xFFF & ~TargetMask.X,  # half a pair
        0xFFF & ~(TargetMask.X | TargetMask.Y),  # height not controlled
        0xFFF & ~TargetMask.VZ,  # only height
    ],
)
def test_an_uncontrolled_axis_brakes(mask):
    setpoint = local(mask, position_m=(5.0, 5.0, -5.0), velocity_m_s=(1.0, 1.0, 1.0))
    assert setpoint.velocity_ned_m_s == (0.0, 0.0, 0.0)
    assert all_nan(setpoint.position_ned_m)


def test_a_yaw_rate_that_is_not_finite_is_ignored():
    assert isnan(body((1.0, 0.0, 0.0), yaw_rate_rad_s=nan).yaw_rate_rad_s)
    assert isnan(body((1.0, 0.0, 0.0), yaw_rate_rad_s=inf).yaw_rate_rad_s)


@given(st.tuples(st.floats(), st.floats(), st.floats()), st.floats(), st.floats(-4, 4))
def test_the_setpoint_without_a_packet_is_the_same(velocity, yaw_rate, heading):
    state = VehicleState(yaw_rad=heading)
    target = LocalTarget(BODY, BODY_VELOCITY, velocity_m_s=velocity, yaw_rate_rad_s=yaw_rate)
    by_message = setpoint_from_target(target, state, 7)
    assert repr(setpoint_from_body_velocity(velocity, yaw_rate, state, 7)) == repr(by_message)


any3 = st.tuples(st.floats(), st.floats(), st.floats())


@given(st.integers(0, 255), st.integers(0, 0xFFFF), any3, any3, any3, st.floats(), st.floats())
def test_every_setpoint_controls_every_axis_with_finite_values(frame, mask, p, v, a, yaw, rate):
    result = setpoint_from_target(LocalTarget(frame, mask, p, v, a, yaw, rate), STATE, 5)
    if isinstance(result, SetpointRefusal):
        return
    told = result.trajectory
    groups = (told.position_ned_m, told.velocity_ned_m_s, told.acceleration_ned_m_s2)
    assert not any(value in (inf, -inf) for group in groups for value in group)
    for axis in range(3):
        assert any(not isnan(group[axis]) for group in groups)
    for group in groups:
        assert isnan(group[0]) == isnan(group[1])
