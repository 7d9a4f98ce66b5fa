"""Limits velocity commands so that the drone stays in a box, whatever a mission commands.

A vehicle's own fence may do nothing: PX4's needs a global position, which there is none of in a hall. This
one uses the same position as the mission, and no mission can switch it off.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, hypot, sin

from framerunner.errors import UserError
from framerunner.geometry.vectors import Vec3
from offboard.drone import DroneState, VelocityCommand
from scenarios.models import Scenario

FLOOR_M = 0.15  # minimum height of the drone's centre away from its start
START_RADIUS_M = 1.0  # horizontally; there the drone takes off and lands, so there is no floor
REACTION_S = 0.6
"""The distance to a side counts from where the drone will be after this time. A vehicle that follows a
velocity within 0.6 s, as PX4 does with its default gains, over a link that takes 0.4 s, then stops at the
side."""
BRAKE_LEVEL_S = 0.8  # that distance, divided by this, is the speed allowed
BRAKE_HEIGHT_S = 0.5  # likewise for height: frames hang low, so the drone must be allowed near the floor
RETURN_M_S = 0.5  # maximum speed back into the box
STALE_S = 0.5  # a position older than this is not used
OUTSIDE_M = 0.3  # how far outside counts as not kept in
NO_RETURN_S = 3.0  # vehicle time outside without coming nearer after which commanding ends
_NEARER_M = 0.05
MAX_STEP_US = 200_000  # counted between two ticks
STILL = VelocityCommand()


class OutsideBoxError(UserError):
    """The drone is outside and does not come back; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class Box:
    """Where the drone's centre may be, arena axes."""

    low_m: Vec3  # minimum x, y, z
    high_m: Vec3  # maximum x, y, z
    start_m: tuple[float, float]  # x, y of take-off and landing


def flight_box(scenario: Scenario, lift_m: float = 0.0) -> Box:
    """The box of a scenario: its arena and, on all sides but below, the arena's `margin_m`.

    `lift_m` is added to the heights of floor and ceiling, for a drone that starts without a base.
    """
    arena, start = scenario.arena, scenario.start
    x_m, y_m = arena.length_x_m / 2 + arena.margin_m, arena.width_y_m / 2 + arena.margin_m
    ceiling_m = lift_m + arena.height_m + arena.margin_m
    return Box((-x_m, -y_m, lift_m + FLOOR_M), (x_m, y_m, ceiling_m), (start.x_m, start.y_m))


class KeepInBox:
    """Limits commands to one drone, tick by tick. No clock: time is the vehicle's.

    Towards a side, speed is limited by the distance to it, so that the drone stops before it; beyond a side
    it is brought back. A command that does not lead out is not changed, to the last bit.

    Attributes:
        remark: how the last command was changed, for people; empty if it was not.
        limited_us: vehicle time for which commands were changed.
    """

    def __init__(self, box: Box) -> None:
        self.box = box
        self.remark = ""
        self.limited_us = 0
        self._last_us = 0
        self._outside_us = 0
        self._outside_m = 0.0

    def limit(self, command: VelocityCommand, state: DroneState) -> VelocityCommand:
        """The command that may be flown now; call it once a tick, with a finite position.

        Raises:
            OutsideBoxError: the drone has been outside for seconds and does not come nearer.
        """
        step_us, self._last_us = state.time_us - self._last_us, state.time_us
        if state.position_age_s > STALE_S:
            command, self.remark = STILL, f"stopped: the position is {state.position_age_s:.1f} s old"
        else:
            self._check_return(state)
            command, sides = confine(command, state, self.box)
            self.remark = f"kept in the box: {sides}" if sides else ""
        if self.remark:
            self.limited_us += min(step_us, MAX_STEP_US)
        return command

    def _check_return(self, state: DroneState) -> None:
        outside_m = outside(self.box, state)
        if outside_m <= OUTSIDE_M:
            self._outside_m = 0.0
        elif not self._outside_m or outside_m < self._outside_m - _NEARER_M:
            self._outside_m, self._outside_us = outside_m, state.time_us
        elif state.time_us - self._outside_us > NO_RETURN_S * 1e6:
            raise OutsideBoxError(
                f"the drone is {outside_m:.1f} m outside its box and does not come back: "
                f"x {state.x:.1f}, y {state.y:.1f}, z {state.z:.1f} m"
            )


def outside(box: Box, state: DroneState) -> float:
    """How far outside the box the drone is, metres; 0 inside."""
    low, high = _sides(box, state)
    at = (state.x, state.y, state.z)
    return hypot(*(max(a - p, p - b, 0.0) for a, p, b in zip(low, at, high, strict=True)))


def confine(command: VelocityCommand, state: DroneState, box: Box) -> tuple[VelocityCommand, str]:
    """Limit a command by the distances to the box's sides.

    Returns:
        The command to fly, and the sides that limited it, such as "x 6.0 m"; the same object and "" if none.
    """
    c, s = cos(state.yaw), sin(state.yaw)
    wanted = (
        c * command.forward_m_s - s * command.left_m_s,
        s * command.forward_m_s + c * command.left_m_s,
        command.up_m_s,
    )
    low, high = _sides(box, state)
    at, speed = (state.x, state.y, state.z), state.velocity_arena_m_s
    reaction_s = REACTION_S + state.position_age_s
    kept: list[float] = []
    sides: list[str] = []
    for axis, brake_s in enumerate((BRAKE_LEVEL_S, BRAKE_LEVEL_S, BRAKE_HEIGHT_S)):
        ahead_m = speed[axis] * reaction_s
        # Limits of the speed towards each side; beyond a side the limit is negative, which leads back.
        to_high = max(-RETURN_M_S, (high[axis] - at[axis] - max(0.0, ahead_m)) / brake_s)
        to_low = max(-RETURN_M_S, (at[axis] - low[axis] + min(0.0, ahead_m)) / brake_s)
        limited = max(-to_low, min(to_high, wanted[axis]))
        if limited != wanted[axis]:
            side_m = high[axis] if limited < wanted[axis] else low[axis]
            sides.append(f"{'xyz'[axis]} {side_m:.1f} m")
        kept.append(limited)
    if not sides:
        return command, ""
    x, y, up = kept
    return replace(command, forward_m_s=c * x + s * y, left_m_s=c * y - s * x, up_m_s=up), ", ".join(sides)


def _sides(box: Box, state: DroneState) -> tuple[Vec3, Vec3]:
    """Minimum and maximum x, y, z where the drone is: there is no floor near the start."""
    near = hypot(state.x - box.start_m[0], state.y - box.start_m[1]) < START_RADIUS_M
    return ((*box.low_m[:2], -1e9) if near else box.low_m), box.high_m
