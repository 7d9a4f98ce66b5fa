import pytest

from framerunner.wire.dialect import mavlink
from tests.node_input import deliver


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


def test_a_later_date_is_taken_over(peer):
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
    deliver(peer.node, "onboard", b"noise")
    told = [(on, m) for on, m in peer.advance(2.5) if m.get_type() == "LINK_NODE_STATUS"]
    onboard = [m for on, m in told if on == "onboard"][-1]
    ground = [m for on, m in told if on == "ground"][-1]
    assert (onboard.messages_received, onboard.messages_lost) == (3, 3)
    assert (ground.messages_received, ground.messages_lost) == (0, 0)
    assert onboard.messages_sent > 800
    assert 15_000 < onboard.tx_rate < 35_000
