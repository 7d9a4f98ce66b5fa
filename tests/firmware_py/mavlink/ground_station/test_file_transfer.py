"""MAVLink FTP: PX4's answers, no way out, and transfers over bad links."""

import random
from zlib import crc32

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from framerunner.wire.dialect import mavlink
from sitl.storage import StorageLimits, TemporaryStorage
from tests.firmware_py.mavlink.ground_station import ftp_client as ftp
from tests.firmware_py.mavlink.ground_station.ftp_client import FtpClient, RefusedError, Reply, request
from tests.firmware_py.mavlink.lossy import LossyPeer
from tests.node_input import deliver

FIRMWARE = {"etc/extras/general.json.xz": b"general", "etc/extras/parameters.json.xz": b"p" * 5000}
PERFECT = {"loss": 0.0, "duplicate": 0.0, "reorder": 0.0}


@pytest.fixture
def storage():
    return TemporaryStorage(StorageLimits(files=300, file_bytes=1 << 20, total_bytes=2 << 20))


@pytest.fixture
def peer(autopilot, make_peer, storage):
    return make_peer(autopilot, links=(), node_options={"storage": storage, "firmware_files": FIRMWARE})


@pytest.fixture
def quiet_link(peer):
    """A link without streams: only answers."""
    from framerunner.wire.link import LinkProfile

    for name in ("onboard", "ground"):
        peer.node.add_link(LinkProfile(name, {}))
        peer._readers[name] = type(LossyPeer(peer)._reader)()
    return peer


@pytest.fixture
def client(quiet_link):
    return FtpClient(LossyPeer(quiet_link, **PERFECT))


def code_of(call, *args, **options):
    with pytest.raises(RefusedError) as refused:
        call(*args, **options)
    return refused.value.code


def content(seed, size):
    return random.Random(seed).randbytes(size)


def test_write_read_burst_crc_and_list(client):
    data = content(1, 80_000)
    client.ask(ftp.MAKE_FOLDER, b"/mine\0")
    client.write("/mine/a.bin", data)
    assert client.read("/mine/a.bin") == data
    assert client.burst("mine/a.bin") == data
    assert client.crc("/mine/a.bin") == crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF
    assert client.list("/mine") == [f"Fa.bin\t{len(data)}"]
    assert client.list("/") == ["Detc", "Dmine"]
    assert client.list("/fs/microsd") == ["Detc", "Dmine"]  # where PX4's boards have it
    assert client.retries == 0


def test_a_long_listing_has_pages(client, storage):
    storage.make_folder(("many",))
    for number in range(200):
        storage.create(("many", f"file-{number:03}.txt"))
    assert client.list("/many") == [f"Ffile-{number:03}.txt\t0" for number in range(200)]
    storage.make_folder(("empty",))
    assert client.list("/empty") == []


def test_the_firmwares_files_can_be_read_and_not_changed(client):
    assert client.list("/etc/extras") == ["Fgeneral.json.xz\t7", "Fparameters.json.xz\t5000"]
    assert client.burst("etc/extras/parameters.json.xz") == b"p" * 5000
    for opcode in (ftp.CREATE, ftp.OPEN_WRITE, ftp.REMOVE, ftp.TRUNCATE):
        assert code_of(client.ask, opcode, b"/etc/extras/general.json.xz\0") == ftp.PROTECTED
    for opcode in (ftp.MAKE_FOLDER, ftp.REMOVE_FOLDER, ftp.CREATE):
        assert code_of(client.ask, opcode, b"/etc/new\0") == ftp.PROTECTED
    assert code_of(client.ask, ftp.RENAME, b"/etc/extras/general.json.xz\0/mine\0") == ftp.PROTECTED
    assert client.read("/etc/extras/general.json.xz") == b"general"


def test_px4s_errors(client, storage):
    client.write("/a", b"abc")
    storage.make_folder(("folder",))
    storage.create(("folder", "b"))
    assert code_of(client.ask, ftp.OPEN, b"/nothing\0") == ftp.NOT_FOUND
    assert code_of(client.ask, ftp.OPEN, b"@PARAM/param.pck\0") == ftp.NOT_FOUND  # MAVProxy asks first
    assert code_of(client.ask, ftp.LIST, b"/nothing\0") == ftp.NOT_FOUND
    assert code_of(client.ask, ftp.REMOVE, b"/nothing\0") == ftp.NOT_FOUND
    assert code_of(client.ask, ftp.CRC, b"/nothing\0") == ftp.NOT_FOUND
    assert code_of(client.ask, ftp.MAKE_FOLDER, b"/folder\0") == ftp.EXISTS
    assert code_of(client.ask, ftp.REMOVE_FOLDER, b"/folder\0") == ftp.FAIL_ERRNO
    assert code_of(client.ask, ftp.RENAME, b"/a\0") == ftp.FAIL_ERRNO
    assert code_of(client.ask, ftp.READ, size=10) == ftp.INVALID_SESSION
    assert code_of(client.ask, ftp.WRITE, b"x") == ftp.INVALID_SESSION
    assert code_of(client.ask, ftp.TERMINATE) == ftp.INVALID_SESSION
    assert code_of(client.ask, 77) == ftp.UNKNOWN
    assert code_of(client.ask, ftp.LIST, b"/", size=240) == ftp.INVALID_SIZE
    client.ask(ftp.OPEN, b"/a\0")
    assert code_of(client.ask, ftp.READ, offset=3, size=10) == ftp.EOF
    assert code_of(client.ask, ftp.WRITE, b"x") == ftp.FAIL_ERRNO  # opened for reading
    assert code_of(client.ask, ftp.OPEN, b"/folder/b\0") == ftp.NO_SESSIONS  # this number is in use
    assert client.ask(ftp.RESET).data == b""
    assert code_of(client.ask, ftp.TERMINATE) == ftp.INVALID_SESSION


def test_rename_truncate_open_for_writing_and_remove(client):
    client.write("/a", b"0123456789")
    client.ask(ftp.RENAME, b"/a\0/b\0")
    client.ask(ftp.TRUNCATE, b"/b\0", offset=4)
    assert client.read("/b") == b"0123"
    assert client.ask(ftp.OPEN_WRITE, b"/b\0").data == (4).to_bytes(4, "little")
    assert client.ask(ftp.WRITE, b"XY", offset=3).data == (2).to_bytes(4, "little")
    client.ask(ftp.TERMINATE)
    assert client.read("/b") == b"012XY"
    client.ask(ftp.REMOVE, b"/b\0")
    assert client.list("/") == ["Detc"]


def test_a_repeated_request_gets_the_same_answer_and_changes_nothing(quiet_link, storage):
    storage.create(("a",))
    remove = request(9, ftp.REMOVE, b"/a\0")
    first, second = (Reply(quiet_link.ask(remove)[0].payload) for _ in range(2))
    assert (first.opcode, first.sequence) == (second.opcode, second.sequence) == (ftp.ACK, 10)
    third = Reply(quiet_link.ask(request(10, ftp.REMOVE, b"/a\0"))[0].payload)
    assert (third.opcode, third.data[0]) == (ftp.NAK, ftp.NOT_FOUND)


def test_a_late_copy_of_an_opening_does_not_empty_the_file(quiet_link, storage):
    create = request(0, ftp.CREATE, b"/a\0")
    quiet_link.ask(create)
    quiet_link.ask(request(1, ftp.WRITE, b"kept"))
    assert Reply(quiet_link.ask(create)[0].payload).opcode == ftp.ACK
    assert storage.read(("a",), 0, 10) == b"kept"


def test_a_late_copy_of_a_closing_does_not_close_the_next_file(quiet_link, storage):
    for name in "ab":
        storage.create((name,))
        storage.write((name,), 0, name.encode())
    for opening in (b"/a\0", b"/b\0"):
        quiet_link.ask(request(0, ftp.OPEN, opening))
        close = request(2, ftp.TERMINATE)
        quiet_link.ask(close)
    quiet_link.ask(request(0, ftp.OPEN, b"/b\0"))
    assert Reply(quiet_link.ask(close)[0].payload).opcode == ftp.ACK
    assert Reply(quiet_link.ask(request(1, ftp.READ, size=1))[0].payload).data == b"b"
    assert Reply(quiet_link.ask(request(9, ftp.OPEN, b"/a\0"))[0].payload).opcode == ftp.ACK
    assert Reply(quiet_link.ask(request(10, ftp.READ, size=1))[0].payload).data == b"a"


def test_clients_have_sessions_of_their_own(quiet_link, storage):
    for name, data in (("a", b"first"), ("b", b"second")):
        storage.create((name,))
        storage.write((name,), 0, data)
    other = mavlink.MAVLink(None, 255, 190)
    quiet_link.ask(request(0, ftp.OPEN, b"/a\0"))
    deliver(quiet_link.node, "onboard", request(0, ftp.OPEN, b"/b\0").pack(other))
    quiet_link.take()
    (answer,) = quiet_link.ask(request(1, ftp.READ, size=239))
    assert Reply(answer.payload).data == b"first"
    deliver(quiet_link.node, "onboard", request(1, ftp.READ, size=239).pack(other))
    ((_, answer),) = quiet_link.take()
    assert Reply(answer.payload).data == b"second"


def test_a_session_left_open_is_closed_and_the_number_used_again(client):
    client.write("/a", b"abc")
    client.ask(ftp.OPEN, b"/a\0")
    client.lossy.advance(1.5)
    assert client.read("/a") == b"abc"  # taken over, as MAVSDK knows no other number
    client.ask(ftp.OPEN, b"/a\0")
    client.lossy.advance(12.0)
    assert code_of(client.ask, ftp.READ, size=3) == ftp.INVALID_SESSION


def test_a_burst_pauses_after_35_kb_and_reports_the_end(quiet_link, storage):
    storage.create(("a",))
    storage.write(("a",), 0, bytes(40_000))
    quiet_link.ask(request(0, ftp.OPEN, b"/a\0"))
    quiet_link.ask(request(1, ftp.BURST, offset=0, size=239))
    replies = [Reply(message.payload) for _, message in quiet_link.advance(1.0)]
    assert [reply.sequence for reply in replies] == list(range(2, 2 + len(replies)))
    assert sum(len(reply.data) for reply in replies) == 147 * 239
    assert [reply.complete for reply in replies] == [0] * 146 + [1]
    quiet_link.ask(request(200, ftp.BURST, offset=147 * 239, size=239))
    replies = [Reply(message.payload) for _, message in quiet_link.advance(1.0)]
    assert sum(len(reply.data) for reply in replies[:-1]) == 40_000 - 147 * 239
    assert (replies[-1].opcode, replies[-1].data[0]) == (ftp.NAK, ftp.EOF)


def test_a_burst_leaves_a_slow_link_air(autopilot, make_peer, storage):
    from framerunner.wire.link import LinkProfile

    storage.create(("a",))
    storage.write(("a",), 0, content(2, 40_000))
    slow = LinkProfile("onboard", {}, bytes_s=5000.0)
    peer = make_peer(autopilot, links=(slow,), node_options={"storage": storage})
    peer.ask(request(0, ftp.OPEN, b"/a\0"))
    peer.ask(request(1, ftp.BURST, offset=0, size=239))
    sent = len(peer.advance(4.0)) * 263
    assert 18_000 < sent < 25_000


def test_the_checksum_of_a_large_file_is_worked_out_piece_by_piece(autopilot, make_peer):
    storage = TemporaryStorage()
    storage.create(("a",))
    data = content(3, 5 << 20)
    storage.write(("a",), 0, data)
    peer = make_peer(autopilot, node_options={"storage": storage})
    assert peer.ask(request(0, ftp.CRC, b"/a\0")) == []
    replies = [m for _, m in peer.advance(0.1) if m.get_type() == "FILE_TRANSFER_PROTOCOL"]
    assert Reply(replies[0].payload).data == (crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF).to_bytes(4, "little")


def test_answers_and_what_is_meant_for_others_are_left_alone(quiet_link):
    assert quiet_link.ask(request(0, ftp.ACK)) == []
    assert quiet_link.ask(request(0, ftp.NAK)) == []
    assert quiet_link.ask(request(0, ftp.LIST, b"/\0", target=(2, 1))) == []
    assert quiet_link.ask(request(0, ftp.LIST, b"/\0", target=(1, 100))) == []
    (answer,) = quiet_link.ask(request(0, ftp.LIST, b"/\0", target=(0, 0)))
    assert (answer.target_system, answer.target_component) == (245, 191)


def test_quotas(client):
    client.ask(ftp.CREATE, b"/a\0")
    assert code_of(client.ask, ftp.WRITE, b"x", offset=0xFFFFFFFF) == ftp.FAIL_ERRNO
    assert code_of(client.ask, ftp.TRUNCATE, b"/a\0", offset=(1 << 20) + 1) == ftp.FAIL_ERRNO
    client.ask(ftp.TRUNCATE, b"/a\0", offset=1 << 20)
    client.ask(ftp.RESET)
    client.write("/b", b"")
    client.ask(ftp.TRUNCATE, b"/b\0", offset=1 << 20)
    client.write("/c", b"")
    assert code_of(client.ask, ftp.TRUNCATE, b"/c\0", offset=1) == ftp.FAIL_ERRNO
    for number in range(297):
        client.ask(ftp.MAKE_FOLDER, f"/{number}".encode())
    assert code_of(client.ask, ftp.MAKE_FOLDER, b"/more") == ftp.FAIL_ERRNO


@pytest.mark.parametrize("seed", range(12))
def test_all_transfers_complete_on_a_bad_link(quiet_link, seed):
    lossy = LossyPeer(quiet_link, seed=seed)
    client = FtpClient(lossy)
    data = content(seed, 20_000)
    client.write("/a", data)
    assert client.burst("/a") == data
    assert client.read("/a") == data
    assert client.crc("/a") == crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF
    assert client.list("/") == ["Fa\t20000", "Detc"]
    assert lossy.up.lost and lossy.down.lost and lossy.down.doubled and lossy.down.reordered
    assert quiet_link.node.failed_messages == 0


PATHS = st.one_of(
    st.sampled_from(
        [
            b"/",
            b"/a",
            b"/folder/b",
            b"../x",
            b"/folder/../../x",
            b"/etc/extras",
            b"//",
            b"/\xff",
            b"/fs/microsd/..",
            b"",
        ]
    ),
    st.text(alphabet="./a\\\u00e9\n\tetc", max_size=60).map(lambda text: text.encode()[:230]),
    st.binary(max_size=239),
)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.tuples(
            st.integers(0, 20),
            PATHS,
            st.sampled_from([0, 1, 250, 0xFFFFFFFF]),
            st.integers(0, 5),
            st.sampled_from([None, 0, 239, 240, 255]),
        ),
        min_size=1,
        max_size=25,
    )
)
def test_awkward_requests_break_nothing_and_keep_limits(autopilot, make_peer, requests):
    limits = StorageLimits(files=20, file_bytes=2000, total_bytes=5000)
    storage = TemporaryStorage(limits)
    peer = make_peer(autopilot, node_options={"storage": storage, "firmware_files": FIRMWARE})
    for sequence, (opcode, data, offset, session, size) in enumerate(requests):
        peer.send(request(sequence, opcode, data, session=session, offset=offset, size=size))
        peer.advance(0.004)
    assert peer.node.failed_messages == 0
    count, total = walk(storage, ())
    assert count <= limits.files and total <= limits.total_bytes


def walk(storage, path):
    count = total = 0
    for entry in storage.entries(path):
        count, total = count + 1, total + entry.size
        if entry.is_folder:
            more = walk(storage, (*path, entry.name))
            count, total = count + more[0], total + more[1]
    return count, total


def test_many_clients_take_no_more_memory_than_few(quiet_link, storage):
    storage.create(("a",))
    for number in range(400):
        packer = mavlink.MAVLink(None, 2 + number % 250, number % 256)
        for session in range(12):
            deliver(
                quiet_link.node, "onboard", request(session, ftp.OPEN, b"/a", session=session).pack(packer)
            )
        deliver(quiet_link.node, "onboard", request(9, ftp.CRC, b"/a").pack(packer))
        quiet_link.take()
    service = next(s for s in quiet_link.node.services if type(s).__name__ == "FileTransferService")
    assert len(service._clients._clients) <= 16
    assert all(len(client.sessions) <= 4 for client in service._clients._clients.values())
