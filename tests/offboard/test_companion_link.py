"""The companion on the link of the flying MAVSDK, to a vehicle on a real UDP socket."""

from __future__ import annotations

import asyncio

import pytest

from framerunner.wire.mission_tunnel import MissionState
from offboard.drone import DroneError
from offboard.link.companion import Companion
from offboard.mavsdk_drone import MavsdkDrone
from tests.free_ports import free_port
from tests.offboard.udp_vehicle import UdpVehicle
from tests.processes import wait_until

pytestmark = pytest.mark.realtime


class Vehicle(UdpVehicle):
    """Keeps what a companion sends; its heartbeats may end while its telemetry continues."""

    def __init__(self):
        super().__init__(free_port())
        self.without_heartbeats = False
        self.received = []

    def _tell(self, step):
        super()._tell(step + 1 if self.without_heartbeats and step % 50 == 1 else step)

    def _handle(self, message):
        if message.get_srcComponent() == 191:
            self.received.append(message)
        super()._handle(message)

    def count(self, kind):
        return sum(message.get_type() == kind for message in list(self.received))


@pytest.fixture
async def flying():
    """A vehicle, a drone that has connected to it, and the companion on its link."""
    vehicle, companion = Vehicle(), Companion()
    vehicle.start()
    drone = MavsdkDrone(f"udpin://127.0.0.1:{vehicle.port}")
    drone.use_companion(companion)
    try:
        await drone.connect()
        yield vehicle, drone, companion
    finally:
        await drone.disconnect()
        await companion.close()
        vehicle.stop()


async def until(condition):
    """Wait for a condition, which must be met."""
    assert await asyncio.to_thread(wait_until, condition, 5.0)


async def test_the_vehicle_receives_the_companion_until_the_link_is_closed(flying):
    vehicle, drone, companion = flying
    await drone.ready()
    await until(lambda: vehicle.count("HEARTBEAT") >= 2)
    still = (0.0, 0.0, 0.0, 0.0)
    companion.send_state(MissionState(1, 0, 0, 1, 1, False, False, False, still, still))
    await until(lambda: vehicle.count("TUNNEL") > 0)
    await drone.close()
    companion.send_text("mission: the last text")
    await until(lambda: vehicle.count("STATUSTEXT") == 1)
    assert {message.get_srcSystem() for message in vehicle.received} == {1}
    await drone.disconnect()
    await drone.disconnect()


async def test_the_companion_does_not_hide_that_the_vehicle_s_heartbeats_have_ended(flying):
    vehicle, drone, companion = flying
    await drone.ready()
    await until(lambda: vehicle.count("HEARTBEAT") >= 1)
    still = (0.0, 0.0, 0.0, 0.0)
    vehicle.without_heartbeats = True

    async def fly():
        async for state in drone.ticks():
            companion.send_state(MissionState(1, 0, 0, state.time_us, 0, True, False, False, still, still))
            companion.send_text("mission: still here")

    with pytest.raises(DroneError, match=r"link lost: no heartbeat for 6\.\d s"):
        await asyncio.wait_for(fly(), 12.0)
    assert vehicle.count("STATUSTEXT") > 20
