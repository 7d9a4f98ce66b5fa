"""Many flights of a mission that is being edited, by the runner of evaluations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from framerunner.editing import editor_messages
from framerunner.editing.places import find_scenario
from framerunner.editing.session_runs import keep_result
from framerunner.evaluation.backends import Pool
from framerunner.evaluation.plan import EvaluationPlan, plan_level
from framerunner.evaluation.rows import EvaluationRow
from framerunner.evaluation.runner import Terms, fly_all
from framerunner.flying.cause import lost_in
from framerunner.runs.track import Track
from framerunner.wire.finite_json import finite
from offboard.mission import Mission
from scenarios.models import Scenario
from scenarios.random_numbers import LevelError
from scenarios.random_scenarios import LEVEL_FILES
from scenarios.verdict import Verdict

_RANKS = {verdict: rank for rank, verdict in enumerate(reversed(Verdict))}


def fly_batch(task: editor_messages.BatchTask, mission: Mission, tell: Callable[[BaseModel], None]) -> None:
    """Fly all of a batch; each flight is told as it ends.

    Raises:
        UserError: a scenario or level is not known.
    """
    plan = _plan(task.start, mission)
    tell(editor_messages.BatchStarted(tag=task.start.tag, batch=task.batch, count=len(plan)))
    scenarios = {scenario.name: scenario for scenario in plan.scenarios}
    ranks: dict[str, float] = {}
    completed = 0
    pool, terms = Pool(jobs=min(task.jobs, len(plan))), Terms(task.processor_s, whole=True)
    folder = None if task.keep is None else Path(task.keep)
    for row in fly_all(plan.tasks(), pool, terms):
        scenario = scenarios[row.scenario]
        replay = keep_result(folder, scenario, mission, task.start.text, row)
        flight = _flight(task.batch, row, scenario, replay)
        ranks[row.scenario] = flight.rank
        completed += flight.completed
        tell(flight)
    order = tuple(sorted(ranks, key=ranks.__getitem__))
    tell(
        editor_messages.BatchEnded(
            batch=task.batch,
            flown=len(ranks),
            completed=completed,
            count=len(plan),
            text="",
            order=order,
        )
    )


def _plan(start: editor_messages.StartBatch, mission: Mission) -> EvaluationPlan:
    """Only names of the package are looked up, and no files."""
    if start.scenarios:
        scenarios = [find_scenario(name) for name in dict.fromkeys(start.scenarios)]
        return EvaluationPlan("scenarios", "scenarios", scenarios, mission, [0] * len(scenarios))
    if start.level not in LEVEL_FILES.names():
        known = ", ".join(LEVEL_FILES.names())
        raise LevelError(f"level '{start.level}': is not known; there are {known}")
    return plan_level(start.level, start.first_seed, start.count, mission)


def rank_of(row: EvaluationRow) -> float:
    """Failures first: by verdict, the worst first; of one verdict the flights that took longest."""
    verdict = Verdict(row.verdict)
    part = 0.0 if verdict is Verdict.ERROR else 1.0 / (1.0 + max(row.total_time_s, 0.0))
    return _RANKS[verdict] + part


def _flight(batch: str, row: EvaluationRow, scenario: Scenario, replay: str) -> editor_messages.Flight:
    track = row.track or Track()
    return editor_messages.Flight(
        batch=batch,
        scenario=row.scenario,
        seed=row.seed or 0,
        verdict=str(row.verdict),
        completed=row.completed,
        reason=row.reason,
        cause=row.cause,
        lost_in=lost_in(row, track),
        rank=rank_of(row),
        total_time_s=row.total_time_s if row.completed else None,
        frames_crossed=tuple(row.frames_crossed),
        counts=dict(row.transitions),
        track=_track(track.as_flown()),
        layout=scenario.model_dump(mode="json"),
        result=row.as_json(),
        replay=replay,
    )


def _track(track: Track) -> editor_messages.FlownTrack:
    states = tuple(dict.fromkeys(track.mission_state))
    numbers = {state: number for number, state in enumerate(states)}
    columns: list[Any] = [tuple(finite(list(each))) for each in (track.time_s, track.x, track.y, track.z)]
    time_s, x, y, z = columns
    return editor_messages.FlownTrack(
        time_s=time_s,
        x=x,
        y=y,
        z=z,
        state=tuple(numbers[state] for state in track.mission_state),
        states=states,
    )
