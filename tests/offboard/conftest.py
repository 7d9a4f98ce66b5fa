"""A vehicle on a real UDP socket, for the MAVSDK adapter."""

from __future__ import annotations

import os
import socket

import pytest

from tests.offboard.udp_vehicle import UdpVehicle


def free_port() -> int:
    """A UDP port of this project's test range that nobody has; parallel workers have ranges of their own."""
    first = 25100 + 100 * (int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:]) % 9)
    for port in range(first, first + 100):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("0.0.0.0", port))
            except OSError:
                continue
            return port
    raise RuntimeError(f"no free UDP port in {first}..{first + 99}")


@pytest.fixture
def vehicle():
    """A disarmed vehicle that sends to a free port, `vehicle.port`."""
    vehicle = UdpVehicle(free_port())
    vehicle.start()
    yield vehicle
    vehicle.stop()
