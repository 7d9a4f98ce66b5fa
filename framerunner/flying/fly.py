"""One flight as planned: the mission flown, the flight judged, its result put together.

Real time and lockstep differ in drone, perception and judge. The Gymnasium environment cannot use this: here
the mission is called at every tick, while an agent calls the environment.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from math import hypot
from typing import Any

from framerunner.flying.cause import CauseWatch, Flown
from framerunner.flying.envelopes import bound_s
from framerunner.flying.judges import Judge
from framerunner.flying.plan import FlightPlan
from framerunner.runs.run_folder import UNFINISHED
from framerunner.runs.track import Track, TrackRecorder
from offboard.app import MissionEnd, Moment, Observer, TickHook, fly_mission
from offboard.drone import Drone
from offboard.perception import Perception
from offboard.safety.rules import SIMULATED, SafetyRules
from scenarios.faults.table import fault_fields
from scenarios.models import Scenario
from scenarios.result import FlightResult, RefereeReport

KEEP_US = 1_000_000  # vehicle time
Run = Callable[[Coroutine[Any, Any, MissionEnd]], Awaitable[MissionEnd]]


@dataclass(frozen=True, slots=True)
class FinishedFlight:
    """A flight that is over."""

    result: FlightResult  # without wall times
    outcome: MissionEnd  # how the mission ended
    track: Track  # where the drone was, 20 times a second
    layout: Scenario  # as it was flown


async def fly(
    plan: FlightPlan,
    drone: Drone,
    perception: Perception,
    judge: Judge,
    observers: Sequence[Observer] = (),
    *,
    run: Run | None = None,
    measured: Callable[[], Mapping[str, Any]] = dict,
    before_tick: TickHook | None = None,
    safety: SafetyRules = SIMULATED,
    keep: Callable[[FlightResult], None] | None = None,
) -> FinishedFlight:
    """Fly a plan's mission from connecting to the verdict.

    Args:
        plan: with a mission.
        drone: not yet connected.
        perception: through which the mission sees.
        judge: is shown every tick, and reports at the end.
        observers: called at every tick, in this order; must be quick.
        run: awaits the flight itself, without the judgement; for what must be done around it.
        measured: called at the end; further fields of the result, such as `timing`.
        before_tick: awaited before each tick of the mission; it may wait only in lockstep.
        safety: the operator, and what the drone does when the flight is aborted.
        keep: called once a second with the result that the flight has if this program is ended now.

    Raises:
        DroneError, CameraLostError: the drone cannot be made ready, or there is no image at the start.
        ValueError: the plan has no mission.
    """
    recorder, causes = TrackRecorder(), CauseWatch()
    kept = () if keep is None else (_Keeper(plan, judge, recorder, keep).see,)
    watching = (recorder.see, causes.see, *observers, judge.see, *kept)

    def observe(moment: Moment) -> None:
        for see in watching:
            see(moment)

    flight = fly_mission(
        drone,
        perception,
        plan.chart,
        limit_s=plan.limit_s,
        observer=observe,
        limits=plan.command_limits,
        surroundings=plan.surroundings,
        before_tick=before_tick,
        safety=safety,
    )
    outcome = await (flight if run is None else run(flight))
    why = None if outcome.ended == "finished" else outcome.reason
    report = await judge.report(outcome.mission_state, why)
    standing = await judge.standing()
    track = recorder.track(
        began_us := None if standing is None else standing.began_us, true_path=judge.flown_path()
    )
    more = {**fault_fields(await judge.faults(), report, plan.scenario.sensors), **measured()}
    flown = Flown(plan.layout, report, outcome, track, began_us)
    more |= {"cause": causes.words(flown), "false_gates": causes.false_gates(flown)}
    more |= {"judged_by": judge.source, **_bound(plan, report)}
    more |= _place(track, report, recorder.largest_std_m)
    return FinishedFlight(_result(plan, report, outcome, track, measured=more), outcome, track, plan.layout)


class _Keeper:
    """Passes on, once a second of vehicle time, the result of a flight that is not finished."""

    def __init__(
        self, plan: FlightPlan, judge: Judge, recorder: TrackRecorder, keep: Callable[[FlightResult], None]
    ) -> None:
        self._plan, self._judge, self._recorder, self._keep = plan, judge, recorder, keep
        self._next_us = 0
        self._words = {"cause": UNFINISHED, "judged_by": "telemetry"}

    def see(self, moment: Moment) -> None:
        """Take a tick."""
        time_us, state = moment.state.time_us, moment.mission_state
        if time_us < self._next_us:
            return
        self._next_us = time_us + KEEP_US
        end = MissionEnd("aborted", UNFINISHED, state, moment.flight_time_s, 0)
        report = self._judge.so_far(state, UNFINISHED)
        track = self._recorder.track(time_us - round(moment.flight_time_s * 1e6))
        self._keep(_result(self._plan, report, end, track, measured=self._words))


def _result(
    plan: FlightPlan,
    report: RefereeReport,
    end: MissionEnd,
    track: Track,
    *,
    measured: Mapping[str, Any],
) -> FlightResult:
    """The contents of `result.json`, but for wall times."""
    return FlightResult(
        scenario=plan.scenario.name,
        mission=plan.chart.name,
        mission_class=plan.chart.mission_class,
        seed=plan.seed,
        **dict(report),
        mission_state=end.mission_state,
        ended=end.ended,
        seconds_in_state=track.seconds_in_state(),
        kept_in_box_s=end.kept_in_box_s,
        response=str(plan.response or ""),
        version=_version(),
        **({"lift_m": plan.lift_m} if plan.lift_m else {}),
        **measured,
    )


def _bound(plan: FlightPlan, report: RefereeReport) -> dict[str, float | None]:
    least_s = bound_s(plan, plan.chart.mission_class)
    times = round(report.try_time_s / least_s, 3) if least_s and report.completed else None
    return {"bound_s": least_s, "times_bound": times}


def _place(track: Track, report: RefereeReport, largest_std_m: float | None) -> dict[str, Any]:
    """How exactly the drone's place was known, as far as that is known."""
    flown_by = track.estimated_path or track.reported_path
    times_s = (*report.crossing_times_s, min(flown_by[-1][0], report.try_time_s)) if flown_by else ()
    errors_m = [round(hypot(*error_m), 4) for error_m in map(track.place_error_m, times_s) if error_m]
    most_m = track.largest_error_m(track.reported_path)
    return {
        "place_errors_m": tuple(errors_m[:-1]),
        "last_place_error_m": errors_m[-1] if errors_m else None,
        "largest_place_std_m": None if largest_std_m is None else round(largest_std_m, 4),
        "largest_reported_error_m": None if most_m is None else round(most_m, 4),
    }


@cache
def _version() -> str:
    return metadata.version("framerunner")
