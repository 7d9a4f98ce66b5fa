"""Packets received on one link are forwarded to another."""

import pytest

from framerunner.wire.dialect import mavlink
from framerunner.wire.exchange import _CAPACITY, Exchange, Router
from framerunner.wire.link import LinkProfile

OTHERS = (245, 191)
STATION = (255, 190)


class Party:
    """Several clients of one system, each with its own ids and link; keeps the bytes sent on each link."""

    def __init__(self):
        self.exchange = Exchange(1)
        self.exchange.add_link(LinkProfile("onboard", {}))
        self.exchange.add_link(LinkProfile("ground", {}))
        self.packers = {}

    def send(self, who, link, message, **options):
        packer = self.packers.setdefault(who, mavlink.MAVLink(None, *who))
        data = message.pack(packer, **options)
        self.receive(link, data)
        return bytes(data)

    def receive(self, name, data):
        link = self.exchange.links[name]
        link.reader.add(data)
        return list(self.exchange.receive(link, 1000))

    def heartbeat(self, who, link):
        kind = mavlink.MAV_TYPE_GCS if who == STATION else mavlink.MAV_TYPE_ONBOARD_CONTROLLER
        return self.send(who, link, mavlink.MAVLink_heartbeat_message(kind, 8, 0, 0, 4, 3))

    def arrived(self, link):
        return b"".join(data for name, data in self.exchange.take_output() if name == link)


@pytest.fixture
def party():
    """The app on the onboard link and a ground station on the ground link; both have sent a heartbeat."""
    party = Party()
    party.heartbeat(OTHERS, "onboard")
    party.heartbeat(STATION, "ground")
    party.exchange.take_output()
    return party


def long_to(system, component):
    return mavlink.MAVLink_command_long_message(system, component, 31999, 0, *[0.0] * 7)


def test_heartbeats_of_each_appear_on_the_other_link_unchanged(party):
    data = party.heartbeat(STATION, "ground")
    assert data in party.arrived("onboard")
    data = party.heartbeat(OTHERS, "onboard")
    assert data in party.arrived("ground")


def test_nothing_is_forwarded_back(party):
    data = party.heartbeat(STATION, "ground")
    assert data not in party.arrived("ground")


def test_nothing_is_forwarded_where_no_component_was_heard():
    party = Party()
    data = party.heartbeat(STATION, "ground")
    assert data not in party.arrived("onboard")


@pytest.mark.parametrize(
    ("target", "goes"),
    [(OTHERS, True), ((245, 0), True), ((245, 55), False), ((7, 1), False), ((1, 1), False), ((0, 0), True)],
)
def test_a_message_with_a_target_is_forwarded_where_that_was_heard(party, target, goes):
    data = party.send(STATION, "ground", long_to(*target))
    assert (data in party.arrived("onboard")) is goes


def test_an_unknown_message_is_forwarded_unchanged(party):
    packer = mavlink.MAVLink(None, *STATION)
    data = bytearray(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(packer))
    data[7:10] = (59_999).to_bytes(3, "little")
    party.receive("ground", bytes(data))
    assert bytes(data) in party.arrived("onboard")


def test_mavlink_1_is_forwarded_unchanged(party):
    message = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    data = party.send(STATION, "ground", message, force_mavlink1=True)
    assert data[0] == 0xFE
    assert data in party.arrived("onboard")


def test_a_malformed_packet_is_not_forwarded(party):
    packer = mavlink.MAVLink(None, *STATION)
    data = bytearray(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(packer))
    data[-1] ^= 0xFF
    party.receive("ground", bytes(data))
    party.receive("ground", bytes(300))
    assert party.arrived("onboard") == b""


def test_a_packet_with_our_ids_is_not_forwarded(party):
    data = party.heartbeat((1, 1), "ground")
    assert data not in party.arrived("onboard")


def test_who_sits_on_both_links_makes_no_echo(party):
    party.heartbeat(OTHERS, "ground")
    party.exchange.take_output()
    data = party.heartbeat(OTHERS, "onboard")
    assert data not in party.arrived("ground")


def test_the_silent_are_forgotten(party):
    party.exchange.advance(61_000_000)
    data = party.heartbeat(STATION, "ground")
    assert data not in party.arrived("onboard")


def test_a_removed_link_gets_nothing(party):
    party.exchange.remove_link("onboard")
    party.heartbeat(STATION, "ground")
    assert party.arrived("onboard") == b""


def test_the_table_is_bounded_and_drops_the_longest_silent_first():
    router = Router(lambda system, component: False)
    heartbeat = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    router.note("a", (2, 1), 0)
    for number in range(10 * _CAPACITY):
        router.note("b", (3 + number % 200, number // 200), 1 + number)
    assert len(router._received_us) == _CAPACITY
    assert router.destinations("b", (9, 9), heartbeat, 1000) == []
