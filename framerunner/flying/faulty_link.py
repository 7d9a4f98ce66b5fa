"""The link between app and vehicle of a lockstep flight, while it has a fault."""

from __future__ import annotations

from framerunner.geometry.vectors import Vec3
from offboard.drone import DroneState
from sitl.faults.link import LinkFault, Way
from sitl.simulation import Simulation

SentVelocity = tuple[Vec3, float]
"""Forward, right, down (m/s) and the yaw rate, clockwise (rad/s)."""


class FaultyLink:
    """Velocities up and states down the link; to be used while it is active.

    Args:
        simulation: whose link may fail.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._fault: LinkFault | None = None
        self._up: Way[SentVelocity] | None = None
        self._down: Way[DroneState] | None = None

    @property
    def active(self) -> bool:
        """Whether the link has a fault now."""
        return self._simulation.faults.link is not None

    def loses(self) -> bool:
        """Whether the next packet is lost."""
        fault = self._simulation.faults.link
        return fault is not None and fault.loses()

    def send(self, velocity: SentVelocity) -> None:
        """Send a velocity to the vehicle."""
        up, _ = self._ways()
        up.send(self._simulation.time_us, velocity)

    def arrived(self) -> SentVelocity | None:
        """The newest velocity that has reached the vehicle since the last call."""
        up, _ = self._ways()
        return up.newest(self._simulation.time_us)

    def receive(self, state: DroneState) -> DroneState | None:
        """What arrives at the app of a state that is sent now; None: nothing."""
        _, down = self._ways()
        down.send(self._simulation.time_us, state)
        return down.newest(self._simulation.time_us)

    def _ways(self) -> tuple[Way[SentVelocity], Way[DroneState]]:
        """Both directions of the active fault."""
        fault = self._simulation.faults.link
        if fault is None:
            raise RuntimeError("the link has no fault")
        if self._up is None or self._down is None or fault is not self._fault:
            self._fault, self._up, self._down = fault, fault.new_way(), fault.new_way()
        return self._up, self._down
