"""The `Drone` port: all that the navigator needs of a vehicle. A mission cannot tell which adapter it has."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Protocol


class DroneError(Exception):
    """The drone cannot do what was asked; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class DroneState:
    """What the drone tells, in arena axes (x forward, y left, z up, yaw counter-clockwise).

    Attributes:
        time_us: vehicle time, microseconds since its boot.
        x: position, metres.
        y: position, metres.
        z: height above the arena's floor, metres.
        yaw: heading, radians, -pi..pi.
        velocity_arena_m_s: shape (3,).
        armed: motors are on.
        offboard: the drone follows this app's setpoints.
        mode: flight mode in words, for people.
        landed: it stands on something.
    """

    time_us: int
    x: float
    y: float
    z: float
    yaw: float
    velocity_arena_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    armed: bool = False
    offboard: bool = False
    mode: str = ""
    landed: bool = True


@dataclass(frozen=True, slots=True)
class VelocityCommand:
    """A velocity in level axes turned with the yaw (forward, left, up; m/s), a yaw rate (rad/s, left)."""

    forward_m_s: float = 0.0
    left_m_s: float = 0.0
    up_m_s: float = 0.0
    yaw_rate_rad_s: float = 0.0


class Drone(Protocol):
    """A vehicle. All coroutines raise `DroneError` with a reason when the vehicle does not comply.

    After `connect` and `ready`, iterate over `ticks()`; it gives the state at 20 Hz of *vehicle* time and
    raises `DroneError` when commanding must stop: link lost, state stale or not finite, the pilot took over
    (left offboard by other hands), disarmed by others.
    """

    async def connect(self) -> None:
        """Find the vehicle; a clear `DroneError` after a time limit."""

    async def ready(self) -> None:
        """Wait until it can be armed; the error says what is still missing."""

    def ticks(self) -> AsyncIterator[DroneState]:
        """States at 20 Hz of vehicle time."""
        ...

    async def motors_on(self) -> None:
        """Arm and hand control to this app; returns when telemetry shows both."""

    async def motors_off(self) -> None:
        """Stop the motors at once, in the air too; returns when telemetry shows it."""

    async def land(self) -> None:
        """Let the vehicle land by itself and wait until it stands disarmed."""

    async def hold(self) -> None:
        """Stop commanding and ask the vehicle to hold where it is."""

    def command(self, command: VelocityCommand) -> None:
        """Set the velocity to fly from now on. Never blocks."""

    async def close(self) -> None:
        """Let go of the vehicle."""
