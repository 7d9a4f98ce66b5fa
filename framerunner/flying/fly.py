"""One flight as planned: flown, then judged.

Real time and lockstep differ in the drone, the eyes and the judge that they bring. The Gymnasium environment,
whose agent is asked tick by tick, has the plan and the drone in common with lockstep, but not this.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from typing import Any

from framerunner.flying.judges import Judge
from framerunner.flying.plan import FlightPlan
from framerunner.runs.pictures import Track
from framerunner.runs.recorder import TrackRecorder
from offboard.app import Moment, Observer, Outcome, fly_mission
from offboard.drone import Drone
from offboard.eyes import Eyes

Run = Callable[[Coroutine[Any, Any, Outcome]], Awaitable[Outcome]]


@dataclass(frozen=True, slots=True)
class Flown:
    """A flight that is over.

    Attributes:
        result: what stands in `result.json`, but for what tells of wall time.
        outcome: how the mission ended.
        track: where the drone was, 20 times a second.
    """

    result: dict[str, Any]
    outcome: Outcome
    track: Track


async def fly(
    plan: FlightPlan,
    drone: Drone,
    eyes: Eyes,
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
        measured: called at the end; what stands in the result besides.

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

    flight = fly_mission(
        drone, None, mission, limit_s=plan.limit_s, observer=observe, eyes=eyes, box=plan.box
    )
    outcome = await (flight if run is None else run(flight))
    report = await judge.report(
        outcome.mission_state, None if outcome.ended == "finished" else outcome.reason
    )
    standing = await judge.standing()
    track = recorder.track(None if standing is None else standing.began_us)
    result = {
        "scenario": plan.scenario.name,
        "mission": mission.name,
        "seed": plan.seed,
        **report,
        "mission_state": outcome.mission_state,
        "ended": outcome.ended,
        "seconds_in_state": track.seconds_in_state(),
        "kept_in_box_s": outcome.kept_in_box_s,
        "judged_by": judge.source,
        **({"lift_m": plan.lift_m} if plan.lift_m else {}),
        **measured(),
        "version": metadata.version("framerunner"),
    }
    return Flown(result, outcome, track)
