"""Keeps the flights that pages started, as run folders of a temporary folder, for the monitor's replay.

A flight under control is recorded as it is flown, without images: it may be stopped, or its chart changed.
Of a flight of a batch only the plan and the result are kept: it is flown again when somebody looks at it.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from framerunner.errors import UserError
from framerunner.flying.fly import FinishedFlight
from framerunner.flying.plan import FlightPlan
from framerunner.runs.run_folder import RunFolder
from offboard.app import Moment, Observer
from offboard.mission import Mission
from scenarios.models import Scenario
from scenarios.result import FlightResult

if TYPE_CHECKING:  # slow to import; the server does not need it
    from framerunner.recording.mcap_writer import FlightRecording

MAX_KEPT = 300  # flights of a session
_PART = "flight.mcap.part"
_MARK = "page"  # at the end of a folder's name, so that it is not that of one of `framerunner fly`


class KeptFlight:
    """The recording of a flight under control; a disk that refuses it is no reason not to fly.

    Args:
        folder: of the session's flights; None: nothing is kept.
        plan: with a mission.
        text: of the mission.
    """

    def __init__(self, folder: Path | None, plan: FlightPlan, text: str) -> None:
        self._run: RunFolder | None = None
        self._recording: FlightRecording | None = None
        if folder is None:
            return
        from framerunner.recording.mcap_writer import FlightRecording

        try:
            self._run = RunFolder(folder, f"{plan.scenario.name}-{_MARK}")
            self._run.mission.write_text(text, encoding="utf-8")
            mission = replace(plan.chart, path=self._run.mission)
            self._run.write_plan(plan.scenario, mission)
            self._recording = FlightRecording(self._run.path / _PART, plan.scenario, mission, plan.seed)
        except (UserError, OSError) as error:
            self._give_up(str(error))

    @property
    def observers(self) -> Sequence[Observer]:
        """Called at every tick."""
        return () if self._recording is None else (self._see,)

    def finish(self, flown: FinishedFlight | None) -> None:
        """End the recording; None: a fault of the program ended the flight, and it has no result."""
        run, recording = self._run, self._recording
        if run is None or recording is None:
            return
        try:
            if flown is not None:
                recording.finish(flown.result, flown.track)
            recording.close()
            if recording.problem:
                self._give_up(recording.problem)
                return
            if flown is not None:
                run.write_result(flown.result)
            part = run.path / _PART
            if part.exists():  # not if it ended before its first tick
                part.rename(run.recording)
            run.remove_if_empty()
        except OSError as error:
            self._give_up(error.strerror or str(error))

    def _see(self, moment: Moment) -> None:
        if self._recording is not None:
            self._recording.see(moment)

    def _give_up(self, why: str) -> None:
        print(f"warning: the flight is not kept for replays: {why}", file=sys.stderr, flush=True)
        if self._recording is not None:
            self._recording.close()
        if self._run is not None:
            shutil.rmtree(self._run.path, ignore_errors=True)
        self._run = self._recording = None


def keep_result(
    folder: Path | None, scenario: Scenario, mission: Mission, text: str, result: FlightResult
) -> str:
    """Keep plan and result of a lockstep flight; returns the name of its folder, "" if it is not kept."""
    if folder is None or not result.state_sha256:
        return ""
    run: RunFolder | None = None
    try:
        run = RunFolder(folder, f"{scenario.name}-{_MARK}")
        run.mission.write_text(text, encoding="utf-8")
        run.write_plan(scenario, replace(mission, path=run.mission))
        run.write_result(result)
    except (UserError, OSError) as error:
        print(f"warning: the flight is not kept for replays: {error}", file=sys.stderr, flush=True)
        if run is not None:
            shutil.rmtree(run.path, ignore_errors=True)
        return ""
    return run.path.name


def forget_old(folder: Path, kept: int = MAX_KEPT) -> None:
    """Remove the oldest flights of a session's folder."""
    try:
        runs = sorted(each for each in folder.iterdir() if each.is_dir())
    except OSError:
        return
    for run in runs[: max(0, len(runs) - kept)]:
        shutil.rmtree(run, ignore_errors=True)
