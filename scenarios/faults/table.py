"""How flights with faults end: docs/faults.md shows this table, tests fly it, results tell if it held."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from scenarios.faults.declaration import Fault, FaultError, parse_fault
from scenarios.result import FaultFacts, RefereeReport
from scenarios.verdict import Verdict


class FaultEnd(StrEnum):
    """How a flight with a fault ends."""

    FLIES_ON = "flies on"
    DISPLACED = "flies on, displaced"
    LANDS = "lands"
    TERMINATES = "terminates"
    APP_ENDS = "the app ends the flight"
    TIME_LIMIT = "time limit"


@dataclass(frozen=True, slots=True)
class FaultRow:
    """One row.

    Attributes:
        fault: with the largest size, and with a length the longest, for which the row holds.
        sensors: suite that is flown with.
        airframe: that is flown.
        notices: what the autopilot or the app notices, in words.
        within_s: the time-out after which it reacts; None: it has no need to.
        reaction: the autopilot's status text, or the app's reason; empty: none.
        end: how the flight ends.
    """

    fault: Fault
    sensors: str
    airframe: str
    notices: str
    within_s: float | None
    reaction: str
    end: FaultEnd

    def holds_for(self, fault: Fault) -> bool:
        """Whether the row tells how a flight with this fault ends."""
        own = self.fault
        if (own.part, own.kind) != (fault.part, fault.kind) or abs(fault.amount) > abs(own.amount):
            return False
        if own.for_s is not None:
            return fault.for_s is not None and fault.for_s <= own.for_s
        return fault.for_s is None or self.end in {FaultEnd.FLIES_ON, FaultEnd.DISPLACED}


_INDOORS, _OUTDOORS, _FLOW, _RACER = (
    ("mocap", "abejorro"),
    ("outdoor", "x500"),
    ("flow", "x500"),
    ("mocap", "racer-3in"),
)
_After = tuple[float | None, str]
"""Time-out in seconds, and status text."""
_NONE: _After = (None, "")
_SENSORS_LOST = "Sensors lost: flight terminated"
_TUMBLED = "Attitude failure: flight terminated"
_POSITION_LOST = "Failsafe activated: position lost, descending"
_BATTERY_EMPTY = "Failsafe activated: battery nearly empty, land"
_NO_NUMBERS = "no usable sample of the IMU for 0.3 s"
_REPEATED = "the same value for 50 ms, then no usable sample of the IMU for 0.3 s"
_REPEATED_SLOW = "the same value again and again; it is no longer fused"
_NOTHING_COMES = "it delivers nothing; the others are fused"
_NO_AID = "no position for 5 s (the estimator's limit) and 1 s (the commander's)"
_TILT = "a tilt of more than 60 degrees for 0.3 s"


def _row(
    text: str,
    flown: tuple[str, str],
    notices: str,
    end: FaultEnd = FaultEnd.FLIES_ON,
    *,
    after: _After = _NONE,
) -> FaultRow:
    what, _, lasts = text.partition(" for ")
    fault = parse_fault(f"{what} at 0 s" + (f" for {lasts}" if lasts else ""))
    return FaultRow(fault, *flown, notices, *after, end)


def _imu(text: str, flown: tuple[str, str], notices: str, within_s: float) -> FaultRow:
    return _row(text, flown, notices, FaultEnd.TERMINATES, after=(within_s, _SENSORS_LOST))


def _lost(text: str, flown: tuple[str, str], within_s: float, why: str = _NO_AID) -> FaultRow:
    return _row(text, flown, why, FaultEnd.LANDS, after=(within_s, _POSITION_LOST))


def _displaced(text: str, flown: tuple[str, str]) -> FaultRow:
    return _row(text, flown, "a position that does not fit; after 1 s it is followed", FaultEnd.DISPLACED)


def _app(text: str, notices: str, within_s: float, reaction: str) -> FaultRow:
    return _row(text, _INDOORS, notices, FaultEnd.APP_ENDS, after=(within_s, reaction))


TABLE: tuple[FaultRow, ...] = (
    _imu("gyroscope off", _INDOORS, _NO_NUMBERS, 0.3),
    _imu("gyroscope stuck", _INDOORS, _REPEATED, 0.35),
    _row("gyroscope wrong 0.05 rad/s", _INDOORS, "positions do not fit; its bias is estimated again"),
    _row("gyroscope wrong 0.05 rad/s", _OUTDOORS, "positions do not fit; its bias is estimated again"),
    _row("gyroscope scaled 1.2", _INDOORS, "nothing"),
    _row("gyroscope noisy 0.1 rad/s", _INDOORS, "its noise, which is measured"),
    _row("gyroscope delayed 0.02 s", _INDOORS, "nothing"),
    _row("gyroscope lossy 0.5", _INDOORS, "lost samples; the next one stands for them"),
    _imu("accelerometer off", _INDOORS, _NO_NUMBERS, 0.3),
    _imu("accelerometer stuck", _RACER, _REPEATED, 0.35),
    _row("accelerometer wrong 0.5 m/s2", _INDOORS, "positions do not fit; its bias is estimated again"),
    _row("accelerometer noisy 2 m/s2", _INDOORS, "its noise, which is measured"),
    _row("magnetometer off", _OUTDOORS, _NOTHING_COMES),
    _row("magnetometer stuck", _OUTDOORS, _REPEATED_SLOW),
    _row("magnetometer wrong 0.2 gauss", _OUTDOORS, "a field that does not fit; it is rejected"),
    _row("magnetometer noisy 0.1 gauss", _OUTDOORS, "most of it does not fit, and is rejected"),
    _row("barometer off", _INDOORS, _NOTHING_COMES),
    _row("barometer stuck", _INDOORS, _REPEATED_SLOW),
    _row("barometer stuck", _OUTDOORS, _REPEATED_SLOW),
    _row("barometer wrong 50 Pa", _OUTDOORS, "a step of 4 m; it is rejected, then taken for its slow error"),
    _row("barometer noisy 50 Pa", _INDOORS, "most of it does not fit, and is rejected"),
    _row("barometer delayed 0.5 s", _INDOORS, "samples too old to be fused"),
    _lost("gps off", _OUTDOORS, 6.0),
    _row("gps off for 3 s", _OUTDOORS, "no position, for less than 5 s"),
    _lost("gps stuck", _OUTDOORS, 7.0, "the same value for 1 s, then " + _NO_AID),
    _displaced("gps wrong 5 m", _OUTDOORS),
    _row("gps noisy 3 m", _OUTDOORS, "its noise, which is measured"),
    _lost("gps delayed 0.5 s", _OUTDOORS, 6.0, "samples too old to be fused; " + _NO_AID),
    _row("gps lossy 0.5", _OUTDOORS, "nothing"),
    _row("range_finder off", _INDOORS, _NOTHING_COMES),
    _row("range_finder stuck", _INDOORS, _REPEATED_SLOW),
    _row("range_finder wrong 0.5 m", _INDOORS, "a step of the ground"),
    _lost("optical_flow off", _FLOW, 6.0),
    _lost("optical_flow stuck", _FLOW, 6.3, "the same value for 0.3 s, then " + _NO_AID),
    _row("optical_flow scaled 1.2", _FLOW, "nothing"),
    _lost("external_pose off", _INDOORS, 6.0),
    _lost("external_pose off", _RACER, 6.0),
    _row("external_pose off for 3 s", _INDOORS, "no position, for less than 5 s"),
    _lost("external_pose stuck", _INDOORS, 6.3, "the same value for 0.3 s, then " + _NO_AID),
    _displaced("external_pose wrong 0.3 m", _INDOORS),
    _row("external_pose noisy 0.05 m", _INDOORS, "its noise, which is measured"),
    _row("external_pose delayed 0.05 s", _INDOORS, "nothing; each is fused at its own time"),
    _lost("external_pose delayed 0.2 s", _INDOORS, 6.0, "poses too old to be fused; " + _NO_AID),
    _row("external_pose lossy 0.9", _INDOORS, "nothing"),
    _row(
        "battery_monitor off",
        _INDOORS,
        "no voltage: nearly empty",
        FaultEnd.LANDS,
        after=(0.2, _BATTERY_EMPTY),
    ),
    _row("battery_monitor stuck", _INDOORS, "nothing"),
    _row("battery sag 0.05", _INDOORS, "a lower charge"),
    _row(
        "battery sag 0.2",
        _INDOORS,
        "a voltage of less than BAT_EMERGEN_THR",
        FaultEnd.LANDS,
        after=(0.2, _BATTERY_EMPTY),
    ),
    _row("motor off", _INDOORS, _TILT, FaultEnd.TERMINATES, after=(0.7, _TUMBLED)),
    _row("motor off", _OUTDOORS, _TILT, FaultEnd.TERMINATES, after=(0.7, _TUMBLED)),
    _row("motor weak 0.2", _INDOORS, "a moment, which the stabiliser compensates"),
    _row("motor weak 0.2", _OUTDOORS, "a moment, which the stabiliser compensates"),
    _app("camera off", "no image: after 1 s it hovers, after 5 s it ends", 5.0, "the camera is dead"),
    _row("camera off for 3 s", _INDOORS, "no image: it hovers until one comes"),
    _row("camera stuck for 3 s", _INDOORS, "nothing"),
    _row("camera stuck", _INDOORS, "nothing: it searches in vain", FaultEnd.TIME_LIMIT),
    _row("camera black for 3 s", _INDOORS, "nothing"),
    _row("camera black", _INDOORS, "nothing: it searches in vain", FaultEnd.TIME_LIMIT),
    _row("camera delayed 0.3 s", _INDOORS, "old images, which it fuses at their times"),
    _row("camera lossy 0.5", _INDOORS, "fewer images"),
    _app("link off", "no telemetry for 1 s", 1.0, "link lost"),
    _row("link off for 0.5 s", _INDOORS, "nothing"),
    _row("link lossy 0.5", _INDOORS, "nothing"),
)
"""All rows."""


def row_of(fault: Fault, sensors: str) -> FaultRow | None:
    """The row that tells how a flight with a fault ends; None: there is none.

    Args:
        fault: of the flight.
        sensors: suite of the flight; a row of another suite holds if there is none of this.
    """
    rows = sorted(
        (row for row in TABLE if row.holds_for(fault)),
        key=lambda row: (row.sensors != sensors, abs(row.fault.amount)),
    )
    return rows[0] if rows else None


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
