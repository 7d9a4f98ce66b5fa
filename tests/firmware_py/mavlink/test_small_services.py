import pytest

from firmware_py.types import StatusText
from wire.dialect import mavlink


def texts(received, link="ground"):
    return [m for on, m in received if on == link and m.get_type() == "STATUSTEXT"]


def test_timesync_requests_are_answered_in_nanoseconds(peer):
    peer.advance(0.1)
    (answer,) = peer.ask(mavlink.MAVLink_timesync_message(0, 987654321))
    assert (answer.tc1, answer.ts1) == (100_000_000, 987654321)


def test_timesync_answers_are_not_answered(peer):
    assert peer.ask(mavlink.MAVLink_timesync_message(5, 6)) == []


def test_ping_is_answered_to_its_sender_but_an_answer_is_not(peer):
    (answer,) = peer.ask(mavlink.MAVLink_ping_message(12, 34, 0, 0))
    assert (answer.time_usec, answer.seq) == (12, 34)
    assert (answer.target_system, answer.target_component) == (245, 191)
    assert peer.ask(mavlink.MAVLink_ping_message(12, 34, 1, 1)) == []


def override(*pulses, target=1):
    return mavlink.MAVLink_rc_channels_override_message(target, 1, *pulses, *[0] * (8 - len(pulses)))


def test_channels_of_a_remote_control_are_told_while_they_come(peer):
    peer.send(override(1500, 1600, 1100, 1400, 2000))
    told = [m for on, m in peer.advance(0.4) if on == "ground" and m.get_type() == "RC_CHANNELS"]
    assert len(told) >= 7
    assert (told[0].chancount, told[0].chan2_raw, told[0].chan5_raw, told[0].chan6_raw) == (
        5,
        1600,
        2000,
        65535,
    )
    peer.advance(0.2)
    assert "RC_CHANNELS" not in {m.get_type() for _, m in peer.advance(0.5)}


@pytest.mark.parametrize(
    "message", [override(*[1500] * 8, target=2), override(*[0] * 8), override(*[65535] * 8)]
)
def test_channels_of_others_or_released_are_not_told(peer, message):
    peer.send(message)
    assert "RC_CHANNELS" not in {m.get_type() for _, m in peer.advance(0.5)}


def test_the_date_is_learnt_from_whoever_knows_it_later(peer):
    def date():
        return [m for _, m in peer.advance(1.0) if m.get_type() == "SYSTEM_TIME"][-1]

    peer.send(mavlink.MAVLink_system_time_message(1_000_000, 0))  # 1970 is no date
    assert date().time_unix_usec == 0
    peer.send(mavlink.MAVLink_system_time_message(1_700_000_000_000_000, 0))
    learnt = date()
    assert learnt.time_unix_usec == pytest.approx(1_700_000_000_000_000, abs=2_000_000)
    peer.send(mavlink.MAVLink_system_time_message(1_700_000_030_000_000, 0))  # half a minute is not enough
    assert date().time_unix_usec < 1_700_000_020_000_000


def test_a_link_counts_what_it_carries_and_misses(peer):
    peer.packer.seq = 10
    peer.send(mavlink.MAVLink_ping_message(1, 1, 0, 0))
    peer.packer.seq = 14  # 11 to 13 never came
    peer.send(mavlink.MAVLink_ping_message(1, 2, 0, 0))
    peer.packer.seq = 12  # but one of them late
    peer.send(mavlink.MAVLink_ping_message(1, 3, 0, 0))
    peer.node.receive("onboard", b"noise")
    told = [(on, m) for on, m in peer.advance(2.5) if m.get_type() == "LINK_NODE_STATUS"]
    onboard = [m for on, m in told if on == "onboard"][-1]
    ground = [m for on, m in told if on == "ground"][-1]
    assert (onboard.messages_received, onboard.messages_lost) == (3, 3)
    assert (ground.messages_received, ground.messages_lost) == (0, 0)
    assert onboard.messages_sent > 800
    assert 15_000 < onboard.tx_rate < 35_000


def test_texts_go_only_where_a_ground_station_was_heard(autopilot, peer):
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
