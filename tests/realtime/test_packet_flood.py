"""No packet that a peer on the onboard link sends does harm, however many come."""

import random
from pathlib import Path

import pytest
from pymavlink import mavutil

mavlink = mavutil.mavlink
pytestmark = [pytest.mark.realtime, pytest.mark.alone]

ARMED = 128
HOLD = 4 << 16 | 3 << 24


def packet(rng, kinds, count):
    """A packet with a right checksum, of a kind taken in turn, with random content and a random sender."""
    kind = kinds[count % len(kinds)]
    payload = rng.randbytes(kind.unpacker.size)
    number = kind.id
    source = bytes((rng.randrange(2, 255), rng.randrange(256)))
    header = bytes((len(payload), 0, 0, count % 256)) + source + number.to_bytes(3, "little")
    crc = mavlink.x25crc(header + payload + bytes([kind.crc_extra])).crc
    return b"\xfd" + header + payload + crc.to_bytes(2, "little")


def lost_packets(port):
    """Datagrams that the kernel threw away because a port's owner was too slow to take them."""
    lines = Path("/proc/net/udp").read_text(encoding="ascii").splitlines()[1:]
    (line,) = [line for line in lines if int(line.split()[1].partition(":")[2], 16) == port]
    return int(line.split()[-1])


def test_random_bytes_and_twenty_thousand_random_packets_do_no_harm(peer, sim, instance):
    rng = random.Random(540)
    kinds = sorted(mavlink.mavlink_map.values(), key=lambda kind: kind.id)
    before = peer.wait("LOCAL_POSITION_NED")
    heartbeats = 0
    send = peer.link.write
    for count in range(20_000):
        send(packet(rng, kinds, count))
        if count % 20 == 0:
            send(rng.randbytes(rng.randrange(1, 300)))
        if count % 100 == 0:  # about 5000 packets a second; reading keeps the socket from running over
            heartbeats += sum(each.get_type() == "HEARTBEAT" for each in peer.read(0.02))
    assert heartbeats >= 2  # it went on speaking meanwhile

    came = peer.listen(4.5)
    beats = [m for m in came if m.get_type() == "HEARTBEAT" and m.get_srcComponent() == 1]
    assert 3 <= len(beats) <= 6
    assert not any(beat.base_mode & ARMED for beat in beats)
    assert {beat.custom_mode for beat in beats} == {HOLD}
    after = peer.wait("LOCAL_POSITION_NED")
    assert (after.x, after.y, after.z) == pytest.approx((before.x, before.y, before.z), abs=0.01)
    said = sim.err.splitlines()[1:]  # after the greeting: no fault
    known = ("cannot keep up", "too much input", "Ready for takeoff!")
    assert all(any(each in line for each in known) for line in said), said
    peer.latest.pop("AUTOPILOT_VERSION", None)
    assert peer.command(512, 148) == 0  # still a good partner
    assert peer.latest["AUTOPILOT_VERSION"].uid != 0
    assert lost_packets(14580 + instance) < 2000  # nine of ten came through to it at least
