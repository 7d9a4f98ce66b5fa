"""The bad link of the tests loses and swaps as many datagrams as configured, reproducibly."""

from itertools import pairwise

from framerunner.wire.dialect import mavlink
from tests.firmware_py.mavlink.lossy import LossyPipe


def through(pipe, count=10_000):
    arrived = [datagram for number in range(count) for datagram in pipe.push(number)]
    return arrived + pipe.rest()


def test_loses_doubles_and_swaps_its_share():
    pipe = LossyPipe(7)
    arrived = through(pipe)
    assert 400 < pipe.lost < 600
    assert len(set(arrived)) == 10_000 - pipe.lost
    assert len(arrived) == len(set(arrived)) + pipe.doubled
    assert 400 < pipe.doubled < 600
    assert sum(a > b for a, b in pairwise(arrived)) >= pipe.reordered * 0.8


def test_repeats_by_seed():
    assert through(LossyPipe(3)) == through(LossyPipe(3))
    assert through(LossyPipe(3)) != through(LossyPipe(4))


def test_none_of_it_changes_nothing():
    assert through(LossyPipe(1, loss=0, duplicate=0, reorder=0), 100) == list(range(100))


def test_a_peer_misses_some_packets_of_a_stream(peer, make_lossy_peer):
    lossy = make_lossy_peer(peer, loss=0.2)
    attitudes = [m for m in lossy.advance(5.0) if m.get_msgId() == mavlink.MAVLINK_MSG_ID_ATTITUDE]
    assert 350 < len(attitudes) < 480
