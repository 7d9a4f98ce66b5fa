"""Log download as MAVSDK and others do it, over good links and bad ones."""

import random
import time
from itertools import groupby

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from framerunner.wire.dialect import mavlink
from framerunner.wire.link import LinkProfile
from sitl.storage import TemporaryStorage
from tests.firmware_py.mavlink.lossy import LossyPeer

SIZES = (40_000, 90 * 100, 1)


def logs(sizes=SIZES):
    storage = TemporaryStorage()
    for folder in (("log",), ("log", "2026-09-21")):
        storage.make_folder(folder)
    for number, size in enumerate(sizes):
        path = ("log", "2026-09-21", f"12_00_0{number}.ulg")
        storage.create(path)
        storage.write(path, 0, random.Random(number).randbytes(size))
    return storage


@pytest.fixture
def make_link(autopilot, make_peer):
    def make(storage, **profile):
        links = (LinkProfile("onboard", {}, **profile),)
        return make_peer(autopilot, links=links, node_options={"storage": storage})

    return make


def ask_list(start=0, end=0xFFFF, target=(1, 1)):
    return mavlink.MAVLink_log_request_list_message(*target, start, end)


def ask_data(number, offset, count):
    return mavlink.MAVLink_log_request_data_message(1, 1, number, offset, count)


def listed(peer, message):
    peer.send(message)
    return [answer for _, answer in peer.advance(0.1) if answer.get_type() == "LOG_ENTRY"]


def test_the_list_has_numbers_from_0_sizes_and_times(make_link):
    entries = listed(make_link(logs()), ask_list())
    assert [(entry.id, entry.num_logs, entry.size) for entry in entries] == [
        (number, 3, size) for number, size in enumerate(SIZES)
    ]
    assert all(abs(entry.time_utc - time.time()) < 60 for entry in entries)
    assert {entry.last_log_num for entry in entries} == {3}


def test_a_part_of_the_list_and_none_at_all(make_link):
    peer = make_link(logs())
    assert [entry.id for entry in listed(peer, ask_list(1, 1))] == [1]
    assert listed(peer, ask_list(5, 9)) == []
    assert listed(peer, ask_list(target=(2, 1))) == []
    (entry,) = listed(make_link(TemporaryStorage()), ask_list())
    assert (entry.id, entry.num_logs, entry.size) == (0, 0, 0)
    (entry,) = listed(make_link(None), ask_list())
    assert entry.num_logs == 0


def test_data_are_sent_as_requested_and_end_with_the_file(make_link):
    peer = make_link(logs())
    peer.send(ask_data(0, 90, 200))
    data = [message for _, message in peer.advance(0.1)]
    assert [(message.ofs, message.count) for message in data] == [(90, 90), (180, 90), (270, 20)]
    expected = random.Random(0).randbytes(SIZES[0])
    assert bytes(data[0].data) == expected[90:180]
    peer.send(ask_data(2, 0, 0xFFFFFFFF))
    (last,) = [message for _, message in peer.advance(0.1)]
    assert (last.count, bytes(last.data)[:1]) == (1, random.Random(2).randbytes(1))
    for wrong in (ask_data(3, 0, 90), ask_data(0, SIZES[0], 90)):
        peer.send(wrong)
        assert peer.advance(0.1) == []


def test_end_stops_and_a_new_request_replaces_the_old(make_link):
    peer = make_link(logs())
    peer.send(ask_data(0, 0, SIZES[0]))
    peer.advance(0.004)
    peer.send(ask_data(1, 0, 90))
    assert [message.id for _, message in peer.advance(0.1)] == [1]
    peer.send(ask_data(0, 0, SIZES[0]))
    peer.advance(0.004)
    peer.send(mavlink.MAVLink_log_request_end_message(1, 1))
    assert peer.advance(0.1) == []


def test_erase_removes_logs_and_nothing_else(make_link):
    storage = logs()
    storage.create(("mine",))
    peer = make_link(storage)
    peer.send(mavlink.MAVLink_log_erase_message(1, 1))
    assert listed(peer, ask_list())[0].num_logs == 0
    assert [entry.name for entry in storage.entries(())] == ["log", "mine"]
    assert storage.entries(("log",)) == []


def test_a_slow_link_is_not_flooded(make_link):
    peer = make_link(logs(), bytes_s=5000.0)
    peer.send(ask_data(0, 0, SIZES[0]))
    sent = len(peer.advance(3.0)) * 109
    assert 12_000 < sent < 19_000


def download(lossy, number, size):
    """As MAVSDK: in chunks of 512 packets; missing ones are requested again after half a second."""
    content, missing = bytearray(size), set(range(0, size, 90))
    for _ in range(200):
        if not missing:
            return bytes(content)
        for first, last in ranges(sorted(missing)):
            lossy.send(ask_data(number, first, last - first + 90))
            for message in lossy.advance(0.5):
                if message.get_type() == "LOG_DATA" and message.id == number:
                    content[message.ofs : message.ofs + message.count] = bytes(message.data)[: message.count]
                    missing.discard(message.ofs)
    raise TimeoutError(f"{len(missing)} packets missing")


def ranges(offsets):
    grouped = groupby(enumerate(offsets), lambda each: each[1] - 90 * each[0])
    runs = [[offset for _, offset in run] for _, run in grouped]
    return [(run[0], run[-1]) for run in runs]


@pytest.mark.parametrize("seed", range(4))
def test_downloads_complete_on_a_bad_link(make_link, seed):
    lossy = LossyPeer(make_link(logs()), seed=seed)
    entries = {}
    while len(entries) < 3:
        lossy.send(ask_list())
        for message in lossy.advance(0.5):
            entries[message.id] = message.size
    for number, size in entries.items():
        assert download(lossy, number, size) == random.Random(number).randbytes(size)
    assert lossy.down.lost


WORDS = st.sampled_from([0, 1, 2, 3, 0xFFFE, 0xFFFF])
LONG = st.sampled_from([0, 1, 89, 90, 39_999, 40_000, 0xFFFFFFFF])
ASKED = st.one_of(
    st.builds(mavlink.MAVLink_log_request_list_message, st.just(1), st.just(1), WORDS, WORDS),
    st.builds(mavlink.MAVLink_log_request_data_message, st.just(1), st.just(1), WORDS, LONG, LONG),
    st.builds(mavlink.MAVLink_log_request_end_message, st.just(1), st.just(1)),
    st.builds(mavlink.MAVLink_log_erase_message, st.just(1), st.just(1)),
)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(ASKED, max_size=12))
def test_awkward_requests_break_nothing(make_link, asked):
    peer = make_link(logs())
    for message in asked:
        peer.send(message)
        for _, answer in peer.advance(0.008):
            if answer.get_type() == "LOG_DATA":
                assert 0 < answer.count <= 90
                assert answer.ofs + answer.count <= SIZES[answer.id]
    assert peer.node.failed_messages == 0
