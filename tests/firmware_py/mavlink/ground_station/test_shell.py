"""The shell over SERIAL_CONTROL: silent unless enabled, and about the vehicle only."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from framerunner.wire.dialect import mavlink
from framerunner.wire.link import LinkProfile

SHELL, REPLY, RESPOND = 10, 1, 2
LINKS = (LinkProfile("onboard", {}),)


@pytest.fixture
def peer(autopilot, make_peer):
    return make_peer(autopilot, links=LINKS, node_options={"shell": True})


def typed(peer, text, *, device=SHELL, flags=RESPOND):
    """What the shell answers to a text."""
    data = text if isinstance(text, bytes) else text.encode()
    for start in range(0, max(len(data), 1), 70):
        piece = data[start : start + 70]
        peer.send(
            mavlink.MAVLink_serial_control_message(device, flags, 0, 0, len(piece), piece.ljust(70, b"\0"))
        )
    answers = [message for _, message in peer.advance(1.0) if message.get_type() == "SERIAL_CONTROL"]
    assert all(message.flags == REPLY and message.device == SHELL for message in answers)
    return b"".join(bytes(message.data)[: message.count] for message in answers).decode()


def test_it_is_silent_unless_switched_on(autopilot, make_peer):
    assert typed(make_peer(autopilot, links=LINKS), "ver all\n") == ""


def test_it_prompts_echoes_and_answers(peer):
    assert typed(peer, "\n") == "nsh> \r\nnsh> "
    answer = typed(peer, "ver all\n")
    assert answer.startswith("ver all\r\n")
    assert "compatible with PX4 1.17.0" in answer
    assert answer.endswith("nsh> ")
    assert "param show" in typed(peer, "help\n")
    assert "Disarmed" in typed(peer, "commander status\n")
    assert "position NED" in typed(peer, "status\n")
    assert "command not found" in typed(peer, "ls /\n")
    assert "start the simulator again" in typed(peer, "reboot\n")


def test_parameters_are_shown_and_set_within_their_range(peer, autopilot):
    assert "MIS_TAKEOFF_ALT" in typed(peer, "param show 'MIS_TAKE*'\n")
    typed(peer, "param set MIS_TAKEOFF_ALT 3.5\n")
    assert autopilot.parameters.value("MIS_TAKEOFF_ALT") == 3.5
    assert "outside" in typed(peer, "param set MIS_TAKEOFF_ALT 1e9\n")
    assert "no such parameter" in typed(peer, "param set NOTHING 1\n")
    assert "not a number" in typed(peer, "param set MIS_TAKEOFF_ALT high\n")
    assert "usage" in typed(peer, "param\n")
    assert autopilot.parameters.value("MIS_TAKEOFF_ALT") == 3.5


def test_a_line_may_come_in_pieces_and_be_corrected(peer):
    typed(peer, "ve")
    assert "compatible with PX4" in typed(peer, "x\x7fr all\r\n")


def test_other_devices_replies_and_other_vehicles_are_left_alone(peer):
    assert typed(peer, "help\n", device=0) == ""
    assert typed(peer, "help\n", flags=REPLY | RESPOND) == ""
    typed(peer, "\n")
    assert typed(peer, "", flags=0) == ""  # goodbye


def test_mavsdk_is_answered_though_it_sets_no_flag(peer):
    assert "compatible with PX4" in typed(peer, "ver all\n", flags=0)


LINES = st.one_of(st.binary(max_size=70), st.sampled_from([b"param set", b"param show ["]))


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(LINES, max_size=10))
def test_anything_typed_breaks_nothing(autopilot, make_peer, lines):
    peer = make_peer(autopilot, links=LINKS, node_options={"shell": True})
    for line in lines:
        typed(peer, line + b"\n")
    assert peer.node.failed_messages == 0
