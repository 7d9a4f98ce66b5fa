"""Whether a vehicle uses the poses that are sent to it, and what to do if not: findings in words."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from math import isfinite, isnan

from framerunner.doctor.findings import Finding, Level
from framerunner.doctor.listen import Record
from framerunner.mocap.motion import PoseComparison
from wire.dialect import mavlink

MIN_RATE_HZ = 30.0
GAP_S = 0.2
NEAR_M, FAR_M = 0.10, 0.5
HEADING_DEG, TILT_DEG = 10.0, 8.0
DELAY_S = 0.02  # difference that matters
_CORRELATED = 0.7
_POSITION, _HEIGHT, _VELOCITY, _YAW = 1, 2, 4, 8  # bits of EKF2_EV_CTRL
_WANTED = _POSITION | _HEIGHT | _VELOCITY | _YAW
_VISION = mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION

_good = partial(Finding, Level.GOOD)
_note = partial(Finding, Level.NOTE)
_missing = partial(Finding, Level.MISSING)


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known at the end, or once a second.

    Attributes:
        record: what the vehicle has sent.
        comparison: of poses and vehicle.
        sent: number of poses.
        rate_hz: poses a second.
        longest_gap_s: between two poses.
        dropouts: how often the source stopped.
        worst_ratio: largest innovation ratio of position and height.
        converts_stamps: the vehicle has got enough answers to TIMESYNC to convert time stamps.
        faults: lines of the source that were no poses.
        fault: what was wrong with the last of them.
    """

    record: Record
    comparison: PoseComparison
    sent: int = 0
    rate_hz: float = 0.0
    longest_gap_s: float = 0.0
    dropouts: int = 0
    worst_ratio: float = 0.0
    converts_stamps: bool = False
    faults: int = 0
    fault: str = ""

    @property
    def ev_ctrl(self) -> int | None:
        """EKF2_EV_CTRL; None: the vehicle has not told."""
        value = self.record.parameters.get("EKF2_EV_CTRL")
        return None if value is None else int(value)


def is_fused(facts: Facts) -> bool | None:
    """Whether the vehicle's position is made from the poses; None: it cannot be told yet."""
    record = facts.record
    estimator, system = record.latest.get("ESTIMATOR_STATUS"), record.latest.get("SYS_STATUS")
    if estimator is None:
        return None
    if system is not None and system.onboard_control_sensors_present & _VISION:
        return bool(system.onboard_control_sensors_enabled & system.onboard_control_sensors_health & _VISION)
    aided = bool(estimator.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_REL)
    by_gps = bool(estimator.flags & mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS)
    requested = facts.ev_ctrl is None or bool(facts.ev_ctrl & _POSITION)
    near = facts.comparison.distance_m < FAR_M
    return aided and requested and near and not (by_gps and facts.comparison.distance_m > NEAR_M)


def line(facts: Facts) -> str:
    """The state in one line."""
    comparison = facts.comparison
    if facts.sent == 0:
        return "no pose yet"
    fused = {True: "fused", False: "NOT fused", None: "no ESTIMATOR_STATUS yet"}[is_fused(facts)]
    parts = [f"{facts.sent} poses, {facts.rate_hz:.0f} Hz", fused]
    if isfinite(comparison.distance_m):
        parts.append(f"{comparison.distance_m * 100:.1f} cm and {abs(comparison.heading_deg):.1f}° apart")
    if comparison.axes or comparison.track or comparison.tilt_deg > TILT_DEG:
        parts.append("axes WRONG")
    elif isnan(comparison.correlation):
        parts.append("turn it to test axes and delay")
    else:
        parts.append("axes right")
    if isfinite(comparison.delay_s):
        parts.append(f"delay {comparison.delay_s * 1000:.0f} ms")
    return " · ".join(parts)


def judge(facts: Facts) -> list[Finding]:
    """All findings, in the order in which they need to be right."""
    return [
        finding
        for check in (_sent, _fused, _near, _axes, _tilt, _heading, _delay)
        for finding in check(facts)
    ]


def _sent(facts: Facts) -> Iterator[Finding]:
    words = (
        f"{facts.sent} sent, {facts.rate_hz:.0f} a second, longest gap {facts.longest_gap_s * 1000:.0f} ms"
    )
    if facts.sent == 0:
        yield _missing("poses", "none was sent", "does the source send, and is the body tracked?")
    elif facts.rate_hz < MIN_RATE_HZ:
        yield _note("poses", words, f"PX4 wants {MIN_RATE_HZ:g} a second or more")
    elif facts.longest_gap_s > GAP_S or facts.dropouts:
        yield _note("poses", words, "see why the source stops: the vehicle lands when poses stay away")
    else:
        yield _good("poses", words)
    if facts.faults:
        yield _note(
            "source", f"{facts.faults} lines were no poses; the last: {facts.fault}", "correct the sender"
        )


def _fused(facts: Facts) -> Iterator[Finding]:
    fused, control, record = is_fused(facts), facts.ev_ctrl, facts.record
    if record.latest["HEARTBEAT"].autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA:
        advice = "set VISO_TYPE to 1 and EK3_SRC1_POSXY, EK3_SRC1_POSZ and EK3_SRC1_YAW to 6"
    elif control is not None and control & _WANTED != _WANTED:
        advice = f"EKF2_EV_CTRL is {control}: set it to 15, then restart the vehicle"
    elif facts.sent == 0:
        advice = "let the source send"
    else:
        advice = "see the innovation ratio and the axes below; has its estimator started? Restart it"
    if fused is None:
        yield _missing("fused", "the vehicle sends no ESTIMATOR_STATUS", "let the link carry it")
    elif not fused:
        yield _missing("fused", "the vehicle does not use the poses", advice)
    elif control is not None and control & _WANTED & ~_VELOCITY != _WANTED & ~_VELOCITY:
        yield _note("fused", f"in part: EKF2_EV_CTRL is {control}", "set it to 15")
    else:
        yield _good("fused", "the vehicle uses the poses")
    ratio = f"innovation ratio up to {facts.worst_ratio:.2f}"
    if facts.worst_ratio > 1.0:
        recovered = fused and facts.comparison.distance_m <= NEAR_M
        level = Level.NOTE if recovered else Level.MISSING
        yield Finding(level, "innovation", f"{ratio}: it rejected poses", "see gaps, axes and delay")
    elif fused:
        yield _good("innovation", ratio)
    reference = record.parameters.get("EKF2_HGT_REF")
    if reference is not None and int(reference) != 3:
        yield _note("height", f"EKF2_HGT_REF is {reference:g}, not vision", "set it to 3")


def _near(facts: Facts) -> Iterator[Finding]:
    distance_m = facts.comparison.distance_m
    if isnan(distance_m):
        yield _note("position", "the vehicle reports none that could be compared", "")
    elif distance_m > NEAR_M:
        advice = "it follows something else, or too slowly: docs/real-drone.md, step 6"
        yield _missing("position", f"{distance_m:.2f} m from the pose of the same time", advice)
    else:
        yield _good("position", f"{distance_m * 100:.1f} cm from the pose of the same time")


def _axes(facts: Facts) -> Iterator[Finding]:
    comparison = facts.comparison
    if comparison.axes:
        advice = "choose --frame and --forward by the axes of the motion capture and of its body"
        yield _missing("axes", comparison.axes, advice)
    elif comparison.track:
        yield _missing("axes", f"it moves otherwise than the poses: {comparison.track}", "choose --frame")
    elif not comparison.moves:
        yield _note("axes", "not tested", "turn the vehicle by hand about all its axes, disarmed")
    elif comparison.correlation < _CORRELATED:
        text = f"poses turn otherwise than its gyroscope (correlation {comparison.correlation:.2f})"
        yield _missing("axes", text, "is the tracked body this vehicle, and rigid?")
    else:
        yield _good("axes", f"right, by its gyroscope (correlation {comparison.correlation:.2f})")


def _tilt(facts: Facts) -> Iterator[Finding]:
    tilt_deg = facts.comparison.tilt_deg
    if tilt_deg > TILT_DEG:
        advice = "choose --frame, or set the body level in the motion capture's software"
        yield _missing("tilt", f"poses are tilted by {tilt_deg:.0f}° from the vehicle's", advice)
    elif isfinite(tilt_deg):
        yield _good("tilt", f"within {tilt_deg:.1f}° of the vehicle's")


def _heading(facts: Facts) -> Iterator[Finding]:
    heading_deg = facts.comparison.heading_deg
    if isnan(heading_deg):
        return
    if abs(heading_deg) <= HEADING_DEG:
        yield _good("heading", f"within {abs(heading_deg):.1f}° of the vehicle's")
    elif facts.ev_ctrl is not None and not facts.ev_ctrl & _YAW:
        text = f"the vehicle's differs by {heading_deg:.0f}°: it is not that of the poses"
        yield _missing("heading", text, "set EKF2_EV_CTRL to 15 and EKF2_MAG_TYPE to 5")
    else:
        advice = "choose --frame or --forward; without a compass restart the vehicle"
        yield _missing("heading", f"the vehicle's differs by {heading_deg:.0f}°", advice)


def _delay(facts: Facts) -> Iterator[Finding]:
    delay_s = facts.comparison.delay_s
    if isnan(delay_s):
        return
    given_ms = facts.record.parameters.get("EKF2_EV_DELAY", 0.0)
    words = f"poses are {delay_s * 1000:.0f} ms older than their time stamps"
    if abs(delay_s - given_ms / 1000.0) <= DELAY_S:
        yield _good("delay", words)
    else:
        advice = f"EKF2_EV_DELAY is {given_ms:g} ms: set it to {max(0.0, delay_s * 1000):.0f}, or use --delay"
        yield _note("delay", words, advice)
    if not facts.converts_stamps:
        text = "the vehicle has not got 500 answers to TIMESYNC yet: until then it uses times of arrival"
        yield _note("time stamps", text, "")
