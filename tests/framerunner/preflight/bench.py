"""The checks before arming on a link to a simulation in the same process, in simulated time."""

from __future__ import annotations

from random import Random

from firmware_py.mavlink.node import MavlinkNode
from firmware_py.mavlink.telemetry.profiles import GROUND, ONBOARD
from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader
from sitl.simulation import Simulation
from tests.node_input import deliver


class BenchLink:
    """Like `VehicleLink`; the vehicle lives only while it is listened to. `sent` has all messages to it."""

    url = "udpin://bench"

    def __init__(self, scenario, lost=lambda message: False, simulation=None):
        self.simulation = simulation or Simulation(scenario)
        self.node = MavlinkNode(self.simulation.autopilot, (ONBOARD, GROUND))
        self.sent = []
        self.lost = lost
        self._codec = mavlink.MAVLink(None, srcSystem=247, srcComponent=190)
        self._reader = PacketReader()
        self._others = []
        self._loss, self._random = 0.0, Random(1)

    def add_vehicle(self, scenario, later_s):
        """Another vehicle with the same id, whose clock is behind."""
        other = Simulation(scenario)
        self._others.append((other, MavlinkNode(other.autopilot, (ONBOARD, GROUND))))
        for _ in range(round(later_s / 0.004)):
            self.simulation.tick()
            self.node.update(self.simulation.time_us)
            self.node.take_output()

    def lose(self, share):
        """Lose a share of what the vehicle sends."""
        self._loss = share

    def receive(self, timeout_s):
        found = []
        for _ in range(max(1, round(timeout_s / 0.004))):
            for simulation, node in ((self.simulation, self.node), *self._others):
                simulation.tick()
                node.update(simulation.time_us)
                for link, data in node.take_output():
                    if link == ONBOARD.name and self._random.random() >= self._loss:
                        found += self._reader.feed(data)
        return found

    def send(self, message):
        self.sent.append(message)
        if not self.lost(message):
            for node in (self.node, *(other for _, other in self._others)):
                deliver(node, ONBOARD.name, message.pack(self._codec))
            self._codec.seq = (self._codec.seq + 1) % 256

    send_to_all = send

    def addresses(self, system_id, component_id):
        return ()

    def close(self):
        pass
