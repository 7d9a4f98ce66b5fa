"""Links that are added to a node and removed."""

import pytest

from firmware_py.mavlink.service import merged
from firmware_py.mavlink.telemetry.profiles import GROUND, ONBOARD
from framerunner.wire.dialect import mavlink
from tests.node_input import deliver


def test_links_come_and_go_while_flying(peer):
    peer.meet_ground_station("ground")
    peer.autopilot.say(4, "before")
    peer.node.remove_link("ground")
    peer.advance(0.5)
    peer.node.add_link(GROUND)
    peer.autopilot.say(4, "after")
    peer.meet_ground_station("ground")
    texts = [m.text for link, m in peer.advance(0.5) if link == "ground" and m.get_type() == "STATUSTEXT"]
    assert texts == ["after"]


def test_a_list_of_parameters_for_who_has_left_ends(peer):
    request = mavlink.MAVLink_param_request_list_message(1, 1)
    peer.send(request, ONBOARD.name)
    peer.node.remove_link(ONBOARD.name)
    peer.advance(1.0)
    assert peer.node.failed_messages == 0


def test_bytes_of_a_removed_link_are_dropped(peer):
    peer.node.remove_link("onboard")
    deliver(peer.node, "onboard", b"late")
    assert {link for link, _ in peer.advance(0.5)} == {"ground"}


def test_two_services_cannot_claim_one_message():
    with pytest.raises(ValueError, match="id 11"):
        merged([{11: 1}, {12: 2}, {11: 3}])
