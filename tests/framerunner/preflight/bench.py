"""The checks before arming on a link to a simulation in the same process, in simulated time."""

from __future__ import annotations

from firmware_py.mavlink.node import MavlinkNode
from firmware_py.mavlink.telemetry.streams import GROUND, ONBOARD
from sitl.simulation import Simulation
from tests.node_input import deliver
from wire.dialect import mavlink
from wire.framing import PacketReader


class BenchLink:
    """Like `VehicleLink`; the vehicle lives only while it is listened to. `sent` has all messages to it."""

    url = "udpin://bench"

    def __init__(self, scenario, lost=lambda message: False):
        self.simulation = Simulation(scenario)
        self.node = MavlinkNode(self.simulation.autopilot, (ONBOARD, GROUND))
        self.sent = []
        self.lost = lost
        self._codec = mavlink.MAVLink(None, srcSystem=247, srcComponent=190)
        self._reader = PacketReader()

    def receive(self, timeout_s):
        found = []
        for _ in range(max(1, round(timeout_s / 0.004))):
            self.simulation.tick()
            self.node.update(self.simulation.time_us)
            for link, data in self.node.take_output():
                if link == ONBOARD.name:
                    found += self._reader.feed(data)
        return found

    def send(self, message):
        self.sent.append(message)
        if not self.lost(message):
            deliver(self.node, ONBOARD.name, message.pack(self._codec))
            self._codec.seq = (self._codec.seq + 1) % 256

    def close(self):
        pass
