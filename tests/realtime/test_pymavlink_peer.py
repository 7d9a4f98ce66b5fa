"""A pymavlink script on the onboard link: it flies the drone, and no packet it sends does harm."""

import random
from math import atan2, cos, hypot, isfinite, nan, pi, remainder, sin
from pathlib import Path

import pytest
from pymavlink import mavutil

mavlink = mavutil.mavlink
pytestmark = pytest.mark.realtime

ARM, SET_MODE, TAKEOFF, LAND = 400, 176, 22, 21
ARMED = 128
SIM_OPTIONS = ("--speed", "3")
OFFBOARD, HOLD = 6 << 16, 4 << 16 | 3 << 24


@pytest.fixture
def airborne(peer):
    """In offboard, armed, climbing done, at about a metre and a half over the ground; it lands afterwards."""
    peer.fly(1.0)
    assert peer.command(SET_MODE, 1, 6) == 0
    assert peer.command(ARM, 1) == 0
    peer.fly_until_heartbeat(lambda beat: beat.base_mode & ARMED and beat.custom_mode == OFFBOARD)
    peer.fly(5.5, down_m_s=-0.6)  # motors idle for a second, the climb grows for three
    peer.fly(1.5)
    assert peer.latest["LOCAL_POSITION_NED"].z < -1.0
    yield peer
    assert peer.command(LAND) == 0
    peer.wait("HEARTBEAT", lambda beat: beat.get_srcComponent() == 1 and not beat.base_mode & ARMED, 20.0)


def mean(messages, kind, field, last):
    values = [getattr(message, field) for message in messages if message.get_type() == kind][-last:]
    assert len(values) == last
    return sum(values) / last


def test_body_velocities_move_the_drone_as_told(airborne):
    peer = airborne
    came = peer.fly(3.0, forward_m_s=0.5)
    yaw = peer.latest["ATTITUDE"].yaw
    north, east = (mean(came, "LOCAL_POSITION_NED", axis, 20) for axis in ("vx", "vy"))
    assert hypot(north, east) == pytest.approx(0.5, abs=0.05)
    assert remainder(atan2(east, north) - yaw, 2 * pi) == pytest.approx(0.0, abs=0.1)

    came = peer.fly(2.5, right_m_s=0.4)
    north, east = (mean(came, "LOCAL_POSITION_NED", axis, 20) for axis in ("vx", "vy"))
    assert -sin(yaw) * north + cos(yaw) * east == pytest.approx(0.4, abs=0.05)

    came = peer.fly(2.0, yaw_rate_rad_s=0.5)
    assert mean(came, "ATTITUDE", "yawspeed", 20) == pytest.approx(0.5, abs=0.05)  # clockwise from above

    came = peer.fly(2.0, down_m_s=-0.5)
    assert mean(came, "LOCAL_POSITION_NED", "vz", 20) == pytest.approx(-0.5, abs=0.05)


def test_setpoints_that_are_not_finite_or_in_another_frame_move_nothing(airborne):
    peer = airborne
    before = peer.latest["LOCAL_POSITION_NED"]
    for bad in ({"forward_m_s": nan}, {"down_m_s": float("inf")}, {"forward_m_s": 3.0, "frame": 7}):
        for _ in range(5):
            peer.velocity(**bad)
            peer.fly(0.1)
    peer.fly(0.5)
    after = peer.latest["LOCAL_POSITION_NED"]
    assert all(isfinite(getattr(after, field)) for field in ("x", "y", "z", "vx", "vy", "vz"))
    assert hypot(after.x - before.x, after.y - before.y, after.z - before.z) < 0.3
    beat = peer.fly_until_heartbeat(lambda beat: beat.get_srcComponent() == 1)
    assert beat.base_mode & ARMED and beat.custom_mode == OFFBOARD


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


@pytest.mark.alone
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
    assert sim.err.count("\n") == 1 or "cannot keep up" in sim.err  # the greeting, and no fault
    peer.latest.pop("AUTOPILOT_VERSION", None)
    assert peer.command(512, 148) == 0  # still a good partner
    assert peer.latest["AUTOPILOT_VERSION"].uid != 0
    assert lost_packets(14580 + instance) < 2000  # nine of ten came through to it at least
