"""One flight of an evaluation: a pure function of scenario, mission and seed that never raises."""

from __future__ import annotations

import threading
import traceback
from importlib import metadata

from framerunner.evaluation.rows import Row
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from framerunner.runs.track import Track
from scenarios.verdict import Verdict

TRACK_STEP_S = 0.2
"""Between two samples that are kept for a picture."""
_ONE_AT_A_TIME = threading.Lock()
"""A cluster's worker may have several threads; JSBSim promises nothing about being used by two of them."""


def fly_task(plan: FlightPlan) -> Row:
    """Fly, and tell of it, whatever happens.

    Args:
        plan: what to fly; with a mission.

    Returns:
        The flight's row; with the verdict "error" and a traceback if the program failed.

    Raises:
        KeyboardInterrupt: somebody pressed Ctrl-C.
    """
    try:
        with _ONE_AT_A_TIME:
            flown = fly_lockstep(plan)
        if flown.outcome.interrupted:
            raise KeyboardInterrupt
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # a contestant's code may raise anything, SystemExit too
        return broken_off(plan, error)
    track = None if flown.result.completed else thinned(flown.track)
    return Row(**dict(flown.result), track=track)


def broken_off(plan: FlightPlan, error: BaseException) -> Row:
    """The row of a flight that a fault of the program ended."""
    text = " ".join(str(error).split())
    kind = type(error).__name__
    return Row(
        scenario=plan.scenario.name,
        mission="" if plan.mission is None else plan.mission.name,
        seed=plan.seed,
        verdict=Verdict.ERROR,
        reason=f"{kind}: {text}" if text else kind,
        ended="error",
        version=metadata.version("framerunner"),
        traceback="".join(traceback.format_exception(error)),
    )


def thinned(track: Track, step_s: float = TRACK_STEP_S) -> Track:
    """Leave out what a picture does not need; changes of state stay where they are.

    Args:
        track: as recorded.
        step_s: between two samples that stay.

    Returns:
        Rounded to milliseconds and millimetres.
    """
    states, times = track.mission_state, track.time_s
    kept: list[int] = []
    for index in range(len(track)):
        is_edge = index in (0, len(track) - 1) or states[index] != states[index - 1]
        if is_edge or times[index] - times[kept[-1]] >= step_s - 1e-6:
            kept.append(index)
    columns = ([round(column[index], 3) for index in kept] for column in (times, track.x, track.y, track.z))
    time_s, x, y, z = columns
    return Track(time_s, x, y, z, [states[index] for index in kept])
