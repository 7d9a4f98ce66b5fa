"""The gimbal protocol, version 2, as MAVSDK, QGroundControl and missions use it."""

from dataclasses import replace
from math import cos, nan, pi, radians, sin

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firmware_py.mavlink.gimbal.model import GimbalLimits, GimbalTarget
from firmware_py.missions.flight import IssuedCommand
from firmware_py.types import VehicleState
from framerunner.geometry.rotations import quaternion_from_euler
from framerunner.wire.dialect import mavlink

GIMBAL, MANAGER = (1, 154), (1, 1)
ACCEPTED, DENIED = 0, 2
REQUEST, PITCH_YAW, CONFIGURE, ROI, NO_ROI = 512, 1000, 1001, 195, 197
LOCKED, IN_VEHICLE_FRAME = 16, 32


class FakeGimbal:
    """Keeps its targets."""

    limits = GimbalLimits(-pi / 2, 0.5, 2.8)
    pitch_rad, yaw_rad = -0.4, 0.2
    pitch_rate_rad_s, yaw_rate_rad_s = 0.1, 0.5
    yaw_locked = False

    def __init__(self):
        self.targets = []

    def turn(self, target):
        self.targets.append(target)


@pytest.fixture
def gimbal():
    return FakeGimbal()


@pytest.fixture
def pilot(autopilot, make_peer, gimbal):
    return make_peer(autopilot, node_options={"gimbal": gimbal})


def result(peer, *question, target=MANAGER):
    """The result of a command, and the other answers."""
    answers = peer.ask(peer.long(*question, target=target))
    (ack,) = [m for m in answers if m.get_type() == "COMMAND_ACK"]
    return ack.result, [m for m in answers if m is not ack]


def take_control(peer):
    assert result(peer, CONFIGURE, -2, -2, -1, -1)[0] == ACCEPTED


def same(target, pitch, yaw, pitch_rate=nan, yaw_rate=nan, locked=False):
    wanted = (pitch, yaw, pitch_rate, yaw_rate)
    got = (target.pitch_rad, target.yaw_rad, target.pitch_rate_rad_s, target.yaw_rate_rad_s)
    return got == pytest.approx(wanted, abs=1e-6, nan_ok=True) and target.yaw_locked is locked


def test_the_device_is_a_component_that_reports_its_attitude_ten_times_a_second(pilot):
    sent = [m for on, m in pilot.advance(2.0) if on == "onboard" and m.get_srcComponent() == 154]
    beats = [m for m in sent if m.get_type() == "HEARTBEAT"]
    assert [(m.type, m.autopilot) for m in beats] == [(26, 8)] * 2
    attitudes = [m for m in sent if m.get_type() == "GIMBAL_DEVICE_ATTITUDE_STATUS"]
    assert len(attitudes) == 20
    first = attitudes[0]
    assert first.q == pytest.approx(quaternion_from_euler(0.0, -0.4, 0.2))
    assert first.flags == 4 | 8 | IN_VEHICLE_FRAME
    assert (first.angular_velocity_x, first.angular_velocity_y, first.angular_velocity_z) == pytest.approx(
        (-0.5 * sin(-0.4), 0.1, 0.5 * cos(-0.4))
    )


def test_manager_and_device_describe_the_same_gimbal(pilot):
    done, (manager,) = result(pilot, REQUEST, 280)
    assert (done, manager.get_srcComponent(), manager.gimbal_device_id) == (ACCEPTED, 1, 154)
    done, (device,) = result(pilot, REQUEST, 283, target=GIMBAL)
    assert (done, device.get_srcComponent()) == (ACCEPTED, 154)
    for told in (manager, device):
        assert (told.pitch_min, told.pitch_max, told.yaw_min, told.yaw_max) == pytest.approx(
            (-pi / 2, 0.5, -2.8, 2.8)
        )
    assert result(pilot, REQUEST, 283)[0] == DENIED  # the autopilot is not the device
    assert result(pilot, REQUEST, nan, target=GIMBAL)[0] == DENIED


def test_without_a_gimbal_nobody_answers_for_it(peer):
    assert {m.get_srcComponent() for _, m in peer.advance(1.5)} == {1}
    assert result(peer, REQUEST, 280)[0] == DENIED
    assert result(peer, PITCH_YAW, 0, 0)[0] == 3
    assert peer.ask(peer.long(REQUEST, 283, target=GIMBAL)) == []


def test_only_who_is_in_control_turns_it(pilot, gimbal, autopilot, make_peer):
    assert result(pilot, PITCH_YAW, -10, 0, nan, nan, 12)[0] == DENIED
    take_control(pilot)
    assert result(pilot, PITCH_YAW, -10, 20, nan, nan, 12, 0, 154)[0] == ACCEPTED
    assert same(gimbal.targets[-1], radians(-10), radians(20))
    done, (status,) = result(pilot, CONFIGURE, 7, 8, 9, 10)
    assert done == ACCEPTED
    assert (status.primary_control_sysid, status.primary_control_compid) == (7, 8)
    assert (status.secondary_control_sysid, status.secondary_control_compid) == (9, 10)
    assert result(pilot, PITCH_YAW, -20, 0, nan, nan, 12)[0] == DENIED
    assert result(pilot, CONFIGURE, -3, -3, -3, -3)[0] == ACCEPTED  # it releases only its own control
    _, (status,) = result(pilot, REQUEST, 281)
    assert status.primary_control_sysid == 7
    assert len(gimbal.targets) == 1


def test_refusals_are_answered_each_time_and_told_once_in_five_seconds(pilot, autopilot, monkeypatch):
    told = []
    monkeypatch.setattr(autopilot, "say", lambda _severity, text: told.append(text))
    for _ in range(120):
        answers = pilot.ask(pilot.long(PITCH_YAW, -10, 0, nan, nan, 12, target=MANAGER))
        assert [m.result for m in answers if m.get_type() == "COMMAND_ACK"] == [DENIED]
        pilot.advance(0.1)
    assert 2 <= len(told) <= 3
    assert all(text.startswith("Gimbal refused ") for text in told)


@pytest.mark.parametrize(
    ("flags", "yaw_deg", "yaw_rad", "locked"),
    [
        (0, 30.0, radians(30), False),
        (LOCKED, 30.0, radians(30), True),
        (LOCKED | IN_VEHICLE_FRAME, 30.0, radians(30) + 1.0, True),
        (64, 30.0, radians(30) - 1.0, False),
    ],
)
def test_yaw_is_to_the_heading_or_to_north(pilot, gimbal, autopilot, flags, yaw_deg, yaw_rad, locked):
    autopilot.state = VehicleState(attitude=quaternion_from_euler(0.0, 0.0, 1.0))
    take_control(pilot)
    assert result(pilot, PITCH_YAW, 0, yaw_deg, nan, nan, flags)[0] == ACCEPTED
    assert same(gimbal.targets[-1], 0.0, yaw_rad, locked=locked)


@pytest.mark.parametrize(
    "params", [(0, 0, nan, nan, 1), (float("inf"), 0, nan, nan, 0), (0, 0, 0, 0, nan), (0, 0, 0, 0, 0, 0, 3)]
)
def test_what_it_cannot_do_is_denied(pilot, gimbal, params):
    """To retract, numbers that are none, and another gimbal."""
    take_control(pilot)
    assert result(pilot, PITCH_YAW, *params)[0] == DENIED
    assert gimbal.targets == []


def test_messages_turn_it_by_angles_and_by_rates(pilot, gimbal):
    def send(q, *rates, device=0):
        pilot.send(mavlink.MAVLink_gimbal_manager_set_attitude_message(1, 1, 12, device, q, *rates))

    angles = quaternion_from_euler(0.0, -0.3, 0.7)
    send(angles, nan, nan, nan)
    assert gimbal.targets == []  # it is not in control
    take_control(pilot)
    send(angles, nan, nan, nan)
    assert same(gimbal.targets[-1], -0.3, 0.7)
    send([nan] * 4, 0.0, 0.2, -0.1, device=154)
    assert same(gimbal.targets[-1], nan, nan, 0.2, -0.1)
    pilot.send(mavlink.MAVLink_gimbal_manager_set_pitchyaw_message(1, 1, 12, 0, 0.1, 0.2, nan, nan))
    assert same(gimbal.targets[-1], 0.1, 0.2)
    send(angles, nan, nan, nan, device=3)
    assert len(gimbal.targets) == 3


def test_it_follows_a_region_of_interest_until_it_is_turned_or_released(pilot, gimbal, autopilot):
    roi = pilot.int(ROI, 0, 0, 0, 0, 473977420, 85455940, 389.0, frame=0)  # 100 m below home
    pilot.ask(roi)
    pilot.advance(0.1)
    assert gimbal.targets[-1].pitch_rad == pytest.approx(-pi / 2)
    autopilot.state = VehicleState(position_ned_m=(-100.0, 0.0, 0.0))
    pilot.advance(0.1)
    assert same(gimbal.targets[-1], -pi / 4, 0.0, locked=True)
    autopilot.state = VehicleState(position_ned_m=(0.0, 100.0, 0.0))
    pilot.advance(0.1)
    assert same(gimbal.targets[-1], -pi / 4, -pi / 2, locked=True)
    assert result(pilot, NO_ROI)[0] == ACCEPTED
    count = len(gimbal.targets)
    pilot.advance(0.1)
    assert len(gimbal.targets) == count
    assert same(gimbal.targets[-1], 0.0, 0.0)
    assert [call[0] for call in autopilot.calls] == ["look_at", "look_at"]  # the vehicle yaws as before


@pytest.mark.parametrize(
    ("command", "params", "pitch_rad", "yaw_rad"),
    [
        (PITCH_YAW, (-45.0, 10.0, nan, nan, 12.0), -pi / 4, radians(10)),
        (205, (-90.0, 0.0, 0.0), -pi / 2, 0.0),
    ],
)
def test_items_of_a_mission_turn_it_without_taking_control(
    pilot, gimbal, autopilot, command, params, pitch_rad, yaw_rad
):
    issued = [IssuedCommand(command, (*params, *[0.0] * (7 - len(params))))]
    autopilot.take_issued_commands = lambda: [issued.pop()] if issued else []
    pilot.advance(0.01)
    assert same(gimbal.targets[-1], pitch_rad, yaw_rad)
    assert autopilot.texts == []


def test_a_missions_region_of_interest_is_the_gimbals_too(pilot, gimbal, autopilot):
    region = IssuedCommand(ROI, (0.0,) * 7, (100.0, 0.0, 0.0))
    issued = [replace(region, place_ned_m=None), region]
    autopilot.take_issued_commands = lambda: [issued.pop()] if issued else []
    pilot.advance(0.004)
    assert same(gimbal.targets[0], 0.0, 0.0, locked=True)


AWKWARD = st.one_of(
    st.sampled_from([0.0, -1.0, -2.0, -3.0, nan, float("inf"), 3e38, 154.0]), st.floats(width=32)
)


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.tuples(
            st.sampled_from([PITCH_YAW, CONFIGURE, ROI, 201, REQUEST]),
            st.lists(AWKWARD, min_size=7, max_size=7),
            st.sampled_from([GIMBAL, MANAGER, (1, 0)]),
        ),
        max_size=6,
    )
)
def test_awkward_parameters_break_nothing(autopilot, make_peer, sent):
    gimbal = FakeGimbal()
    peer = make_peer(autopilot, node_options={"gimbal": gimbal})
    for command, params, target in sent:
        peer.ask(peer.long(command, *params, target=target))
        peer.advance(0.02)
    assert peer.node.failed_messages == 0
    assert all(isinstance(target, GimbalTarget) for target in gimbal.targets)
