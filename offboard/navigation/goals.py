"""What to fly: gates and points, how boldly, and between which obstacles."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import inf, isfinite
from typing import Any

from framerunner.geometry.gate_shape import PAPER_GATE, GateShape
from framerunner.geometry.vectors import Vec3
from offboard.limits import CommandLimits
from offboard.response.estimate import Response
from scenarios.models import Base

HEADROOM = 0.92
"""Share of a limit that a path uses; the rest is for corrections."""
BOLD_HEADROOM = 0.98
"""Likewise of level speed in class open: where it counts, in openings, the drone flies more slowly."""
VIEW_MARGIN_M = 0.04  # beside a gate that is in view
PRESENT_SHARE = 1.15
"""Of the crossing speed: a drone that is faster at the start of a path brakes to this before an opening."""
LOOK_AGAIN_M = 1.0
UNKNOWN_LATE = 0.3
"""So gently, from 0 to 1, a vehicle is flown at least whose response is not known yet."""
LATE_S = (0.2, 0.7)
"""A vehicle that answers sooner is not flown gently, and one that answers later not more gently."""
LOOK_BRAKING_M = 0.5


@dataclass(frozen=True, slots=True)
class PathGate:
    """A gate on a path's way: a goal to cross, or an obstacle.

    Attributes:
        centre_m: of the opening, arena axes.
        yaw_rad: heading of its normal; it may be crossed from either side.
        shape: its sizes.
    """

    centre_m: Vec3
    yaw_rad: float
    shape: GateShape = PAPER_GATE


@dataclass(frozen=True, slots=True)
class Point:
    """A place to fly to and to stop at.

    Attributes:
        position_m: arena axes.
        yaw_rad: the heading there; None for any.
    """

    position_m: Vec3
    yaw_rad: float | None = None


Goal = PathGate | Point


@dataclass(frozen=True, slots=True)
class Obstacles:
    """All that must not be touched, besides the arena's sides.

    Attributes:
        gates: all gates known, with those to cross.
        columns_m: what reaches from the floor to the ceiling, as discs in plan: x, y, radius.
        base: the cube of take-off and landing.
    """

    gates: tuple[PathGate, ...] = ()
    columns_m: tuple[Vec3, ...] = ()
    base: Base | None = None


@dataclass(frozen=True, slots=True)
class FlightStyle:
    """How boldly to fly: limits of what is planned, below those of what may be commanded.

    Attributes:
        axis_speed_m_s: forward and to the left, in level axes turned with the yaw.
        climb_speed_m_s: up and down.
        path_speed_m_s: in plan, over both axes.
        yaw_rate_rad_s: of turns.
        acceleration_m_s2: along each level axis.
        climb_acceleration_m_s2: up and down.
        command_m_s: commands along a level axis, which are higher than speeds while the drone accelerates.
        level_command_m_s: in plan, over both axes.
        climb_command_m_s: up and down.
        lag_s: by which the velocity in plan follows commands.
        climb_lag_s: likewise up and down.
        crossing_speed_m_s: at most this in an opening.
        crossing_gain_m_s2: the speed rises at most so fast there, beyond what is planned for the legs.
        straight_before_m: straight and level flight before an opening.
        straight_after_m: likewise behind it.
        smoothing_s: time in which the acceleration changes.
        turn_smoothing_s: time in which the yaw rate changes.
        look_offset_rad: the heading may differ from a gate's direction by this, so that both level axes are
            used; less near the gate, which stays in view.
        course_offset_rad: on the way to a gate the heading may differ from the course by this, so that the
            drone sees where it flies.
        view_half_rad: half the camera's view, with a margin for tilt.
        bar_margin_m: between the drone's box and other gates, base and columns.
        side_margin_m: between the drone's centre and the arena's sides and ceiling.
        floor_margin_m: between the drone's centre and the floor.
        replan_s: between two plans.
        look_again_m: before a gate; there the drone waits until it knows the gate well enough.
        look_braking_m: before that; there it is decided.
        arrived_m: a goal is reached this near to it,
        arrived_m_s: and at most this fast.
        looks_ahead: places on the way that no image has shown are looked at before the drone flies there.
    """

    axis_speed_m_s: float = HEADROOM
    climb_speed_m_s: float = HEADROOM
    path_speed_m_s: float = 1.3
    yaw_rate_rad_s: float = 0.9
    acceleration_m_s2: float = 1.3
    climb_acceleration_m_s2: float = 1.3
    command_m_s: float = 0.98
    level_command_m_s: float = inf
    climb_command_m_s: float = 0.98
    lag_s: float = 0.4
    climb_lag_s: float = 0.1
    crossing_speed_m_s: float = 0.8
    crossing_gain_m_s2: float = inf
    straight_before_m: float = 0.35
    straight_after_m: float = 0.3
    smoothing_s: float = 0.2
    turn_smoothing_s: float = 0.2
    look_offset_rad: float = 0.6
    course_offset_rad: float = 0.6
    view_half_rad: float = 0.66
    bar_margin_m: float = 0.08
    side_margin_m: float = 0.25
    floor_margin_m: float = 0.25
    replan_s: float = 0.4
    look_again_m: float = LOOK_AGAIN_M
    look_braking_m: float = LOOK_BRAKING_M
    arrived_m: float = 0.06
    arrived_m_s: float = 0.15
    looks_ahead: bool = True

    def adapted(self, response: Response) -> FlightStyle:
        """The style for a vehicle: gentler, the later it answers."""
        soon_s, late_s = LATE_S
        late = min(max((response.late_s - soon_s) / (late_s - soon_s), 0.0), 1.0)
        late = late if response.known else max(late, UNKNOWN_LATE)
        return replace(
            self,
            lag_s=max(self.lag_s, response.level_lag_s),
            climb_lag_s=max(self.climb_lag_s, response.climb_lag_s),
            path_speed_m_s=self.path_speed_m_s * (1.0 - 0.4 * late),
            axis_speed_m_s=self.axis_speed_m_s * (1.0 - 0.35 * late),
            climb_speed_m_s=self.climb_speed_m_s * (1.0 - 0.4 * late),
            yaw_rate_rad_s=self.yaw_rate_rad_s * (1.0 - 0.4 * late),
            acceleration_m_s2=self.acceleration_m_s2 * (1.0 - 0.6 * late),
            climb_acceleration_m_s2=self.climb_acceleration_m_s2 * (1.0 - 0.6 * late),
            command_m_s=self.command_m_s - 0.25 * late,
            crossing_speed_m_s=self.crossing_speed_m_s * (1.0 - 0.4 * late),
            straight_before_m=self.straight_before_m + 0.25 * late,
            straight_after_m=self.straight_after_m + 0.1 * late,
            smoothing_s=self.smoothing_s + 0.3 * late,
            turn_smoothing_s=self.turn_smoothing_s + 0.6 * late,
            bar_margin_m=self.bar_margin_m + 0.06 * late,
            look_again_m=self.look_again_m + (LOOK_AGAIN_M - self.look_again_m) * late,
            look_braking_m=self.look_braking_m + (LOOK_BRAKING_M - self.look_braking_m) * late,
        )

    def look_limit_rad(self, distance_m: float, shape: GateShape) -> float:
        """By how much the heading may differ from a gate's direction, seen from a distance in plan."""
        half_m = shape.outer_width_m / 2 + VIEW_MARGIN_M
        return min(max(self.view_half_rad - half_m / max(distance_m, 0.01), 0.0), self.look_offset_rad)


CONTEST = FlightStyle()
_OPEN = FlightStyle(
    axis_speed_m_s=1.7,
    path_speed_m_s=1.7,
    yaw_rate_rad_s=1.9,
    acceleration_m_s2=2.5,
    climb_acceleration_m_s2=2.0,
    crossing_speed_m_s=1.3,
    crossing_gain_m_s2=0.3,
    straight_before_m=0.24,
    straight_after_m=0.27,
    smoothing_s=0.3,
    look_offset_rad=0.0,
    replan_s=0.25,
    look_again_m=0.7,
    look_braking_m=0.45,
    arrived_m=0.1,
    arrived_m_s=0.5,
    looks_ahead=False,
)
"""For the simulated drone's own limits: at them nothing would be left to correct with.

Looking at places that no image has shown costs over a second of a flight, and saves one flight in a hundred
from a gate there.
"""
_OPEN_M_S = 1.748  # its level speed
COMMAND_SHARE = 0.98  # of a limit that planned commands use
BOLD_COMMAND_SHARE = 0.995  # likewise in plan in class open
TURN_SHARE = 0.95  # of the limit of the yaw rate


def style_of(limits: CommandLimits) -> FlightStyle:
    """How to fly with a class's limits: as in the contest up to its 1 m/s, from there on bolder.

    A drone that can fly faster than the simulated one is flown as that one.
    """
    axis_m_s = min(limits.forward_m_s, limits.left_m_s, limits.level_m_s)
    climb_m_s = min(limits.up_m_s, limits.down_m_s)
    share = min(max(axis_m_s - 1.0, 0.0) / (_OPEN_M_S - 1.0), 1.0)

    def between(contest: float, bolder: float) -> float:
        return contest + share * (bolder - contest)

    values = {each.name: getattr(CONTEST, each.name) for each in fields(FlightStyle)}
    finite = {name: value for name, value in values.items() if isfinite(value)}
    mixed: dict[str, Any] = {name: between(value, getattr(_OPEN, name)) for name, value in finite.items()}
    style = replace(CONTEST, **mixed)
    command_share = between(COMMAND_SHARE, BOLD_COMMAND_SHARE)
    headroom = between(HEADROOM, BOLD_HEADROOM)
    return replace(
        style,
        axis_speed_m_s=min(style.axis_speed_m_s, headroom * axis_m_s),
        climb_speed_m_s=min(style.climb_speed_m_s, HEADROOM * climb_m_s),
        path_speed_m_s=min(style.path_speed_m_s, headroom * limits.level_m_s),
        yaw_rate_rad_s=min(style.yaw_rate_rad_s, TURN_SHARE * limits.yaw_rate_rad_s),
        command_m_s=command_share * axis_m_s,
        level_command_m_s=command_share * limits.level_m_s,
        climb_command_m_s=COMMAND_SHARE * climb_m_s,
        crossing_speed_m_s=min(style.crossing_speed_m_s, HEADROOM * axis_m_s),
        crossing_gain_m_s2=_OPEN.crossing_gain_m_s2 if share > 0.0 else CONTEST.crossing_gain_m_s2,
        looks_ahead=share < 1.0,
    )


@dataclass(frozen=True, slots=True)
class Motion:
    """A motion at an instant, arena axes."""

    position_m: Vec3
    velocity_m_s: Vec3 = (0.0, 0.0, 0.0)
    yaw_rad: float = 0.0
    yaw_rate_rad_s: float = 0.0
    acceleration_m_s2: Vec3 = (0.0, 0.0, 0.0)
    yaw_acceleration_rad_s2: float = 0.0

    def paced(self, rate: float, change_per_s: float) -> Motion:
        """The same motion if time goes at another rate, which changes."""
        if rate == 1.0 and change_per_s == 0.0:
            return self
        (vx, vy, vz), (ax, ay, az) = self.velocity_m_s, self.acceleration_m_s2
        square, turn = rate * rate, self.yaw_rate_rad_s
        return Motion(
            self.position_m,
            (rate * vx, rate * vy, rate * vz),
            self.yaw_rad,
            rate * turn,
            (
                square * ax + change_per_s * vx,
                square * ay + change_per_s * vy,
                square * az + change_per_s * vz,
            ),
            square * self.yaw_acceleration_rad_s2 + change_per_s * turn,
        )


@dataclass(frozen=True, slots=True)
class Refusal:
    """No path was found."""

    reason: str  # one line for people
    goal: int = 0  # index of the goal to which there is no way
