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
        self._fault.up.send(self._simulation.time_us, velocity)

    def arrived(self) -> SentVelocity | None:
        """The newest velocity that has reached the vehicle since the last call."""
        up: Way[SentVelocity] = self._fault.up
        return up.newest(self._simulation.time_us)

    def receive(self, state: DroneState) -> DroneState | None:
        """What arrives at the app of a state that is sent now; None: nothing."""
        down: Way[DroneState] = self._fault.down
        down.send(self._simulation.time_us, state)
        return down.newest(self._simulation.time_us)

    @property
    def _fault(self) -> LinkFault:
        fault = self._simulation.faults.link
        assert fault is not None, "it is active"
        return fault
