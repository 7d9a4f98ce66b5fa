"""The `Drone` port: all that the navigator needs of a vehicle. A mission cannot tell which adapter it has."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Protocol

from errors import UserError


class DroneError(UserError):
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
        offboard: the drone follows this app's setpoints. If it does not between `motors_on` and the end of
            commanding, a pilot has taken it.
        mode: flight mode in words, for people.
        landed: it stands on something.
        position_age_s: how much older the position is than `time_us`, seconds.
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
    position_age_s: float = 0.0


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
    raises `DroneError` when commanding must stop: link lost, state stale or not finite, a mode that nobody
    here asked for and that is no pilot's (a failsafe, most likely), disarmed by others.

    A pilot may take the vehicle, by choosing one of his modes, and give it back, by choosing offboard. In
    between the ticks go on, with `offboard` false, whatever the mode and whether armed or not: the vehicle is
    in other hands, and what to make of it is up to whoever flies the mission. The adapter keeps offboard
    possible for as long as the ticks are iterated, by setpoints that stand still, and flies no command. Once
    a tick shows `offboard` again, the vehicle stands still until either `command` takes it back or `refuse`
    lets it hold. An adapter whose vehicle no pilot can take never shows this.
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
        """Stop commanding for good and ask the vehicle to hold where it is, unless other hands have it."""

    async def refuse(self) -> None:
        """Do not take back the vehicle that a pilot gave: let it hold, and wait for another time."""

    def command(self, command: VelocityCommand) -> None:
        """Set the velocity to fly from now on. Never blocks."""

    async def close(self) -> None:
        """Let go of the vehicle."""
