from math import nan, pi

import pytest

from firmware_py.mavlink.dialect import mavlink
from firmware_py.types import VehicleState

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
def test_a_refused_one_is_no_setpoint_and_is_said_once_a_second(autopilot, peer, message, text):
    for _ in range(60):  # three seconds at 20 Hz
        peer.send(message)
        peer.time_us += 50_000
        peer.node._exchange.time_us = peer.time_us
    assert autopilot.setpoints == []
    assert [said.text for said in autopilot.texts] == [text] * 3
    assert {said.severity for said in autopilot.texts} == {mavlink.MAV_SEVERITY_CRITICAL}
