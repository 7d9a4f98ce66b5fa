"""The limits by which a mission flies."""

from __future__ import annotations

from math import hypot

import pytest

from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.limits import CONTEST, CommandLimits
from offboard.mission import load_mission
from scenarios.loader import load_scenario
from vision.types import GateSighting

DASH = """\
class: {mission_class}
description: Up, and forward as fast as allowed
initial: up
states:
  up:
    enter: [hover, cmd.vel_z = 1]
    transitions: [{{when: imu.z > 1.5, to: dash}}]
  dash:
    enter: [hover, cmd.vel_x = 9 * limits.forward_m_s]
    transitions: [{{when: seconds_in_state > 2.5, to: done}}]
  done:
    enter: [motors_off]
    final: true
"""


@pytest.mark.parametrize("mission_class", ["contest", "open"])
def test_a_mission_flies_as_fast_as_its_class_allows_and_its_result_says_so(tmp_path, mission_class):
    path = tmp_path / "dash.yaml"
    path.write_text(DASH.format(mission_class=mission_class), encoding="utf-8")
    plan = FlightPlan(load_scenario("test-case-1"), load_mission(path))
    speeds_m_s = []
    flown = fly_lockstep(
        plan, observers=[lambda moment: speeds_m_s.append(hypot(*moment.state.velocity_arena_m_s[:2]))]
    )
    fastest_m_s = plan.command_limits.forward_m_s
    assert flown.result.mission_class == mission_class
    assert 0.93 * fastest_m_s < max(speeds_m_s) < 1.1 * fastest_m_s
    assert (plan.command_limits == CONTEST) is (mission_class == "contest")


def test_limits_of_a_real_drone_replace_the_airframes_in_the_open_class_only(tmp_path):
    own = CommandLimits(3.0, 2.0, 1.0, 1.0, 2.0)
    for mission_class, limits in (("contest", CONTEST), ("open", own)):
        path = tmp_path / f"{mission_class}.yaml"
        path.write_text(DASH.format(mission_class=mission_class), encoding="utf-8")
        plan = FlightPlan(load_scenario("test-case-1"), load_mission(path), drone_limits=own)
        assert plan.command_limits == limits


def test_a_mission_sees_gates_by_shape_if_it_says_so(tmp_path):
    path = tmp_path / "seeing.yaml"
    path.write_text("vision: frames\nextends: frame_challenge\n", encoding="utf-8")
    scenario = load_scenario("test-case-1").model_copy(update={"try_limit_s": 3.0})
    seen = []
    for mission in (path, "frame_challenge"):
        sightings: list[GateSighting] = []
        plan = FlightPlan(scenario, load_mission(mission))
        fly_lockstep(plan, observers=[lambda moment, to=sightings: to.extend(moment.detections.frames)])
        seen.append(sightings)
    assert "red" in {sighting.colour for sighting in seen[0]} and not seen[1]
    red = next(sighting for sighting in seen[0] if sighting.colour == "red" and sighting.poses)
    distance_m = hypot(*red.poses[0].position_flu_m)
    assert distance_m == pytest.approx(7.9, rel=0.1)  # from the start to the red gate
