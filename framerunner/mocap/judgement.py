"""Whether a vehicle uses the poses that are sent to it, and what to do if not: findings in words."""

from __future__ import annotations

from math import isfinite, isnan

from framerunner.mocap.dialects import dialect_of
from framerunner.mocap.facts import NEAR_M, Facts, Unused
from offboard.safety.check import Check, Checks, good, missing, note

MIN_RATE_HZ = 30.0
GAP_S = 0.2
MAX_UNUSED_S = 3.0
HEADING_DEG, TILT_DEG = 10.0, 8.0
_CORRELATED = 0.7


def is_fused(facts: Facts) -> bool | None:
    """Whether the vehicle's position is made from the poses; None: it cannot be told, or not any more."""
    return None if facts.record.silence else dialect_of(facts.record).is_fused(facts)


def line(facts: Facts) -> str:
    """The state in one line."""
    comparison = facts.comparison
    if facts.record.silence:
        return f"the vehicle is {facts.record.silence}; is it running? · {facts.sent} poses"
    if facts.sent == 0:
        return "no pose yet"
    dialect = dialect_of(facts.record)
    unknown = f"no {dialect.estimator} yet"
    fused = {True: "fused", False: "NOT fused", None: unknown}[dialect.is_fused(facts)]
    parts = [f"{facts.sent} poses, {facts.rate_hz:.0f} Hz", fused]
    if isfinite(comparison.distance_m):
        parts.append(f"{comparison.distance_m * 100:.1f} cm and {abs(comparison.heading_deg):.1f}° apart")
    if comparison.axes or comparison.track or comparison.tilt_deg > TILT_DEG:
        parts.append("axes WRONG")
    elif isnan(comparison.correlation):
        parts.append("turn it to test axes and delay")
    else:
        parts.append("axes right")
    if _wants_origin(facts) and "GPS_GLOBAL_ORIGIN" not in facts.record.latest:
        parts.append("NO origin")
    if isfinite(comparison.delay_s):
        parts.append(f"delay {comparison.delay_s * 1000:.0f} ms")
    return " · ".join(parts)


def judge(facts: Facts) -> list[Check]:
    """All findings, in the order in which they need to be right; of a vehicle that is gone, only that."""
    if facts.record.silence:
        advice = "is it running and sending to this address? What it used before is not known to hold"
        return [*_sent(facts), missing("vehicle", facts.record.silence, advice)]
    return [
        finding
        for check in (_sent, _fused, _near, _axes, _tilt, _heading, _delay)
        for finding in check(facts)
    ]


def _sent(facts: Facts) -> Checks:
    words = (
        f"{facts.sent} sent, {facts.rate_hz:.0f} a second, longest gap {facts.longest_gap_s * 1000:.0f} ms"
    )
    if facts.sent == 0:
        yield missing("poses", "none was sent", "does the source send, and is the body tracked?")
    elif 0.0 < facts.rate_hz < MIN_RATE_HZ:
        yield note("poses", words, f"the vehicle wants {MIN_RATE_HZ:g} a second or more")
    elif facts.longest_gap_s > GAP_S or facts.dropouts:
        yield note("poses", words, "see why the source stops: the vehicle lands when poses stay away")
    else:
        yield good("poses", words)
    if facts.faults:
        yield note(
            "source", f"{facts.faults} lines were left out; the last: {facts.fault}", "correct the sender"
        )


def _fused(facts: Facts) -> Checks:
    dialect = dialect_of(facts.record)
    fused, part = dialect.is_fused(facts), dialect.used_in_part(facts)
    if fused is None:
        yield missing("fused", f"the vehicle sends no {dialect.estimator}", "let the link carry it")
    elif not fused:
        yield missing("fused", "the vehicle does not use the poses", dialect.why_not_fused(facts))
    elif part is not None:
        yield note("fused", f"in part: {part[0]}", part[1])
    else:
        yield good("fused", "the vehicle uses the poses")
    if facts.unused.seconds > MAX_UNUSED_S:
        yield _unused(facts.unused)
    ratio = f"innovation ratio up to {facts.worst_ratio:.2f}"
    if facts.worst_ratio > 1.0:
        recovered = fused and facts.comparison.distance_m <= NEAR_M
        yield (note if recovered else missing)(
            "innovation", f"{ratio}: it rejected poses", "see gaps, axes and delay"
        )
    elif fused:
        yield good("innovation", ratio)
    yield from dialect.settings(facts)
    if _wants_origin(facts):
        yield _origin(facts)


def _wants_origin(facts: Facts) -> bool:
    return dialect_of(facts.record).needs_origin or facts.settings.origin is not None


def _origin(facts: Facts) -> Check:
    told = facts.record.latest.get("GPS_GLOBAL_ORIGIN")
    if told is not None:
        place = f"{told.latitude / 1e7:.7g}, {told.longitude / 1e7:.7g}, {told.altitude / 1e3:.4g} m"
        return good("origin", f"its place on Earth is {place}")
    if facts.settings.origin is None:
        text = "it has none, so it can neither be armed for GUIDED nor has it a fence"
        return missing("origin", text, "give --origin LATITUDE,LONGITUDE,ALTITUDE of the room")
    if facts.record.armed:
        return missing("origin", "it has none, and is armed: none is set in flight", "disarm it")
    text = "it has not taken the one that was sent"
    return missing("origin", text, "wait for its estimator to start, some 20 s after the vehicle")


def _unused(unused: Unused) -> Check:
    words = f"for {unused.seconds:.0f} s it did not use the poses that came"
    if unused.farthest_m:
        words += f", up to {unused.farthest_m:.1f} m from them"
    if unused.track:
        words += f"; it moved otherwise: {unused.track}"
    return missing("used", words, "see axes and delay; carry it by hand before it flies")


def _near(facts: Facts) -> Checks:
    distance_m = facts.comparison.distance_m
    if isnan(distance_m):
        yield note("position", "the vehicle reports none that could be compared", "")
    elif distance_m > NEAR_M:
        advice = f"it follows something else, or too slowly: {dialect_of(facts.record).guide}"
        yield missing("position", f"{distance_m:.2f} m from the pose of the same time", advice)
    else:
        yield good("position", f"{distance_m * 100:.1f} cm from the pose of the same time")


def _axes(facts: Facts) -> Checks:
    comparison = facts.comparison
    if comparison.axes:
        advice = "choose --frame and --forward by the axes of the motion capture and of its body"
        yield missing("axes", comparison.axes, advice)
    elif comparison.track:
        yield missing("axes", f"it moves otherwise than the poses: {comparison.track}", "choose --frame")
    elif not comparison.moves:
        yield note("axes", "not tested", "turn the vehicle by hand about all its axes, disarmed")
    elif comparison.correlation < _CORRELATED:
        text = f"poses turn otherwise than its gyroscope (correlation {comparison.correlation:.2f})"
        yield missing("axes", text, "is the tracked body this vehicle, and rigid?")
    else:
        yield good("axes", f"right, by its gyroscope (correlation {comparison.correlation:.2f})")


def _tilt(facts: Facts) -> Checks:
    tilt_deg = facts.comparison.tilt_deg
    if tilt_deg > TILT_DEG:
        advice = "choose --frame, or set the body level in the motion capture's software"
        yield missing("tilt", f"poses are tilted by {tilt_deg:.0f}° from the vehicle's", advice)
    elif isfinite(tilt_deg):
        yield good("tilt", f"within {tilt_deg:.1f}° of the vehicle's")


def _heading(facts: Facts) -> Checks:
    heading_deg = facts.comparison.heading_deg
    if isnan(heading_deg):
        return
    if abs(heading_deg) <= HEADING_DEG:
        yield good("heading", f"within {abs(heading_deg):.1f}° of the vehicle's")
        return
    reason, advice = dialect_of(facts.record).heading_advice(facts)
    words = f"the vehicle's differs by {heading_deg:.0f}°" + (f": {reason}" if reason else "")
    yield missing("heading", words, advice)


def _delay(facts: Facts) -> Checks:
    if not isnan(facts.comparison.delay_s):
        yield from dialect_of(facts.record).delay(facts)
