"""Four drones of one process fly offboard together in real time."""

from contextlib import ExitStack, closing

import pytest

from tests.processes import free_instance, simulator
from tests.realtime.conftest import Peer

pytestmark = pytest.mark.realtime

COUNT = 4
OFFBOARD = 6
ACCEPTED = 0


def fly_all(peers, seconds, **velocity):
    """Stream a setpoint to all 20 times a second, for some seconds of the vehicles."""
    end_s = peers[0].vehicle_s + seconds
    while peers[0].vehicle_s < end_s:
        for peer in peers:
            peer.velocity(**velocity)
            peer.read(0.05 / len(peers))


def height_m(peer):
    return -peer.wait("LOCAL_POSITION_NED").z


def test_four_drones_take_off_and_fly_forward_together(tmp_path):
    instance = free_instance(COUNT)
    with simulator(tmp_path, instance, "--count", str(COUNT)) as running, ExitStack() as stack:
        peers = [Peer(14540 + instance + number) for number in range(COUNT)]
        for number, peer in enumerate(peers):
            stack.enter_context(closing(peer.link))
            peer.wait("HEARTBEAT", lambda heartbeat: heartbeat.get_srcComponent() == 1)
            assert peer.link.target_system == instance + number + 1
        for peer in peers:
            peer.wait("SYS_STATUS", lambda status: status.onboard_control_sensors_health & 0x10000000, 20.0)
        fly_all(peers, 0.5)
        for peer in peers:
            peer.velocity()
            assert peer.command(176, 1, OFFBOARD) == ACCEPTED
            peer.velocity()
            assert peer.command(400, 1) == ACCEPTED
            fly_all(peers, 0.1)
        started = [(peer.wait("LOCAL_POSITION_NED").x, height_m(peer)) for peer in peers]
        fly_all(peers, 7.0, down_m_s=-0.8)  # as with PX4, they leave the ground after three seconds
        fly_all(peers, 3.0, forward_m_s=1.0)
        for peer, (x_m, ground_m) in zip(peers, started, strict=True):
            place = peer.wait("LOCAL_POSITION_NED")
            assert -place.z - ground_m == pytest.approx(2.7, abs=0.8)
            assert place.x - x_m == pytest.approx(2.5, abs=0.8)
        assert "touch" not in running.err
