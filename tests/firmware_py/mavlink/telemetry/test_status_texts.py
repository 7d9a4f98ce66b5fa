import pytest

from firmware_py.types import StatusText
from framerunner.wire.dialect import mavlink


def texts(received, link="ground"):
    return [m for on, m in received if on == link and m.get_type() == "STATUSTEXT"]


def test_texts_are_sent_only_where_a_ground_station_was_heard(autopilot, peer):
    peer.meet_ground_station("ground")
    peer.send(
        mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_ONBOARD_CONTROLLER, 8, 0, 0, 4, 3), "onboard"
    )
    autopilot.say(6, "Ready for takeoff!")
    received = peer.advance(0.01)
    assert [(m.severity, m.text) for m in texts(received)] == [(6, "Ready for takeoff!")]
    assert texts(received, "onboard") == []


def test_a_text_waits_five_seconds_for_a_ground_station(autopilot, peer):
    autopilot.say(6, "old")
    peer.advance(4.0)
    autopilot.say(6, "new")
    peer.advance(3.0)
    peer.meet_ground_station()
    assert [m.text for m in texts(peer.advance(0.01))] == ["new"]


@pytest.mark.parametrize(
    ("length", "pieces"), [(0, 1), (49, 1), (50, 1), (51, 2), (99, 2), (100, 3), (120, 3)]
)
def test_long_texts_go_in_pieces_that_a_receiver_can_join(autopilot, peer, length, pieces):
    peer.meet_ground_station()
    text = "".join(chr(97 + place % 26) for place in range(length))
    autopilot.say(4, text)
    received = texts(peer.advance(0.01))
    assert [m.chunk_seq for m in received] == list(range(pieces))
    assert "".join(m.text for m in received) == text
    assert len({m.id for m in received}) == 1
    assert (received[0].id == 0) == (length <= 50)
    assert length <= 50 or len(received[-1].text) < 50


def test_a_text_with_strange_letters_and_severity_is_sent(autopilot, peer):
    peer.meet_ground_station()
    autopilot.texts.append(StatusText(99, "höhe ✓"))
    (text,) = texts(peer.advance(0.01))
    assert (text.severity, text.text) == (7, "h?he ?")
