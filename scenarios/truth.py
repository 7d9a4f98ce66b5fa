"""What the simulated world (or, for a real drone, its telemetry) tells the referee."""

from __future__ import annotations

from dataclasses import dataclass

from geometry.vectors import Quaternion, Vec3


@dataclass(slots=True)
class TrueState:
    """State of the drone at one instant, in arena axes.

    Attributes:
        time_us: simulation (vehicle) time, microseconds.
        position_arena_m: centre of the drone, shape (3,).
        velocity_arena_m_s: its velocity, shape (3,).
        attitude_arena: unit quaternion (w, x, y, z), body FLU to arena.
        motors_on: whether the motors are armed.
        contacts: what the drone touches now: names of frames ("red"), "base" or "floor".
    """

    time_us: int
    position_arena_m: Vec3
    velocity_arena_m_s: Vec3
    attitude_arena: Quaternion
    motors_on: bool
    contacts: tuple[str, ...] = ()
