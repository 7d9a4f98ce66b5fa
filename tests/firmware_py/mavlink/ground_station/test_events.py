import json
import lzma
from struct import unpack

import pytest

from firmware_py.mavlink.ground_station.event_definitions import (
    CHECKS,
    MODE_CHANGED,
    TEXTS,
    EventKind,
    all_kinds,
    event_of,
)
from firmware_py.mavlink.ground_station.metadata import EVENTS_FILE, ExtraFiles
from firmware_py.mavlink.node import MavlinkNode
from firmware_py.mavlink.telemetry.profiles import GROUND, ONBOARD
from firmware_py.status import FlightMode
from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader

INFO, PROTOCOL = 6, 8
NUMBERED = ("EVENT", "CURRENT_EVENT_SEQUENCE")
FORMATS = {"uint8_t": "B", "uint16_t": "H", "uint32_t": "I", "float": "f"}


@pytest.fixture(scope="module")
def described():
    """Event id to (group, event), and the enumerations, as a ground station reads them from the file."""
    component = json.loads(lzma.decompress(ExtraFiles()[EVENTS_FILE]))["components"]["1"]
    events = {
        1 << 24 | int(number): (name, event)
        for name, group in component["event_groups"].items()
        for number, event in group["events"].items()
    }
    return events, component["enums"]


def events(received, link="onboard"):
    return [m for on, m in received if on == link and m.get_type() == "EVENT"]


def named(messages, described):
    return [described[0][message.id][1]["name"] for message in messages]


def values(message, described):
    arguments = described[0][message.id][1].get("arguments", [])
    kinds = [FORMATS.get(each["type"]) or FORMATS[described[1][each["type"]]["type"]] for each in arguments]
    layout = "<" + "".join(kinds)
    return unpack(layout, bytes(message.arguments)[: sum({"B": 1, "H": 2}.get(kind, 4) for kind in kinds)])


def request(first, last, target=(1, 1)):
    return mavlink.MAVLink_request_event_message(*target, first, last)


def test_ids_are_made_as_px4_makes_them():
    # An event of the recorded flight: its name hashes to the id that PX4 sent.
    assert EventKind("commander_arming_check_summary", "x").id == 0x1A893E0
    ids = [kind.id for kind in all_kinds()]
    assert len(ids) == len(set(ids))


def test_the_first_events_are_a_health_report_numbered_on(autopilot, described):
    node, readers = (
        MavlinkNode(autopilot, (ONBOARD, GROUND)),
        {"onboard": PacketReader(), "ground": PacketReader()},
    )
    node.update(0)
    received = [(link, m) for link, data in node.take_output() for m in readers[link].feed(data)]
    for link in readers:
        heard = events(received, link)
        assert named(heard, described) == ["arming_check_summary", "health_summary"]
        assert [m.sequence for m in heard] == [65526, 65527]
        (told,) = [m for on, m in received if on == link and m.get_type() == "CURRENT_EVENT_SEQUENCE"]
        assert (told.sequence, told.flags) == (65525, 1)


def test_the_sequence_is_sent_every_three_seconds_and_reset_only_at_first(peer):
    told = [m for on, m in peer.advance(9.1) if on == "ground" and m.get_type() == "CURRENT_EVENT_SEQUENCE"]
    assert len(told) == 3
    assert {m.flags for m in told} == {0}
    assert {m.sequence for m in told} == {65527}


def test_a_text_with_an_event_ends_with_a_tab(autopilot, peer, described):
    peer.meet_ground_station()
    peer.advance(0.1)
    autopilot.say(INFO, "Landing detected")
    autopilot.say(INFO, "Nobody has made an event of this")
    received = peer.advance(0.1)
    texts = [m.text for on, m in received if on == "ground" and m.get_type() == "STATUSTEXT"]
    assert texts == ["Landing detected\t", "Nobody has made an event of this"]
    (event,) = events(received, "ground")
    group, kind = described[0][event.id]
    assert (group, kind["message"]) == ("default", "Landing detected")
    assert event.log_levels == INFO << 4 | INFO


def test_figures_travel_as_arguments(autopilot, peer, described):
    peer.advance(0.1)
    autopilot.say(INFO, "Using default takeoff altitude: 2.5 m")
    (event,) = events(peer.advance(0.1))
    assert described[0][event.id][1]["message"] == "Using default takeoff altitude: {1:.1m_v}"
    assert values(event, described) == (2.5,)


def test_every_text_of_the_commander_is_an_event():
    from firmware_py.commander_table import TABLE

    for row in TABLE:
        assert not row.text or event_of(row.text) is not None
    assert event_of("") is None


def test_a_change_of_mode_is_an_event(autopilot, peer, described):
    peer.advance(0.1)
    autopilot.status.mode = FlightMode.OFFBOARD
    (event,) = events(peer.advance(0.05))
    assert event.id == MODE_CHANGED.id
    (number,) = values(event, described)
    assert described[1]["flight_mode_t"]["entries"][str(number)]["description"] == "Offboard"


def bit(described, enum, name):
    entries = described[1][enum]["entries"]
    return next(int(value) for value, entry in entries.items() if entry["name"] == name)


def test_a_healthy_vehicle_can_be_armed_in_hold_but_not_in_return(peer, described):
    peer.send(peer.long(401))
    first, last = events(peer.advance(0.05))
    _, error, _, can_arm, can_run = values(first, described)
    loiter, rtl = (bit(described, "navigation_mode_group_t", name) for name in ("loiter", "rtl"))
    assert error == 0
    assert can_arm & loiter and not can_arm & rtl
    assert can_run & loiter and can_run & rtl
    _, present, failing, warning = values(last, described)
    assert present & bit(described, "health_component_t", "gps")
    assert (failing, warning) == (0, 0)
    assert {first.log_levels & 15, last.log_levels & 15} == {PROTOCOL}


def test_what_hinders_arming_is_reported_between_the_summaries(autopilot, peer, described):
    peer.advance(3.0)
    reason = next(iter(CHECKS))
    autopilot.status.ready, autopilot.status.not_ready = False, reason
    first, check, last = events(peer.advance(2.2))
    assert [described[0][m.id][0] for m in (first, check, last)] == ["arming_check", "arming_check", "health"]
    assert described[0][check.id][1]["message"].lower() == reason.removeprefix("Arming denied: ").lower()
    modes, part = values(check, described)
    assert values(first, described)[1] == 1 << part
    assert values(first, described)[3] & modes == 0
    autopilot.status.not_ready = "Something new"
    _, check, _ = events(peer.advance(2.2))
    assert named([check], described) == ["check_other"]


def test_a_reason_of_one_mode_hinders_that_mode_only(autopilot, peer, described):
    peer.advance(3.0)
    autopilot.status.ready, autopilot.status.intended_mode = False, FlightMode.OFFBOARD
    autopilot.status.not_ready = "Arming denied: no offboard setpoints"
    first, _, _ = events(peer.advance(2.2))
    can_arm = values(first, described)[3]
    offboard, loiter = (bit(described, "navigation_mode_group_t", name) for name in ("offboard", "loiter"))
    assert not can_arm & offboard and can_arm & loiter


def test_a_low_battery_is_a_warning(autopilot, peer, described):
    peer.advance(3.0)
    autopilot.battery.warning = 2
    first, last = events(peer.advance(2.2))
    battery = bit(described, "health_component_t", "battery")
    assert values(first, described)[2] == values(last, described)[3] == battery


def test_reports_come_when_something_changed_or_on_request_only(autopilot, peer):
    peer.advance(5.0)
    assert events(peer.advance(5.0)) == []
    peer.send(peer.long(401, target=(2, 1)))
    assert events(peer.advance(0.1)) == []
    peer.send(peer.long(401))
    assert len(events(peer.advance(0.1))) == 2
    for ready in (False, True, False):  # no flood from a check that flickers
        autopilot.status.ready = ready
        peer.advance(0.2)
    assert len(events(peer.advance(2.0))) == 3


def test_missed_events_are_sent_again(peer):
    peer.advance(0.2)
    again = peer.ask(request(65526, 65527))
    assert [m.sequence for m in again] == [65526, 65527]
    assert peer.ask(request(65527, 65527, target=(2, 1))) == []


def test_a_request_for_dropped_events_is_answered_with_the_oldest_kept(autopilot, peer):
    peer.advance(0.2)
    for _ in range(30):
        autopilot.say(INFO, "Landing detected")
    sent = [m.sequence for m in events(peer.advance(0.1))]
    assert sent[:12] == [*range(65528, 65536), 0, 1, 2, 3]  # it wraps
    refused, *again = peer.ask(request(65526, sent[-1]))
    assert refused.get_type() == "RESPONSE_EVENT_ERROR"
    assert (refused.target_system, refused.target_component) == (245, 191)
    assert (refused.sequence, refused.sequence_oldest_available) == (65526, sent[-20])
    assert [m.sequence for m in again] == sent[-20:]
    (unknown,) = peer.ask(request(5000, 4999))[:1]
    assert unknown.get_type() == "RESPONSE_EVENT_ERROR"


def test_all_events_arrive_over_a_bad_link(autopilot, peer, make_lossy_peer):
    """As libevents: the receiver requests the next event when a later one is received or announced."""
    client, got, latest = make_lossy_peer(peer, seed=3, loss=0.2), [], 65527

    def take(messages):
        nonlocal latest
        for message in messages:
            if message.get_type() == "EVENT" and message.sequence == latest + 1 & 0xFFFF:
                latest = message.sequence
                got.append(message.sequence)
            elif message.get_type() in NUMBERED and 0 < (message.sequence - latest & 0xFFFF) < 0x8000:
                client.send(request(latest + 1 & 0xFFFF, latest + 1 & 0xFFFF))

    for number in range(15):
        autopilot.say(INFO, "Landing detected" if number % 2 else "Takeoff detected")
        take(client.advance(0.3))
    for _ in range(100):
        take(client.advance(0.3))
    assert got == [(65528 + number) & 0xFFFF for number in range(15)]


def test_texts_and_events_say_the_same():
    for text, kind in TEXTS.items():
        assert kind.message.replace("\\", "") == text[:120]
        assert event_of(text) == (kind, ())
