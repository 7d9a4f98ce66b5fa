"""What limits the velocity that a drone gets, whatever a mission commands, and what was limited in it.

`VelocityLimits` is the one place: each adapter of the `Drone` port applies it to each command, just before
the command is sent. What plans a motion uses the same `CommandLimits` and `Box` as bounds.

A vehicle's own fence may do nothing: PX4's needs a global position, which there is none of in a hall. The box
uses the same position as the mission, and no mission can switch it off.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import hypot, inf

from framerunner.errors import SettingError
from framerunner.geometry.vectors import Vec3, turned
from offboard.drone import Clip, DroneError, DroneState, LimitedCommand, VelocityFluCommand
from scenarios.models import Scenario

FLOOR_M = 0.15  # minimum height of the drone's centre away from its start
START_RADIUS_M = 1.0  # horizontally; there the drone takes off and lands, so there is no floor
REACTION_S = 0.6
"""The distance to a side counts from where the drone will be after this time. A vehicle that follows a
velocity within 0.6 s, as PX4 does with its default gains, over a link that takes 0.4 s, then stops at the
side."""
BRAKE_LEVEL_S = 0.8  # that distance, divided by this, is the speed allowed
BRAKE_HEIGHT_S = 0.5  # likewise for height: gates hang low, so the drone must be allowed near the floor
RETURN_M_S = 0.5  # maximum speed back into the box
STALE_S = 0.5  # a position older than this is not used
OUTSIDE_M = 0.3  # how far outside counts as not kept in
NO_RETURN_S = 3.0  # vehicle time outside without coming nearer after which commanding ends
_NEARER_M = 0.05
STILL = VelocityFluCommand()
Correction = Callable[[VelocityFluCommand, DroneState], VelocityFluCommand]
logger = logging.getLogger(__name__)


class OutsideBoxError(DroneError):
    """The drone is outside and does not come back; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class CommandLimits:
    """The highest rates of a command, in level axes turned with the yaw; all positive.

    Attributes:
        forward_m_s: forward and backward.
        left_m_s: to the left and to the right.
        up_m_s: climb.
        down_m_s: descent.
        yaw_rate_rad_s: to either side.
        level_m_s: forward and to the side together; infinite if each axis is limited by itself.
    """

    forward_m_s: float = 1.0
    left_m_s: float = 1.0
    up_m_s: float = 1.0
    down_m_s: float = 1.0
    yaw_rate_rad_s: float = 1.0
    level_m_s: float = inf

    def limited(self, command: VelocityFluCommand) -> VelocityFluCommand:
        """The command within the limits; an axis at its limit leaves the others as they are.

        A level velocity that is shortened as a whole keeps its direction; an infinite component becomes its
        limit first.
        """
        forward_m_s = clamped(command.forward_m_s, self.forward_m_s, self.forward_m_s)
        left_m_s = clamped(command.left_m_s, self.left_m_s, self.left_m_s)
        level_m_s, most_m_s = hypot(forward_m_s, left_m_s), self.level_m_s
        if level_m_s > most_m_s:
            if level_m_s == inf:
                forward_m_s = clamped(forward_m_s, most_m_s, most_m_s)
                left_m_s = clamped(left_m_s, most_m_s, most_m_s)
                level_m_s = hypot(forward_m_s, left_m_s)
            scale = most_m_s / level_m_s
            forward_m_s, left_m_s = scale * forward_m_s, scale * left_m_s
        return VelocityFluCommand(
            forward_m_s,
            left_m_s,
            clamped(command.up_m_s, self.down_m_s, self.up_m_s),
            clamped(command.yaw_rate_rad_s, self.yaw_rate_rad_s, self.yaw_rate_rad_s),
        )


CONTEST = CommandLimits()
"""The class `contest`: the paper's limits, +-1 m/s on each axis and +-1 rad/s."""


def clamped(value: float, below: float, above: float) -> float:
    """The nearest value from -below to above."""
    return -below if value < -below else above if value > above else value


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


@dataclass(frozen=True, slots=True)
class Caps:
    """The highest speeds and height of a flight with a drone that may be real; all positive.

    Attributes:
        level_m_s: horizontal speed.
        vertical_m_s: of climb and descent.
        yaw_rate_rad_s: to either side.
        height_m: of the drone's centre above the place of its start; None: the box's ceiling.
    """

    level_m_s: float = 2.0
    vertical_m_s: float = 1.5
    yaw_rate_rad_s: float = 2.0
    height_m: float | None = None

    @property
    def limits(self) -> CommandLimits:
        """The caps on speeds."""
        vertical_m_s = self.vertical_m_s
        return CommandLimits(inf, inf, vertical_m_s, vertical_m_s, self.yaw_rate_rad_s, self.level_m_s)

    def box(self, box: Box, start_z_m: float) -> Box:
        """A box whose ceiling is not above the cap; the height of the start is that of the arena's axes."""
        if self.height_m is None:
            return box
        low, high = box.low_m, box.high_m
        ceiling_m = min(high[2], start_z_m + self.height_m)
        if ceiling_m <= low[2] + FLOOR_M:
            raise SettingError(f"--max-height {self.height_m:g}: leaves no room above the floor; give more")
        return replace(box, high_m=(high[0], high[1], ceiling_m))

    @property
    def words(self) -> str:
        """For people."""
        height = "" if self.height_m is None else f", {self.height_m:g} m above the start"
        return (
            f"{self.level_m_s:g} m/s level, {self.vertical_m_s:g} m/s up and down, "
            f"{self.yaw_rate_rad_s:g} rad/s{height}"
        )


class VelocityLimits:
    """The limits of the commands to one drone, in the order in which they are applied.

    They are the class of the mission, the box, and the caps of a drone that may be real. The box comes before
    the caps, so that the way back into it is capped too; a velocity that is only shortened leads out of
    nothing. No clock: time is the vehicle's.

    Towards a side of the box, speed is limited by the distance to it, so that the drone stops before it;
    beyond a side it is brought back. A command that nothing limits is not changed, to the last bit.

    Args:
        of_class: of the mission's class; None: there are none.
        box: that the drone must not leave, its ceiling not above the cap on height; None: there is none.
        caps: on the speeds; None: there are none.
    """

    def __init__(
        self, of_class: CommandLimits | None = None, box: Box | None = None, caps: Caps | None = None
    ) -> None:
        self.box = box
        self._of_class = of_class
        self._caps = None if caps is None else caps.limits
        self._told: set[str] = set()
        self._outside_us = 0
        self._outside_m = 0.0

    def limit(
        self, command: VelocityFluCommand, state: DroneState | None, correct: Correction | None = None
    ) -> LimitedCommand:
        """The command that may be sent now, and what was changed in it; call it once a tick.

        Args:
            command: wanted.
            state: of the drone now, with a finite position; None before the first, when only the speeds are
                limited.
            correct: what the adapter makes of a command that a mission may fly, for a vehicle that answers
                late. It may exceed the class's limits, but leads out of the box as little as the mission.

        Raises:
            OutsideBoxError: the drone has been outside for seconds and does not come nearer.
        """
        clips: list[Clip] = []
        if self._of_class is not None:  # no clip: a mission may rely on it, as the paper's command infinity
            command = self._of_class.limited(command)
        if state is not None:
            command = self._kept_in(command, state, clips)
            if correct is not None and (corrected := correct(command, state)) is not command:
                command = self._kept_in(corrected, state, clips)
        if self._caps is not None:
            if command.is_number:
                command = _capped(command, self._caps, clips)
            else:
                clips.append(Clip("cap", "numbers", "a command is not a number, so the drone hovers"))
                command = STILL
        for clip in clips:
            self._tell_once(clip, state)
        return LimitedCommand(command, tuple(clips))

    def _kept_in(
        self, command: VelocityFluCommand, state: DroneState, clips: list[Clip]
    ) -> VelocityFluCommand:
        box = self.box
        if box is None:
            return command
        if state.position_age_s > STALE_S:
            clips.append(Clip("box", "place", f"stopped: the position is {state.position_age_s:.1f} s old"))
            return STILL
        self._check_return(box, state)
        kept, sides = confine(command, state, box)
        if sides:
            clips.append(Clip("box", "place", f"kept in the box: {sides}"))
        return kept

    def _check_return(self, box: Box, state: DroneState) -> None:
        outside_m = outside(box, state)
        if outside_m <= OUTSIDE_M:
            self._outside_m = 0.0
        elif not self._outside_m or outside_m < self._outside_m - _NEARER_M:
            self._outside_m, self._outside_us = outside_m, state.time_us
        elif state.time_us - self._outside_us > NO_RETURN_S * 1e6:
            raise OutsideBoxError(
                f"the drone is {outside_m:.1f} m outside its box and does not come back: "
                f"x {state.x:.1f}, y {state.y:.1f}, z {state.z:.1f} m"
            )

    def _tell_once(self, clip: Clip, state: DroneState | None) -> None:
        if clip.quantity in self._told:
            return
        self._told.add(clip.quantity)
        if clip.limit == "box" and state is not None:
            logger.warning("%s (x %.1f, y %.1f, z %.1f m)", clip.words, state.x, state.y, state.z)
        else:
            logger.warning("cap on %s: %s (said once)", clip.quantity, clip.words)


def _capped(command: VelocityFluCommand, limits: CommandLimits, clips: list[Clip]) -> VelocityFluCommand:
    """The command within caps on its speeds."""
    kept = limits.limited(command)
    level_m_s = hypot(kept.forward_m_s, kept.left_m_s)
    wanted_m_s = hypot(command.forward_m_s, command.left_m_s)
    if (kept.forward_m_s, kept.left_m_s) != (command.forward_m_s, command.left_m_s):
        words = f"{wanted_m_s:.2f} m/s level commanded, {level_m_s:g} flown"
        clips.append(Clip("cap", "level speed", words))
    if kept.up_m_s != command.up_m_s:
        words = f"{command.up_m_s:.2f} m/s upwards commanded, {kept.up_m_s:g} flown"
        clips.append(Clip("cap", "vertical speed", words))
    if kept.yaw_rate_rad_s != command.yaw_rate_rad_s:
        words = f"{command.yaw_rate_rad_s:.2f} rad/s commanded, {kept.yaw_rate_rad_s:g} flown"
        clips.append(Clip("cap", "yaw rate", words))
    return kept


def outside(box: Box, state: DroneState) -> float:
    """How far outside the box the drone is, metres; 0 inside."""
    low, high = _sides(box, state)
    at = (state.x, state.y, state.z)
    return hypot(*(max(a - p, p - b, 0.0) for a, p, b in zip(low, at, high, strict=True)))


def confine(command: VelocityFluCommand, state: DroneState, box: Box) -> tuple[VelocityFluCommand, str]:
    """Limit a command by the distances to the box's sides.

    Returns:
        The command to fly, and the sides that limited it, such as "x 6.0 m"; the same object and "" if none.
    """
    wanted = (*turned(command.forward_m_s, command.left_m_s, state.yaw), command.up_m_s)
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
    forward_m_s, left_m_s = turned(kept[0], kept[1], -state.yaw)
    inside = replace(command, forward_m_s=forward_m_s, left_m_s=left_m_s, up_m_s=kept[2])
    return inside, ", ".join(sides)


def _sides(box: Box, state: DroneState) -> tuple[Vec3, Vec3]:
    """Minimum and maximum x, y, z where the drone is: there is no floor near the start."""
    near = hypot(state.x - box.start_m[0], state.y - box.start_m[1]) < START_RADIUS_M
    return ((*box.low_m[:2], -1e9) if near else box.low_m), box.high_m
