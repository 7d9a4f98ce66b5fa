"""What a plan contains before the flight begins."""

import pickle

import pytest

from framerunner.flying.plan import FlightPlan
from offboard.limits import flight_box
from scenarios.loader import load_scenario
from scenarios.models import Pole

SCENARIO = load_scenario("test-case-1")
PLAN = FlightPlan(SCENARIO)


def test_the_drone_stands_on_its_base_with_its_centre_half_its_height_above():
    x_m, y_m, z_m, yaw_rad = PLAN.start_pose
    assert (x_m, y_m, yaw_rad) == (SCENARIO.start.x_m, SCENARIO.start.y_m, SCENARIO.start.yaw_rad)
    assert z_m == SCENARIO.base.top_m + PLAN.airframe.envelope_m[2] / 2


def test_without_a_base_gates_ceiling_and_box_are_higher_but_the_start_is_not():
    lifted = PLAN.lifted(0.4)
    assert [gate.z_m for gate in lifted.layout.frames] == pytest.approx(
        [f.z_m + 0.4 for f in SCENARIO.frames]
    )
    assert lifted.layout.arena.height_m == pytest.approx(SCENARIO.arena.height_m + 0.4)
    assert lifted.box == flight_box(SCENARIO, 0.4) != PLAN.box
    assert lifted.start_pose == PLAN.start_pose
    assert PLAN.layout is SCENARIO


def test_without_a_base_obstacles_are_as_much_higher():
    crowded = load_scenario("crowded-5")
    low = Pole(x_m=0.0, y_m=4.9, height_m=1.5)
    crowded = crowded.model_copy(update={"poles": (*crowded.poles, low)})
    lifted = FlightPlan(crowded).lifted(0.4).layout
    assert [decoy.z_m for decoy in lifted.decoys] == [decoy.z_m + 0.4 for decoy in crowded.decoys]
    tops_m = [2 * prism.half_extents_m[2] for prism in lifted.prisms]
    assert sorted(tops_m) == pytest.approx([1.9, *[4.4] * 5])


def test_each_try_has_a_referee_of_its_own():
    assert PLAN.new_referee() is not PLAN.new_referee()


def test_it_can_be_pickled():
    sent = pickle.loads(pickle.dumps(PLAN))
    assert (sent, sent.start_pose) == (PLAN, PLAN.start_pose)


def test_a_plan_without_a_mission_has_no_chart():
    with pytest.raises(ValueError, match="no mission"):
        _ = PLAN.chart
