"""The result of a flight: put together in this one place, and said in words."""

from __future__ import annotations

from importlib import metadata

from framerunner.flying.plan import FlightPlan
from framerunner.runs.track import Track
from offboard.app import MissionEnd
from scenarios.result import FlightResult, RefereeReport, Timing


def flight_result(
    plan: FlightPlan,
    report: RefereeReport,
    end: MissionEnd,
    track: Track,
    *,
    judged_by: str,
    state_sha256: str | None = None,
    timing: Timing | None = None,
) -> FlightResult:
    """Put together what stands in `result.json`, but for wall times.

    Args:
        plan: what was flown.
        report: of the referee.
        end: how the mission ended.
        track: where the drone was.
        judged_by: what the referee saw by.
        state_sha256: of a lockstep flight.
        timing: of a flight in real time.
    """
    special = {"state_sha256": state_sha256, "lift_m": plan.lift_m or None, "timing": timing}
    return FlightResult(
        scenario=plan.scenario.name,
        mission=plan.chart.name,
        seed=plan.seed,
        **dict(report),
        mission_state=end.mission_state,
        ended=end.ended,
        seconds_in_state=track.seconds_in_state(),
        kept_in_box_s=end.kept_in_box_s,
        judged_by=judged_by,
        version=metadata.version("framerunner"),
        **{name: value for name, value in special.items() if value is not None},
    )


def result_lines(result: FlightResult) -> str:
    """A result in two lines for people."""
    error_m = result.landing_error_m
    landing = "did not land" if error_m is None else f"landed {100 * error_m:.1f} cm from the base's centre"
    verdict, reason = result.verdict, result.reason
    said = reason if reason.startswith(verdict) else f"{verdict}: {reason}"
    kept = f", kept in its box for {result.kept_in_box_s:.1f} s" if result.kept_in_box_s else ""
    return (
        f"{said}\n"
        f"try {result.try_time_s:.1f} s, penalty {result.penalty_s:.1f} s, "
        f"path {result.path_length_m:.1f} m, {landing}, judged by {result.judged_by}{kept}"
    )


def timing_line(timing: Timing | None) -> str:
    """One line for people if the machine did not keep up; empty if it did, or nothing is known."""
    if timing is None or timing.kept_up:
        return ""
    counts = (
        (timing.late_ticks, "ticks"),
        (timing.late_images, "images"),
        (timing.late_setpoints, "setpoints"),
    )
    late = ", ".join(f"{count} {what}" for count, what in counts if count)
    if late:
        return (
            f"the machine did not keep up: {late} came late (oldest image {timing.oldest_image_s:.2f} s); "
            "the flight may differ from one on a free machine"
        )
    return (
        f"the machine did not keep up: vehicle time ran at {timing.speed:.2f} of the wanted speed; "
        "it waited for the app, so the flight is the same as on a free machine"
    )
