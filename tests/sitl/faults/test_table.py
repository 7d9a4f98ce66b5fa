"""The rows of the fault table that a hovering drone shows, each flown."""

import pytest

from scenarios.faults.declaration import FaultPart
from scenarios.faults.table import TABLE, FaultEnd
from tests.sitl.faults.hovering import hover

BY_APP = {FaultPart.CAMERA, FaultPart.LINK}
ROWS = [row for row in TABLE if row.fault.part not in BY_APP]
REACTION_S = 0.5  # after the stated time-out
WANDERS_M = 2.0  # a flight that goes on stays so near, from a hover without a mission


def name(row):
    return f"{str(row.fault).replace(' at 0 s', '')}, {row.airframe}"


def test_there_are_many_rows_and_no_two_are_the_same():
    assert len(ROWS) >= 24
    assert len({name(row) for row in TABLE}) == len(TABLE)


@pytest.mark.parametrize("row", ROWS, ids=name)
def test_a_flight_ends_as_the_table_says(row):
    seen = hover(row.fault, row.sensors, row.airframe, after_s=25.0 if row.end is FaultEnd.LANDS else 10.0)
    assert seen.finite
    if row.end in {FaultEnd.FLIES_ON, FaultEnd.DISPLACED}:
        assert seen.failsafes == []
        assert seen.armed
        assert seen.moved_m < max(WANDERS_M, 2 * row.fault.amount if row.fault.kind == "wrong" else 0.0)
        return
    (after_s, text), *later = seen.failsafes
    assert text == row.reaction
    assert after_s <= row.within_s + REACTION_S
    assert seen.at_rest
    assert later == []
    if row.end is FaultEnd.TERMINATES:
        assert seen.stopped
    else:
        assert not seen.armed
        assert seen.tilt_deg < 30.0
        assert seen.touchdown_m_s < 1.5
