"""Lockstep flights need no recording: flown again, they are the same to the last bit."""

from __future__ import annotations

from pathlib import Path

from framerunner.flying.display import LockstepProgress
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from framerunner.recording.errors import RecordingError
from framerunner.recording.mcap_writer import FlightRecording
from offboard.app import INTERRUPTED
from offboard.mission import MissionError, load_mission
from offboard.pilot_file import PilotFile
from scenarios.loader import load_scenario
from scenarios.result import FlightResult


def fly_again(folder: Path, result: FlightResult, path: Path, pilot: PilotFile | None) -> None:
    """Fly a flight again and record it.

    Args:
        folder: of the first flight, with `scenario.yaml` and `mission.yaml`.
        result: of the first flight.
        path: the recording to write.
        pilot: a contestant's file, if the mission needs one.

    Raises:
        RecordingError: it cannot be flown, or it was another flight.
        ScenarioError: the scenario is damaged.
        KeyboardInterrupt: somebody pressed Ctrl-C.
    """
    if result.ended == "aborted" and INTERRUPTED in result.reason:
        raise RecordingError(
            f"replay '{folder}': the flight was stopped by hand, which no other flight repeats; "
            "fly with --record to keep such flights"
        )
    scenario = load_scenario(folder / "scenario.yaml")
    try:
        mission = load_mission(folder / "mission.yaml", pilot)
    except MissionError as error:
        first = str(error).split("\n", maxsplit=1)[0]
        todo = "; name its Python file with --pilot" if (folder / "pilot.py").exists() and not pilot else ""
        raise RecordingError(f"replay '{folder}': its mission cannot be flown again: {first}{todo}") from None
    seed = result.seed
    if seed is None:
        raise RecordingError(f"replay '{folder}': result.json has no seed; fly it again with --record")
    with FlightRecording(path, scenario, mission, seed) as recording:
        with LockstepProgress(scenario.try_limit_s) as progress:
            observers = (recording.see, progress.see)
            plan = FlightPlan(scenario, mission, seed)
            flown = fly_lockstep(plan, observers=observers, on_image=recording.see_image)
        if flown.outcome.interrupted:
            raise KeyboardInterrupt
        recording.finish(flown.result, flown.track.time_s)
    if recording.problem:
        raise RecordingError(recording.problem)
    if flown.result.state_sha256 != result.state_sha256:
        raise RecordingError(
            f"replay '{folder}': flown again, it is another flight (state_sha256 differs): it was flown with "
            f"version {result.version}, this is {flown.result.version}; fly it again with --record"
        )
