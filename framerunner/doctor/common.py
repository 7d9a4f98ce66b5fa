"""Checks that PX4 and ArduPilot have in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite

from framerunner.doctor.subjects import Subject, good, missing, note
from framerunner.wire.dialect import mavlink
from framerunner.wire.session.record import Record
from offboard.safety.check import Check, Checks

CHALLENGE_HEIGHT_M = 3.0  # gates are at up to 2 m, the mission climbs from them
CHALLENGE_REACH_M = 8.0
_HIGH = 0.5  # of an innovation to what its gate lets pass; PX4 does not arm above it


def takes_velocities(record: Record, name: Subject, advice: str) -> Check:
    """Whether the mode that an app flies in takes velocities."""
    version = record.latest.get("AUTOPILOT_VERSION")
    if version is None:
        return note(name, "it does not report its capabilities", advice)
    if not version.capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED:
        return missing(name, "takes no local setpoints", advice)
    return good(name, "takes velocities in body axes")


def agreement(name: Subject, ratios: Mapping[str, float], rejected: float, word: str) -> Check:
    """Whether measurements agree with the estimate.

    Args:
        name: of the check.
        ratios: of innovations to what their gates let pass, by measurement.
        rejected: from which on a measurement is rejected.
        word: for a ratio.
    """
    high = {what: ratio for what, ratio in ratios.items() if ratio > _HIGH}
    words = ", ".join(f"{what} {ratio:.2f}" for what, ratio in high.items())
    if any(ratio >= rejected for ratio in high.values()):
        return missing(name, f"it rejects measurements: {words}", "correct the sensor or its settings")
    if high:
        return note(name, f"measurements hardly agree: {words}", "wait, or correct the sensor")
    largest = max((ratio for ratio in ratios.values() if isfinite(ratio)), default=0.0)
    return good(name, f"measurements agree, largest {word} {largest:.2f}")


def slow_limits(record: Record, slowest: Sequence[tuple[Subject, float, str]]) -> Checks:
    """Parameters that slow the drone down, by their names, minima and units."""
    if not record.parameters:
        yield note("parameters", "no parameter was received", "check that the link is not read-only")
    for name, minimum, unit in slowest:
        value = record.parameters.get(name)
        if value is not None and value < minimum:
            yield missing(name, f"{value:g} {unit}", f"set it to {minimum:g} or more")


def early_disarming(record: Record, name: Subject) -> Checks:
    """The parameter after which a drone that has not taken off is disarmed."""
    delay_s = record.parameters.get(name, 0.0)
    if 0.0 < delay_s < 5.0:
        yield missing(name, f"{delay_s:g} s", "set it to 10: take-off begins with a slow ramp")
