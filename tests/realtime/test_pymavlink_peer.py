"""A pymavlink script on the onboard link flies the drone."""

from math import atan2, cos, hypot, isfinite, nan, pi, remainder, sin

import pytest
from pymavlink import mavutil

mavlink = mavutil.mavlink
pytestmark = pytest.mark.realtime

ARM, SET_MODE, TAKEOFF, LAND = 400, 176, 22, 21
ARMED = 128
SIM_OPTIONS = ("--speed", "3")
OFFBOARD = 6 << 16


@pytest.fixture
def airborne(peer):
    """In offboard, armed, climbing done, at about a metre and a half over the ground; it lands afterwards."""
    peer.fly(1.0)
    assert peer.command(SET_MODE, 1, 6) == 0
    assert peer.command(ARM, 1) == 0
    peer.fly_until_heartbeat(lambda beat: beat.base_mode & ARMED and beat.custom_mode == OFFBOARD)
    peer.fly(7.0, down_m_s=-0.6)  # as with PX4, it leaves the ground after three seconds
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
