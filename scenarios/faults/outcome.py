"""Whether a flight with a fault ended as the fault table says."""

from __future__ import annotations

from typing import Any

from scenarios.faults.parse import FaultError, parse_fault
from scenarios.faults.table import FaultEnd, FaultRow, row_of
from scenarios.result import FaultFacts, RefereeReport
from scenarios.verdict import Verdict

REACTION_S = 0.5
"""A reaction may come so much later than its time-out."""


def fault_fields(facts: FaultFacts, report: RefereeReport, sensors: str) -> dict[str, Any]:
    """The fields of a result that tell of its faults and its autopilot.

    Args:
        facts: the faults and failsafes of the flight.
        report: of the referee.
        sensors: name of the suite that was flown with.
    """
    fields: dict[str, Any] = {"faults": (), "fault_reaction": "", "fault_expected": "", "fault_outcome": ""}
    fields["autopilot"] = facts.autopilot
    if not facts.begun:
        return fields
    first = facts.begun[0]
    after = [each for each in facts.failsafes if each.time_us >= first.began_us]
    reaction_s = (after[0].time_us - first.began_us) / 1e6 if after else 0.0
    text = after[0].text if after else ""
    fields["faults"] = tuple(each.fault for each in facts.begun)
    fields["fault_reaction"] = f"after {reaction_s:.2f} s: {text}" if after else ""
    try:
        fault = parse_fault(first.fault)
    except FaultError:
        return fields
    own = not facts.autopilot  # the table is of our autopilot
    row = row_of(fault, sensors) if own and len(facts.begun) == 1 else None
    if row is not None:
        late_s = report.try_time_s - fault.at_s
        ended = _ended_so(row, report, text, reaction_s=reaction_s, late_s=late_s)
        fields["fault_expected"] = in_words(row)
        fields["fault_outcome"] = "as expected" if ended else "not as expected"
    return fields


def in_words(row: FaultRow) -> str:
    """How a flight ends by a row."""
    if row.within_s is None:
        return row.end.value
    return f"{row.end.value}, after {row.within_s:g} s: {row.reaction}"


def _ended_so(row: FaultRow, report: RefereeReport, text: str, *, reaction_s: float, late_s: float) -> bool:
    """Whether a flight ended as a row says.

    Args:
        row: of its fault.
        report: of the referee.
        text: of the first failsafe; empty: there was none.
        reaction_s: from the fault to that.
        late_s: from the fault to the end of the try.
    """
    if report.completed and not text:  # with another end than this, it must have ended before
        by_app = row.end in {FaultEnd.APP_ENDS, FaultEnd.TIME_LIMIT}
        return row.within_s is None or by_app or late_s <= row.within_s + REACTION_S
    if row.end is FaultEnd.DISPLACED:
        return not text
    if row.end is FaultEnd.APP_ENDS:
        return row.reaction in report.reason
    if row.end is FaultEnd.TIME_LIMIT:
        return report.verdict is Verdict.TIMED_OUT
    if row.within_s is None or text != row.reaction or reaction_s > row.within_s + REACTION_S:
        return False
    return row.end is FaultEnd.TERMINATES or report.verdict is not Verdict.CRASHED
