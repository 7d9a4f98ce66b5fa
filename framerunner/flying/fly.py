"""One flight as planned: flown, then judged.

Real time and lockstep differ in the drone, the eyes and the judge that they bring. The Gymnasium environment,
whose agent is asked tick by tick, has the plan and the drone in common with lockstep, but not this.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from framerunner.flying.flight_result import flight_result
from framerunner.flying.judges import Judge
from framerunner.flying.plan import FlightPlan
from framerunner.runs.track import Track, TrackRecorder
from offboard.app import MissionEnd, Moment, Observer, fly_mission
from offboard.drone import Drone
from offboard.perception import Perception
from scenarios.result import FlightResult

Run = Callable[[Coroutine[Any, Any, MissionEnd]], Awaitable[MissionEnd]]


@dataclass(frozen=True, slots=True)
class Flown:
    """A flight that is over.

    Attributes:
        result: without wall times.
        outcome: how the mission ended.
        track: where the drone was, 20 times a second.
    """

    result: FlightResult
    outcome: MissionEnd
    track: Track


async def fly(
    plan: FlightPlan,
    drone: Drone,
    eyes: Perception,
    judge: Judge,
    observers: Sequence[Observer] = (),
    *,
    run: Run | None = None,
    measured: Callable[[], Mapping[str, Any]] = dict,
) -> Flown:
    """Fly a plan's mission from connecting to the verdict.

    Args:
        plan: with a mission.
        drone: not yet connected.
        eyes: through which the mission sees.
        judge: is shown every tick, and asked at the end.
        observers: called at every tick, in this order; must be quick.
        run: awaits the flight itself, without the judgement; for what must be done around it.
        measured: called at the end; more of the result, see `flight_result`.

    Raises:
        DroneError: the drone cannot be reached or made ready.
        CameraLostError: the camera gives no image at the start.
        ValueError: the plan has no mission.
    """
    mission = plan.chart
    recorder = TrackRecorder()
    watching = (recorder.see, *observers, judge.see)

    def observe(moment: Moment) -> None:
        for see in watching:
            see(moment)

    flight = fly_mission(drone, eyes, mission, limit_s=plan.limit_s, observer=observe, box=plan.box)
    outcome = await (flight if run is None else run(flight))
    report = await judge.report(
        outcome.mission_state, None if outcome.ended == "finished" else outcome.reason
    )
    standing = await judge.standing()
    track = recorder.track(None if standing is None else standing.began_us)
    result = flight_result(plan, report, outcome, track, judged_by=judge.source, **measured())
    return Flown(result, outcome, track)
