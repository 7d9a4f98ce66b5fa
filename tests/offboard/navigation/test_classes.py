"""How boldly a class's limits let the navigator fly."""

from __future__ import annotations

from math import hypot

import pytest

from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard import limits as command_limits
from offboard.limits import CommandLimits
from offboard.mission import load_mission
from offboard.navigation.goals import CONTEST, style_of
from scenarios.random_scenarios import load_level, random_scenario

OPEN = CommandLimits(1.748, 1.748, 1.5, 1.0, 2.0, level_m_s=1.748)


def test_the_contest_is_flown_in_its_style():
    assert style_of(command_limits.CONTEST) == CONTEST


@pytest.mark.parametrize("limits", [OPEN, CommandLimits(4.0, 2.0, 1.0, 0.5, 3.0), CommandLimits(*[0.5] * 5)])
def test_what_is_planned_keeps_below_the_limits(limits):
    style = style_of(limits)
    assert style.axis_speed_m_s < style.command_m_s < min(limits.forward_m_s, limits.left_m_s)
    assert style.path_speed_m_s < limits.level_m_s
    assert style.climb_speed_m_s < style.climb_command_m_s < min(limits.up_m_s, limits.down_m_s)
    assert style.yaw_rate_rad_s < limits.yaw_rate_rad_s
    assert style.crossing_speed_m_s <= style.axis_speed_m_s


def test_racer_is_clean_faster_than_explorer_and_commands_no_more_than_the_drone_can_fly():
    scenario = random_scenario(load_level("calm"), 307)
    plan = FlightPlan(scenario, load_mission("racer"))
    commands = []
    raced = fly_lockstep(plan, observers=[lambda moment: commands.append(moment.command)])
    explored = fly_lockstep(FlightPlan(scenario, load_mission("explorer")))
    assert raced.result.verdict == "clean", raced.result.reason
    assert raced.outcome.flight_time_s < 0.9 * explored.outcome.flight_time_s
    limits = plan.command_limits
    assert max(hypot(each.forward_m_s, each.left_m_s) for each in commands) <= limits.level_m_s + 1e-9
    assert max(each.up_m_s for each in commands) <= limits.up_m_s
    assert min(each.up_m_s for each in commands) >= -limits.down_m_s
    assert max(abs(each.yaw_rate_rad_s) for each in commands) <= limits.yaw_rate_rad_s
