from math import nan, pi

import pytest

from firmware_py.setpoints import BodyRateSetpoint
from firmware_py.types import VehicleState
from framerunner.wire.dialect import mavlink
from tests.firmware_py.mavlink.conftest import HOME

VELOCITY_AND_YAW_RATE = 0x5C7


def target(velocity=(1.0, 0.0, 0.0), *, frame=8, mask=VELOCITY_AND_YAW_RATE, to=(1, 1), yaw_rate=0.0):
    return mavlink.MAVLink_set_position_target_local_ned_message(
        0, *to, frame, mask, 0, 0, 0, *velocity, 0, 0, 0, 0, yaw_rate
    )


def test_a_body_velocity_reaches_the_autopilot_in_world_axes(autopilot, peer):
    autopilot.state = VehicleState(yaw_rad=pi / 2)
    peer.advance(0.1)
    peer.send(target((2.0, 1.0, -0.5), yaw_rate=0.25))
    (setpoint,) = autopilot.setpoints
    assert setpoint.velocity_ned_m_s == pytest.approx((-1.0, 2.0, -0.5))
    assert setpoint.yaw_rate_rad_s == 0.25
    assert setpoint.time_us == peer.time_us


@pytest.mark.parametrize(("to", "taken"), [((1, 1), 1), ((0, 0), 1), ((1, 0), 1), ((2, 1), 0), ((1, 7), 0)])
def test_targets(autopilot, peer, to, taken):
    peer.send(target(to=to))
    assert len(autopilot.setpoints) == taken


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (target((nan, nan, nan)), "SET_POSITION_TARGET_LOCAL_NED invalid"),
        (target(mask=0xFFF), "SET_POSITION_TARGET_LOCAL_NED invalid"),
        (target(frame=7), "SET_POSITION_TARGET_LOCAL_NED coordinate frame 7 unsupported"),
        (target(frame=99), "SET_POSITION_TARGET_LOCAL_NED coordinate frame 99 unsupported"),
    ],
)
def test_a_refusal_is_no_setpoint_and_is_reported_once_a_second(autopilot, peer, message, text):
    for _ in range(60):  # three seconds at 20 Hz
        peer.send(message)
        peer.time_us += 50_000
        peer.node._exchange.time_us = peer.time_us
    assert autopilot.setpoints == []
    assert [said.text for said in autopilot.texts] == [text] * 3
    assert {said.severity for said in autopilot.texts} == {mavlink.MAV_SEVERITY_CRITICAL}


def attitude(mask=0, q=(1.0, 0.0, 0.0, 0.0), rates=(0.1, 0.2, 0.3), thrust=0.6):
    return mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, list(q), *rates, thrust)


def test_an_attitude_with_a_thrust(autopilot, peer):
    peer.send(attitude(q=(2.0, 0.0, 0.0, 0.0)))
    (setpoint,) = autopilot.setpoints
    assert setpoint.attitude == (1.0, 0.0, 0.0, 0.0)
    assert setpoint.thrust == pytest.approx(0.6)
    assert setpoint.yaw_rate_rad_s == pytest.approx(0.3)


def test_rates_with_a_thrust(autopilot, peer):
    peer.send(attitude(mask=128))
    (setpoint,) = autopilot.setpoints
    assert isinstance(setpoint, BodyRateSetpoint)
    assert setpoint.rate_frd_rad_s == pytest.approx((0.1, 0.2, 0.3))


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (attitude(mask=128 | 3), "SET_ATTITUDE_TARGET invalid: neither attitude nor rates"),
        (attitude(thrust=nan), "SET_ATTITUDE_TARGET invalid: thrust is not a number"),
        (attitude(q=(0.0, 0.0, 0.0, 0.0)), "SET_ATTITUDE_TARGET invalid: attitude is no quaternion"),
        (attitude(q=(nan, 0.0, 0.0, 0.0)), "SET_ATTITUDE_TARGET invalid: attitude is no quaternion"),
    ],
)
def test_attitudes_that_cannot_be_flown(autopilot, peer, message, text):
    peer.send(message)
    assert autopilot.setpoints == []
    assert [said.text for said in autopilot.texts] == [text]


def global_target(frame=6, mask=0xDF8, lat=HOME.latitude_deg + 1e-4, alt=10.0):
    return mavlink.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, mask, round(lat * 1e7), round(HOME.longitude_deg * 1e7), alt, *[0] * 6, 0.5, 0.0
    )


@pytest.mark.parametrize(("frame", "alt"), [(6, 10.0), (5, HOME.altitude_m + 10.0)])
def test_a_place_on_earth(autopilot, peer, frame, alt):
    peer.send(global_target(frame, mask=0x9F8, alt=alt))
    (setpoint,) = autopilot.setpoints
    assert setpoint.position_ned_m == pytest.approx((11.12, 0.0, -10.0), abs=0.02)
    assert setpoint.yaw_rad == pytest.approx(0.5)


def test_places_that_are_none(autopilot, peer):
    peer.send(global_target(lat=120.0))
    peer.send(global_target(alt=nan))
    autopilot.status.home = None
    peer.send(global_target())
    assert autopilot.setpoints == []
    peer.send(global_target(frame=1))
    assert autopilot.texts[-1].text == "SET_POSITION_TARGET_GLOBAL_INT invalid coordinate frame 1"


@pytest.mark.parametrize(
    ("frame", "mask", "says"),
    [
        (6, 0xFFF, "invalid"),
        (6, 0x638, "force not supported"),
        (0, 0xDF8, "invalid coordinate frame 0"),
        (11, 0xDF8, "invalid coordinate frame 11"),
    ],
)
def test_a_refusal_names_the_message(autopilot, peer, frame, mask, says):
    peer.send(global_target(frame, mask))
    assert autopilot.setpoints == []
    assert [said.text for said in autopilot.texts] == [f"SET_POSITION_TARGET_GLOBAL_INT {says}"]


def test_without_a_position_any_frame_is_taken(autopilot, peer):
    peer.send(global_target(frame=0, mask=0xDC7))
    (setpoint,) = autopilot.setpoints
    assert setpoint.velocity_ned_m_s == (0.0, 0.0, 0.0)


def controls(*values, group=0):
    padded = [*values, *[0.0] * (8 - len(values))]
    return mavlink.MAVLink_set_actuator_control_target_message(0, group, 1, 1, padded)


def test_controls_are_mixed_to_the_motors(autopilot, peer):
    peer.send(controls(0.0, 0.0, 0.0, 0.5))
    peer.send(controls(0.1, 0.0, 0.0, 0.5))
    peer.send(controls(0.0, 0.1, 0.0, 0.5))
    level, rolls, pitches = (setpoint.outputs for setpoint in autopilot.setpoints)
    assert level == (0.5,) * 4
    # front right, rear left, front left, rear right
    assert rolls == pytest.approx((0.4, 0.6, 0.6, 0.4))
    assert pitches == pytest.approx((0.6, 0.4, 0.6, 0.4))


def test_other_groups_and_no_numbers_are_no_controls(autopilot, peer):
    peer.send(controls(0.0, 0.0, 0.0, 0.5, group=1))
    peer.send(controls(nan, 0.0, 0.0, 0.5))
    assert autopilot.setpoints == []
    assert autopilot.texts[-1].text == "SET_ACTUATOR_CONTROL_TARGET invalid: a control is not a number"


def followed(lat=HOME.latitude_deg + 1e-4, vel=(1.0, 2.0, 0.0), capabilities=3):
    return mavlink.MAVLink_follow_target_message(
        0,
        capabilities,
        round(lat * 1e7),
        round(HOME.longitude_deg * 1e7),
        HOME.altitude_m + 2.0,
        list(vel),
        [0.0] * 3,
        [1.0, 0.0, 0.0, 0.0],
        [0.0] * 3,
        [0.0] * 3,
        0,
    )


def test_a_target_is_followed_in_the_local_frame(autopilot, peer):
    peer.send(followed())
    ((name, place, velocity),) = autopilot.calls
    assert name == "follow_target"
    assert place == pytest.approx((11.12, 0.0, -2.0), abs=0.02)
    assert velocity == (1.0, 2.0, 0.0)


@pytest.mark.parametrize("odd", [{"capabilities": 1}, {"vel": (nan, 0.0, 0.0)}])
def test_a_target_without_a_velocity_stands(autopilot, peer, odd):
    peer.send(followed(**odd))
    assert autopilot.calls[0][2] == (0.0, 0.0, 0.0)


def test_a_target_nowhere_on_earth_is_dropped(autopilot, peer):
    peer.send(followed(lat=120.0))
    assert autopilot.calls == []
