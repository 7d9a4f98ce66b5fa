"""What `import framerunner` offers to fly: one flight, and many."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from joblib import cpu_count

from framerunner.errors import SettingError
from framerunner.evaluation.backends import Pool, check_pool
from framerunner.evaluation.plan import plan_flights
from framerunner.evaluation.rows import EvaluationRow
from framerunner.evaluation.runner import fly_all
from framerunner.evaluation.statistics import Summary, summarise
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.mission import Mission, load_mission
from offboard.pilot import Pilot
from scenarios.loader import load_scenario
from scenarios.models import Scenario
from scenarios.result import FlightResult
from vision.detectors import DetectorMaker

PilotLike = type[Pilot] | str | Path
DetectorLike = DetectorMaker | str


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Many flights of a mission.

    Attributes:
        rows: the result of each flight, in the scenarios' order; the verdict is `error`, with a `traceback`,
            if a fault of the program ended it.
        summary: counts, rates with 95 % confidence intervals, spreads of times and errors, and causes.
    """

    rows: tuple[EvaluationRow, ...]
    summary: Summary


def fly(
    scenario: str | Path | Scenario,
    mission: str | Path | Mission = "explorer",
    *,
    pilot: PilotLike | None = None,
    detector: DetectorLike | None = None,
    seed: int = 0,
) -> FlightResult:
    """Fly a mission in lockstep: in this process, as fast as the machine can, the same each time.

    Args:
        scenario: name or file as of `load_scenario`, or a scenario.
        mission: name or file as of `load_mission`, or a mission.
        pilot: the mission's own primitives and values: a subclass of `Pilot`, a Python file, which is
            executed, or the name of one that a package adds.
        detector: with which the mission sees instead of its own: a function of a `Calibration` that returns
            the detector, or the name of one that a package adds.
        seed: of everything random.

    Returns:
        The verdict with its reason, times, crossings and contacts, as in `result.json`.

    Raises:
        UserError: scenario, mission, pilot, detector or seed cannot be used; one line that says what to do.
    """
    _check_whole("seed", seed)
    chosen = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    flown = fly_lockstep(FlightPlan(chosen, _mission(mission, pilot), seed, detector=detector))
    if flown.outcome.interrupted:
        raise KeyboardInterrupt
    return flown.result


def evaluate(
    *scenarios: str | Path | Scenario,
    level: str | Path | None = None,
    count: int | None = None,
    seed: int | None = None,
    mission: str | Path | Mission = "explorer",
    pilot: PilotLike | None = None,
    detector: DetectorLike | None = None,
    jobs: int | None = None,
) -> Evaluation:
    """Fly a mission in lockstep on many scenarios, on all cores; nothing is written.

    Args:
        *scenarios: names, files or folders of scenarios, or scenarios; instead of a level.
        level: draw scenarios of this level, name or file.
        count: how many of the level; 100 if not given.
        seed: of the first scenario of the level, each next one has one more; 1 if not given.
        mission: see `fly`.
        pilot: see `fly`.
        detector: see `fly`.
        jobs: flights at once; as many as there are cores if not given.

    Raises:
        UserError: see `fly`; or neither scenarios nor a level are given, or both.
    """
    for name, value in (("count", count), ("seed", seed), ("jobs", jobs)):
        _check_whole(name, value)
    plan = plan_flights(scenarios, level, seed, count, _mission(mission, pilot))
    pool = Pool(jobs=cpu_count() if jobs is None else jobs)
    check_pool(pool)
    tasks = (replace(task, detector=detector) for task in plan.tasks())
    rows = {row.scenario: row for row in fly_all(tasks, pool)}
    ordered = tuple(rows[each.name] for each in plan.scenarios)
    return Evaluation(ordered, summarise(ordered))


def _check_whole(name: str, value: int | None) -> None:
    """Refuse what is no whole number from 0 to the largest seed; None is not given."""
    if value is not None and not (type(value) is int and 0 <= value < 2**63):
        raise SettingError(f"{name} {value!r:.40}: must be a whole number from 0 to {2**63 - 1}")


def _mission(mission: str | Path | Mission, pilot: PilotLike | None) -> Mission:
    if not isinstance(mission, Mission):
        return load_mission(mission, pilot)
    if pilot is not None:
        raise SettingError(f"pilot: mission {mission.name} has one already; give it to load_mission instead")
    return mission
