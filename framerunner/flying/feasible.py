"""A fast flight that is possible for somebody who knows the layout, to compare with the bound."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, hypot, pi

from framerunner.flying.plan import FlightPlan, airframe_limits
from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import Vec3
from offboard.limits import CONTEST
from offboard.navigation.goals import FlightStyle, Motion, Obstacles, PathGate, Point, Refusal, style_of
from offboard.navigation.path import Path
from offboard.navigation.planning import plan as plan_path
from scenarios.bound import ordered_gates
from scenarios.models import MissionClass, UprightGate

AROUND_S = 0.1
"""What a try takes besides its path: from the motors' start to the first command, and at the end."""
_STOP_ABOVE_M = 0.05  # where the motors stop, above the drone's height on the base

# Chosen so that such paths are flown clean in lockstep in both classes, see docs/bound.md.
_ACCELERATION_M_S2 = 2.0  # in the class `open` more is followed less exactly,
_LEVEL_M_S, _TURN_RAD_S, _COMMAND_SHARE = 1.66, 1.8, 0.98  # likewise; the share is of the limits in plan
_STRAIGHT_M = 0.2  # before and behind an opening: nearer to it, a drone that turns touched bars


@dataclass(frozen=True, slots=True)
class Feasible:
    """A flight that is possible.

    Attributes:
        time_s: of the try.
        points_arena_m: where it leads.
    """

    time_s: float
    points_arena_m: tuple[Vec3, ...]


def feasible(plan: FlightPlan, mission_class: MissionClass) -> Feasible | str:
    """A flight that is possible, or why none was found; takes some milliseconds."""
    path = feasible_path(plan, mission_class)
    if isinstance(path, Refusal):
        return path.reason
    return Feasible(path.duration_s + AROUND_S, path.points_m)


def feasible_path(plan: FlightPlan, mission_class: MissionClass) -> Path | Refusal:
    """The navigator's own plan through all gates and back, with the layout known.

    Returns:
        The path from standing on the base to where the motors stop just above it, or why there is none.
    """
    scenario = plan.layout
    x_m, y_m, z_m, yaw_rad = plan.start_pose
    gates = tuple(map(_path_gate, ordered_gates(scenario)))
    decoys = tuple(map(_path_gate, scenario.decoys))
    ceiling_m = scenario.arena.height_m
    solids = [solid for pole in scenario.poles for solid in pole.solids(ceiling_m)]
    solids += [solid for wall in scenario.walls for solid in wall.solids(ceiling_m)]
    columns = tuple(disc for solid in solids for disc in _discs(solid))
    base = scenario.base
    stop_m = base.top_m + plan.airframe.envelope_m[2] / 2 + _STOP_ABOVE_M
    return plan_path(
        Motion((x_m, y_m, z_m), yaw_rad=yaw_rad),
        [*gates, Point((base.x_m, base.y_m, stop_m))],
        obstacles=Obstacles((*gates, *decoys), columns, base),
        arena=scenario.arena,
        style=_style(plan, mission_class),
    )


def _path_gate(gate: UprightGate) -> PathGate:
    return PathGate(gate.position_arena_m, gate.yaw_rad, gate.shape)


def _style(plan: FlightPlan, mission_class: MissionClass) -> FlightStyle:
    """The navigator's own, changed for somebody who knows where the gates are and need not see them."""
    limits = CONTEST if mission_class == "contest" else airframe_limits(plan.airframe)
    usual = style_of(limits)
    return replace(
        usual,
        axis_speed_m_s=min(usual.axis_speed_m_s, _LEVEL_M_S),
        path_speed_m_s=min(usual.path_speed_m_s, _LEVEL_M_S),
        yaw_rate_rad_s=min(usual.yaw_rate_rad_s, _TURN_RAD_S),
        command_m_s=min(usual.command_m_s, _COMMAND_SHARE * limits.forward_m_s),
        level_command_m_s=min(usual.level_command_m_s, _COMMAND_SHARE * limits.level_m_s),
        acceleration_m_s2=_ACCELERATION_M_S2,
        straight_before_m=_STRAIGHT_M,
        straight_after_m=_STRAIGHT_M,
        look_offset_rad=pi / 4,  # both level axes at their limits
        course_offset_rad=pi,
        view_half_rad=pi,
    )


def _discs(solid: Solid) -> list[Vec3]:
    """A box seen from above as discs along its length that cover it: x, y and radius."""
    length_m, width_m, _ = (2.0 * half_m for half_m in solid.half_extents_m)
    count = max(ceil(length_m / width_m), 1)
    step_m = length_m / count
    radius_m = hypot(step_m, width_m) / 2
    x_m, y_m, _ = solid.centre_arena_m
    c, s = solid.turn
    places = [(index + 0.5) * step_m - length_m / 2 for index in range(count)]
    return [(x_m + c * along_m, y_m + s * along_m, radius_m) for along_m in places]
