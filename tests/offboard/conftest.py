"""A vehicle on a real UDP socket, for the MAVSDK adapter."""

from __future__ import annotations

import pytest

from tests.free_ports import free_port
from tests.offboard.udp_vehicle import UdpVehicle


@pytest.fixture
def vehicle():
    """A disarmed vehicle that sends to a free port, `vehicle.port`."""
    vehicle = UdpVehicle(free_port())
    vehicle.start()
    yield vehicle
    vehicle.stop()
