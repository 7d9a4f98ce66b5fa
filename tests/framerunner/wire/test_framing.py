import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import Packet, PacketReader

PING = mavlink.MAVLink_ping_message(123456, 7, 1, 1)


def packed(message=PING, *, version_1=False):
    return message.pack(mavlink.MAVLink(None, 245, 191), force_mavlink1=version_1)


@pytest.mark.parametrize("version_1", [False, True])
def test_reads_both_versions(version_1):
    (message,) = PacketReader().feed(packed(version_1=version_1))
    assert (message.get_type(), message.time_usec, message.get_srcSystem()) == ("PING", 123456, 245)


def test_reads_byte_by_byte():
    reader, messages = PacketReader(), []
    for byte in packed() * 2:
        messages += reader.feed(bytes([byte]))
    assert [message.seq for message in messages] == [7, 7]
    assert reader.skipped_bytes == 0


@pytest.mark.parametrize(
    "noise", [b"\xfd", b"\xfd\xff", b"\xfd\xff\x00junk", b"\xfe\xfe\xfe", b"hello \xfd\x01\x01"]
)
def test_noise_before_a_packet_costs_only_itself(noise):
    reader = PacketReader()
    messages = reader.feed(noise) + reader.feed(packed())
    assert len(messages) == 1
    assert reader.skipped_bytes == len(noise)


def test_a_packet_after_a_false_start_is_read_with_the_next():
    reader = PacketReader()
    assert reader.feed(b"\xfd\xff\x00" + packed()) == []  # the false header announces 267 bytes
    assert len(reader.feed(packed())) == 2


def test_a_broken_checksum_is_no_message_and_hurts_none_after_it():
    broken = bytearray(packed())
    broken[-1] ^= 0xFF
    assert len(PacketReader().feed(bytes(broken) + packed())) == 1


def test_a_message_of_unknown_id_is_passed_over_whole():
    unknown = bytearray(packed())
    unknown[7:10] = b"\x11\x22\x33"
    messages = PacketReader().feed(bytes(unknown) + packed())
    assert [message.get_type() for message in messages] == [f"UNKNOWN_{0x332211}", "PING"]


def test_a_message_of_unknown_id_is_not_accepted_amid_noise():
    unknown = bytearray(packed())
    unknown[7:10] = b"\x11\x22\x33"
    messages = PacketReader().feed(b"noise" + bytes(unknown) + packed())
    assert [message.get_type() for message in messages] == ["PING"]


def test_an_unknown_flag_drops_the_packet():
    data = bytearray(packed())
    data[2] = 0x80
    assert PacketReader().feed(bytes(data)) == []


@given(st.lists(st.one_of(st.binary(max_size=300), st.just(packed()))))
def test_whatever_the_pieces_nothing_raises_and_every_byte_is_accounted_for(pieces):
    reader = PacketReader()
    taken = sum(len(message.get_msgbuf()) for piece in pieces for message in reader.feed(piece))
    left = sum(map(len, pieces)) - taken - reader.skipped_bytes
    assert 0 <= left < 300


def test_random_splits_lose_nothing():
    rng = random.Random(5)
    stream = packed() * 50
    reader, count = PacketReader(), 0
    while stream:
        cut = rng.randint(1, 40)
        count += len(reader.feed(stream[:cut]))
        stream = stream[cut:]
    assert count == 50


FALSE_HEADERS = b"\xfd\xff\x00\x00\x00\x01\x01\x54\x00\x00"  # each within the payload of those before it


@pytest.mark.parametrize(
    ("noise", "most"),
    [
        (b"\xfe" * 65536, 0),
        (b"\xfd" * 65536, 0),
        (bytes(65536), 0),
        (random.Random(2).randbytes(65536), 40),
        (packed()[:-1] * 2700, 2700),
    ],
)
def test_noise_costs_few_checksums(noise, most):
    reader = PacketReader()
    assert reader.feed(noise) == []
    assert reader.checksums <= most
    assert reader.skipped_bytes > 65000


@pytest.mark.parametrize("noise", [FALSE_HEADERS, b"\xfe\xfe\x6e", packed()[:-1], packed()])
def test_what_one_step_may_cost_is_bounded(noise):
    reader = PacketReader()
    reader.add(noise * (65536 // len(noise)))
    steps = 0
    while True:
        before = reader.checksums, reader.skipped_bytes
        messages = reader.read(1)
        assert len(messages) <= 1
        assert reader.checksums - before[0] <= 1 + 64 + 64
        assert reader.skipped_bytes - before[1] <= 2048
        if not reader.behind:
            break
        steps += 1
    assert reader.skipped_bytes > 60000 or steps > 2000


@pytest.mark.parametrize("noise", [b"\xfe", b"\xfd", b"\xfd\xff\x00", FALSE_HEADERS, b"\x00", None])
def test_valid_packets_amid_noise_are_all_read(noise):
    rng = random.Random(3)
    stream = b""
    for count in range(200):
        length = rng.randint(0, 5000 if count % 20 == 0 else 40)
        stream += rng.randbytes(length) if noise is None else noise * (length // len(noise))
        stream += packed(version_1=count % 2 == 1)
    stream += bytes(600)  # whatever a false header announces is there
    whole, stepwise = PacketReader(), PacketReader()
    assert sum(message.get_type() == "PING" for message in whole.feed(stream)) == 200
    heard = []
    for first in range(0, len(stream), 1000):
        stepwise.add(stream[first : first + 1000])
        heard += stepwise.read(1)
    while stepwise.behind:
        heard += stepwise.read(1)
    assert sum(message.get_type() == "PING" for message in heard) == 200


def test_bytes_without_room_are_dropped_and_counted():
    reader = PacketReader()
    dropped = [reader.add(data) for data in (packed() * 100, bytes(100_000), bytes(10))]
    assert dropped == [0, 100 * len(packed()) + 100_000 - 65536, 10]
    assert reader.overflows == 2
    assert len(reader.read()) == 100
    assert len(reader.feed(packed())) == 1


def test_a_numbered_packet_is_what_pymavlink_would_pack():
    packet = Packet(PING, 1, 1)
    for sequence in (0, 1, 255, 3):
        packer = mavlink.MAVLink(None, 1, 1)
        packer.seq = sequence
        assert packet.numbered(sequence) == PING.pack(packer)
