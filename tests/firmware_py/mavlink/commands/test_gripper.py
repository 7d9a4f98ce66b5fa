from math import nan

import pytest

from firmware_py.missions.flight import IssuedCommand

GRIPPER, RELEASE, GRAB = 211, 0, 1
ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3


def result(peer, *params):
    (ack,) = [m for m in peer.ask(peer.long(GRIPPER, *params)) if m.get_type() == "COMMAND_ACK"]
    return ack.result


@pytest.fixture
def holder(autopilot, make_peer):
    return make_peer(autopilot, node_options={"gripper": True})


def test_it_closes_and_opens_and_tells_each_change_once(holder, autopilot):
    for action in (GRAB, GRAB, RELEASE, RELEASE):
        assert result(holder, 1, action) == ACCEPTED
    assert [text.text for text in autopilot.texts] == ["Gripper closed", "Gripper opened"]


@pytest.mark.parametrize("params", [(2, GRAB), (1, 2), (1, nan), (-1, RELEASE)])
def test_another_gripper_or_action_is_denied(holder, autopilot, params):
    assert result(holder, *params) == DENIED
    assert autopilot.texts == []


def test_without_one_it_is_not_supported(peer):
    assert result(peer, 1, GRAB) == UNSUPPORTED


@pytest.mark.parametrize(
    ("has_one", "text"), [(True, "Gripper closed"), (False, "Mission command 211 not done: unsupported")]
)
def test_a_mission_uses_it(autopilot, make_peer, has_one, text):
    peer = make_peer(autopilot, node_options={"gripper": has_one})
    autopilot.take_issued_commands = lambda: [IssuedCommand(GRIPPER, (1.0, 1.0, *[0.0] * 5))]
    peer.advance(0.0)
    assert [said.text for said in autopilot.texts] == [text]
