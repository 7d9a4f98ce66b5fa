"""The rows of the fault table that concern the app, each flown with a mission; and what a flight tells."""

import pytest

from framerunner.flying.display import result_lines
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.mission import load_mission
from scenarios.faults.declaration import FaultPart, parse_fault
from scenarios.faults.table import TABLE, FaultEnd
from scenarios.loader import load_scenario

BY_APP = [row for row in TABLE if row.fault.part in (FaultPart.CAMERA, FaultPart.LINK)]
AT_S = 6.0


def fly(fault, sensors="mocap", limit_s=60.0, scenario="calm-3"):
    changed = {"sensors": sensors, "faults": (fault,), "try_limit_s": limit_s}
    planned = load_scenario(scenario).model_copy(update=changed)
    return fly_lockstep(FlightPlan(planned, load_mission("explorer"), 3)).result


@pytest.mark.parametrize("row", BY_APP, ids=lambda row: str(row.fault).replace(" at 0 s", ""))
def test_a_flight_ends_as_the_table_says(row):
    """A flight that goes on is still flown at a short time limit."""
    fault = row.fault.model_copy(update={"at_s": AT_S})
    result = fly(fault, row.sensors, 20.0 if row.end is FaultEnd.APP_ENDS else 14.0)
    assert result.faults == (str(fault),)
    if row.end is FaultEnd.APP_ENDS:
        assert result.fault_outcome == "as expected", result.reason
        assert row.reaction in result.reason
        assert result.try_time_s <= AT_S + row.within_s + 6.0  # then the drone's own failsafe follows
    else:
        assert (result.verdict, result.fault_reaction) == ("timed out", "")


def test_a_survived_fault_is_as_expected():
    result = fly(parse_fault("camera off at 6 s for 2 s"))
    assert result.completed
    assert (result.fault_expected, result.fault_outcome) == ("flies on", "as expected")


def test_a_failsafe_ends_the_flight_before_it_is_judged():
    result = fly(parse_fault("external pose off at 6 s"))
    assert result.fault_outcome == "as expected"
    assert result.faults == ("external pose off at 6 s",)
    assert result.fault_reaction.endswith("Failsafe activated: position lost, descending")
    assert result.landing_error_m is not None  # it has come to rest
    assert "faults: external pose off at 6 s; after 5.9" in result_lines(result)


def test_the_same_seed_gives_the_same_flight():
    noisy = parse_fault("external pose lossy 0.5 at 2 s")
    assert fly(noisy, limit_s=8.0).state_sha256 == fly(noisy, limit_s=8.0).state_sha256
