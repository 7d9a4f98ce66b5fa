from pathlib import Path

import pytest

from framerunner.flying.plan import FlightPlan
from offboard.safety.check import Outcome
from offboard.safety.failsafes import failsafe_checks, failsafe_rows, values_to_set, with_table
from offboard.safety.fence import FlightFence, flight_fence
from scenarios.loader import load_scenario

ROOT = Path(__file__).parents[3]
FENCE = FlightFence(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)), 3.5, 9.0)
GOOD = {row.name: row.wanted(FENCE) for row in failsafe_rows()}


def outcome_of(name, value, *, has_global_position=True):
    checks = failsafe_checks(GOOD | {name: value}, FENCE, has_global_position=has_global_position)
    return next(check.outcome for check in checks if check.name == name)


def test_the_documents_table_is_written_from_the_data():
    text = (ROOT / "docs" / "real-drone.md").read_text(encoding="utf-8")
    assert with_table(text) == text, "run: make failsafes"


def test_what_is_set_passes():
    checks = failsafe_checks(GOOD, FENCE, has_global_position=True)
    assert {check.outcome for check in checks} == {Outcome.PASS}
    assert values_to_set(GOOD, FENCE, has_global_position=True) == {}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("COM_OF_LOSS_T", 0.3), ("COM_OF_LOSS_T", 5), ("COM_OBL_RC_ACT", 0), ("COM_OBL_RC_ACT", 5)),
        *(("NAV_DLL_ACT", 2), ("NAV_RCL_ACT", 2), ("COM_LOW_BAT_ACT", 3), ("RTL_RETURN_ALT", 30)),
        *(("GF_ACTION", 0), ("GF_ACTION", 4), ("GF_MAX_VER_DIST", 0), ("GF_MAX_VER_DIST", 3.6)),
        *(("GF_MAX_HOR_DIST", 0), ("GF_MAX_HOR_DIST", 9.1), ("COM_DISARM_PRFLT", 2)),
    ],
)
def test_each_dangerous_value_fails_and_is_set(name, value):
    assert outcome_of(name, value) is Outcome.FAIL
    assert values_to_set(GOOD | {name: value}, FENCE, has_global_position=True) == {name: GOOD[name]}


@pytest.mark.parametrize(("name", "value"), [("NAV_DLL_ACT", 0), ("GF_ACTION", 5), ("RTL_RETURN_ALT", 3.5)])
def test_other_safe_values_pass(name, value):
    assert outcome_of(name, value) is Outcome.PASS


def test_what_is_set_is_below_a_fence_that_is_lower():
    low = FlightFence(FENCE.corners_arena_m, 1.8, 9.0)
    assert values_to_set(GOOD, low, has_global_position=True)["RTL_RETURN_ALT"] == 1.8
    checks = failsafe_checks(GOOD, low, has_global_position=True)
    assert next(each.outcome for each in checks if each.name == "RTL_RETURN_ALT") is Outcome.FAIL


def test_a_value_as_single_precision_passes():
    fence = FlightFence(FENCE.corners_arena_m, 4.77, 13.15)
    parameters = {"GF_MAX_VER_DIST": 4.769999980926514, "GF_MAX_HOR_DIST": 13.149999618530273}
    assert values_to_set(parameters, fence, has_global_position=True) == {}


def test_without_a_global_position_the_fences_parameters_have_no_effect():
    assert outcome_of("GF_ACTION", 0, has_global_position=False) is Outcome.NOTE
    assert values_to_set(GOOD | {"GF_ACTION": 0}, FENCE, has_global_position=False) == {}


def test_a_parameter_that_was_not_received_fails():
    checks = failsafe_checks({}, FENCE, has_global_position=True)
    assert {check.outcome for check in checks} == {Outcome.FAIL}
    assert values_to_set({}, FENCE, has_global_position=True) == {}


def test_the_fence_is_around_the_box_and_above_the_start():
    plan = FlightPlan(load_scenario("test-case-1"))
    fence = flight_fence(plan.box, plan.start_pose[:3])
    assert fence.corners_arena_m[0] == (-6.3, -6.3)
    assert fence.height_m == pytest.approx(plan.box.high_m[2] + 0.3 - plan.start_pose[2], abs=0.01)
    assert fence.radius_m == pytest.approx(13.15, abs=0.01)  # from (-3, -3) to (6.3, 6.3)
