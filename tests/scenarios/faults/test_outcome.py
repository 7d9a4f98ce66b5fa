"""Whether a flight ended as the fault table says, and the page that shows the table."""

from pathlib import Path

import pytest

from scenarios.faults.declaration import parse_fault
from scenarios.faults.page import kinds_table, rows_table, sensor_kinds
from scenarios.faults.table import TABLE, FaultEnd, fault_fields, row_of
from scenarios.result import BegunFault, FailsafeText, FaultFacts, FlightResult

PAGE = (Path(__file__).parents[3] / "docs" / "faults.md").read_text(encoding="utf-8").splitlines()
LOST = "Failsafe activated: position lost, descending"


@pytest.mark.parametrize("table", [kinds_table, rows_table, sensor_kinds])
def test_the_page_has_the_table(table):
    """`python -m scenarios.faults.page` prints the tables."""
    assert [line for line in table() if line not in PAGE] == []


def test_the_page_has_no_row_that_is_not_in_the_table():
    begin = PAGE.index(next(rows_table()))
    rows = [line for line in PAGE[begin : begin + 200] if line.startswith("|")]
    assert len(rows) == len(TABLE) + 2


def outcome(*texts, fault="external pose off at 10 s", after_s=5.96, text=LOST, **result):
    """The outcome of a flight with a fault and a failsafe (empty: none)."""
    begun = tuple(BegunFault(fault=each, began_us=20_000_000) for each in (fault, *texts))
    time_us = 20_000_000 + round(after_s * 1e6)
    failsafes = (FailsafeText(time_us=time_us, text=text),) if text else ()
    known = {"verdict": "aborted", "try_time_s": 30.0, **result}
    return fault_fields(FaultFacts(begun=begun, failsafes=failsafes), FlightResult(**known), "mocap")


@pytest.mark.parametrize(
    ("flight", "expected"),
    [
        ({}, True),
        ({"after_s": 6.49}, True),
        ({"after_s": 6.51}, False),
        ({"text": ""}, False),
        ({"text": "Attitude failure: flight terminated"}, False),
        ({"verdict": "crashed"}, False),
        ({"text": "", "verdict": "clean", "try_time_s": 16.0}, True),  # it had ended before
        ({"text": "", "verdict": "clean", "try_time_s": 17.0}, False),
        ({"fault": "external pose off at 10 s for 2 s", "text": "", "verdict": "clean"}, True),
        ({"fault": "external pose off at 10 s for 2 s"}, False),
        ({"fault": "motor 3 weak 0.1 at 10 s", "text": "", "verdict": "completed"}, True),
        ({"fault": "motor 3 weak 0.1 at 10 s", "text": "", "verdict": "timed out"}, False),
        ({"fault": "external pose wrong 0.3 at 10 s", "text": "", "verdict": "wrong order"}, True),
        ({"fault": "external pose wrong 0.3 at 10 s", "verdict": "aborted"}, False),
        (
            {
                "fault": "gyroscope off at 10 s",
                "after_s": 0.3,
                "text": "Sensors lost: flight terminated",
                "verdict": "crashed",
            },
            True,
        ),
        ({"fault": "camera off at 10 s", "text": "", "reason": "aborted (the camera is dead: …)"}, True),
        ({"fault": "camera off at 10 s", "text": "", "reason": "aborted (something else)"}, False),
        ({"fault": "camera black at 10 s", "text": "", "verdict": "timed out"}, True),
    ],
)
def test_the_outcome(flight, expected):
    assert outcome(**flight)["fault_outcome"] == ("as expected" if expected else "not as expected")


def test_what_the_fields_say():
    assert outcome() == {
        "faults": ("external pose off at 10 s",),
        "fault_reaction": f"after 5.96 s: {LOST}",
        "fault_expected": f"lands, after 6 s: {LOST}",
        "fault_outcome": "as expected",
        "autopilot": "",
    }
    nothing = fault_fields(FaultFacts(), FlightResult(verdict="clean"), "mocap")
    assert not any(nothing.values())


def test_of_a_genuine_autopilot_nothing_is_expected():
    begun = (BegunFault(fault="external pose off at 10 s", began_us=10_000_000),)
    said = (FailsafeText(time_us=14_500_000, text="Failsafe activated: LAND"),)
    facts = FaultFacts(begun=begun, failsafes=said, autopilot="PX4")
    fields = fault_fields(facts, FlightResult(verdict="aborted"), "mocap")
    assert fields["fault_reaction"] == "after 4.50 s: Failsafe activated: LAND"
    assert (fields["autopilot"], fields["fault_expected"], fields["fault_outcome"]) == ("PX4", "", "")


@pytest.mark.parametrize(
    "flight",
    [{"fault": "gyroscope wrong 3 at 10 s"}, {"texts": ("barometer off at 12 s",)}, {"fault": "nonsense"}],
)
def test_nothing_is_expected_of_what_no_row_tells(flight):
    fields = outcome(*flight.pop("texts", ()), **flight)
    assert fields["fault_outcome"] == fields["fault_expected"] == ""
    assert fields["faults"]


def test_the_row_of_the_same_sensors_and_the_nearest_size_counts():
    assert row_of(parse_fault("motor off at 1 s"), "outdoor").airframe == "x500"
    assert row_of(parse_fault("external pose delayed 0.04 s at 1 s"), "mocap").end is FaultEnd.FLIES_ON
    assert row_of(parse_fault("external pose delayed 0.1 s at 1 s"), "mocap").end is FaultEnd.LANDS
    assert row_of(parse_fault("external pose delayed 0.3 s at 1 s"), "mocap") is None
