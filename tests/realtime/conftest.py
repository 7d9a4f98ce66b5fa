"""A simulator for each module, and a MAVLink peer on its onboard port."""

from __future__ import annotations

import asyncio
import signal
import time
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from pymavlink import mavutil

from tests.processes import free_instance, simulator

SILENCE_S = 1.0  # COM_OF_LOSS_T, its default


def pytest_collection_modifyitems(items):
    """The tests of a file share a simulator, so one worker runs them, after each other."""
    for item in items:
        if item.path.parent == Path(__file__).parent:
            item.add_marker(pytest.mark.xdist_group(item.path.stem))


@asynccontextmanager
async def mavsdk_system(process, instance):
    """The system that MAVSDK finds on a simulator's onboard port.

    The simulator is halted while the client is destroyed: MAVSDK 4.1's library may end the whole program when
    telemetry comes in at that moment.
    """
    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    try:
        async with Mavsdk(configuration) as mavsdk:
            await mavsdk.add_any_connection(f"udpin://127.0.0.1:{14540 + instance}")
            try:
                yield await mavsdk.first_autopilot(10.0)
            finally:
                process.send_signal(signal.SIGSTOP)
                await asyncio.sleep(0.3)  # what was on its way is over
    finally:
        process.send_signal(signal.SIGCONT)


class Peer:
    """A pymavlink script's connection: reads in order, remembers the latest message of each type.

    Args:
        port: on which the simulator's telemetry arrives.
    """

    def __init__(self, port):
        self.link = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", source_system=245)
        self.latest = {}
        self.vehicle_s = 0.0

    def read(self, seconds):
        """Everything that comes within a time."""
        end_s = time.monotonic() + seconds
        came = []
        while (left_s := end_s - time.monotonic()) > 0:
            message = self.link.recv_match(blocking=True, timeout=min(left_s, 0.1))
            if message is not None:
                self._note(message)
                came.append(message)
        return came

    def _note(self, message):
        self.latest[message.get_type()] = message
        self.vehicle_s = max(self.vehicle_s, getattr(message, "time_boot_ms", 0) / 1000)

    def wait(self, kind, condition=lambda message: True, limit_s=10.0):
        """The next message of a type for which a condition holds."""
        end_s = time.monotonic() + limit_s
        while time.monotonic() < end_s:
            message = self.link.recv_match(blocking=True, timeout=0.1)
            if message is None:
                continue
            self._note(message)
            if message.get_type() == kind and condition(message):
                return message
        raise AssertionError(
            f"no {kind} as wanted within {limit_s:g} s; the latest is {self.latest.get(kind)}"
        )

    def command(self, number, *params):
        """Send a COMMAND_LONG; the result of its acknowledgement."""
        values = (*params, *[0.0] * (7 - len(params)))
        self.link.mav.command_long_send(self.link.target_system, 1, number, 0, *values)
        return self.wait("COMMAND_ACK", lambda ack: ack.command == number, 5.0).result

    def velocity(self, forward_m_s=0.0, right_m_s=0.0, down_m_s=0.0, yaw_rate_rad_s=0.0, *, frame=8):
        """Send one body velocity setpoint, as MAVSDK and PX4's examples do."""
        self.link.mav.set_position_target_local_ned_send(
            *(0, self.link.target_system, 1, frame, 0b010111000111),
            *(0, 0, 0, forward_m_s, right_m_s, down_m_s, 0, 0, 0, 0, yaw_rate_rad_s),
        )

    def fly(self, seconds, **velocity):
        """Stream a setpoint 20 times a second for some seconds of the vehicle; everything that came."""
        return self.listen(seconds, lambda: self.velocity(**velocity))

    def listen(self, seconds, meanwhile=lambda: None):
        """Everything that comes within some seconds of the vehicle, and 20 calls a second of `meanwhile`."""
        came, end_s = [], self.vehicle_s + seconds
        limit_s = time.monotonic() + 20.0 + 3.0 * seconds
        while self.vehicle_s < end_s:
            assert time.monotonic() < limit_s, f"the vehicle's time stands at {self.vehicle_s:g} s"
            meanwhile()
            came += self.read(0.05)
        return came

    def fly_until_heartbeat(self, wanted, limit_s=3.0):
        """Stream a standstill until such a heartbeat comes; in silence offboard is lost after a second."""
        end_s = time.monotonic() + limit_s
        while time.monotonic() < end_s:
            for message in self.fly(0.05):
                if message.get_type() == "HEARTBEAT" and wanted(message):
                    return message
        raise AssertionError(f"no such heartbeat within {limit_s:g} s")


@pytest.fixture(scope="module")
def instance():
    """An instance whose ports nobody has."""
    return free_instance()


@pytest.fixture(scope="module")
def sim(request, tmp_path_factory, instance):
    """A running simulator with the module's `SIM_OPTIONS`; it must not have complained at the end.

    Each test leaves the drone on the ground, disarmed, and nothing that the next would find. At a higher
    speed the drone waits as long for setpoints as one in real time, which a peer on a busy machine needs.
    """
    options = getattr(request.module, "SIM_OPTIONS", ())
    folder = tmp_path_factory.mktemp("sim")
    if "--speed" in options:
        speed = float(options[options.index("--speed") + 1])
        parameters = folder / "silence.params"
        parameters.write_text(f"{instance + 1}\t1\tCOM_OF_LOSS_T\t{speed * SILENCE_S:g}\t9\n")
        options = (*options, "--parameters", str(parameters))
    with simulator(folder, instance, *options) as running:
        yield running
        assert running.process.poll() is None
        assert "Traceback" not in running.err


@pytest.fixture
def peer(sim, instance):
    """A peer that has heard the simulator and knows it to be ready."""
    peer = Peer(14540 + instance)
    peer.wait("HEARTBEAT", lambda heartbeat: heartbeat.get_srcComponent() == 1)
    assert peer.link.target_system == instance + 1
    peer.wait("SYS_STATUS", lambda status: status.onboard_control_sensors_health & 0x10000000, 20.0)
    yield peer
    peer.link.close()
