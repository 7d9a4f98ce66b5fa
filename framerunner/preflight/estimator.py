"""What a vehicle's estimator reports, as PX4 and ArduPilot send it."""

from __future__ import annotations

from math import isnan

from framerunner.wire.ardupilot_messages import (
    EKF_ATTITUDE,
    EKF_POS_HORIZ_ABS,
    EKF_POS_VERT_ABS,
    has_position,
)
from framerunner.wire.dialect import mavlink
from framerunner.wire.session.record import Record
from offboard.safety.vehicle_checks import EstimatorFacts


def estimator_facts(record: Record, autopilot: str) -> EstimatorFacts:
    """What the checks need, of a vehicle with `px4`, `ardupilot` or another autopilot."""
    return _ardupilots(record) if autopilot == "ardupilot" else _px4s(record)


def has_global_position(record: Record, autopilot: str) -> bool:
    """Whether the vehicle knows where on Earth it is, so that its fence has an effect."""
    name, flag = "ESTIMATOR_STATUS", int(mavlink.ESTIMATOR_POS_HORIZ_ABS)
    if autopilot == "ardupilot":
        name, flag = "EKF_STATUS_REPORT", EKF_POS_HORIZ_ABS
    status = record.latest.get(name)
    return status is not None and bool(status.flags & flag) and "GPS_GLOBAL_ORIGIN" in record.latest


def _px4s(record: Record) -> EstimatorFacts:
    status = record.latest.get("ESTIMATOR_STATUS")
    if status is None:
        return EstimatorFacts(reported=False)
    flags = status.flags
    ratios = (status.vel_ratio, status.pos_horiz_ratio, status.pos_vert_ratio, status.mag_ratio)
    absolute, relative = mavlink.ESTIMATOR_POS_HORIZ_ABS, mavlink.ESTIMATOR_POS_HORIZ_REL
    return EstimatorFacts(
        reported=True,
        has_attitude=bool(flags & mavlink.ESTIMATOR_ATTITUDE),
        has_position=bool(flags & (absolute | relative)),
        has_height=bool(flags & mavlink.ESTIMATOR_POS_VERT_ABS),
        largest_ratio=_largest(ratios),
    )


def _ardupilots(record: Record) -> EstimatorFacts:
    """Its variances are ratios of innovations to what their gates let pass, as PX4's ratios."""
    message = "EKF_STATUS_REPORT"
    report = record.latest.get(message)
    if report is None:
        return EstimatorFacts(reported=False, message=message)
    flags = report.flags
    ratios = (
        *(report.velocity_variance, report.pos_horiz_variance),
        *(report.pos_vert_variance, report.compass_variance),
    )
    return EstimatorFacts(
        reported=True,
        has_attitude=bool(flags & EKF_ATTITUDE),
        has_position=has_position(report),
        has_height=bool(flags & EKF_POS_VERT_ABS),
        largest_ratio=_largest(ratios),
        message=message,
    )


def _largest(ratios: tuple[float, ...]) -> float:
    return max((ratio for ratio in ratios if not isnan(ratio)), default=0.0)
