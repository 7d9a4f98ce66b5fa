"""Opens a recorded flight: its MCAP file, or the flight flown again, or its MAVLink log and video."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from framerunner.recording.events import Recorded, RecordingError
from framerunner.runs.run_files import RunFiles
from offboard.app import INTERRUPTED
from offboard.mission import MissionError, load_mission
from offboard.pilot_file import PilotSource
from scenarios.loader import load_scenario
from scenarios.result import FlightResult, ResultError

if TYPE_CHECKING:
    from framerunner.recording.mcap_reader import McapRecording


@contextmanager
def recorded_flight(path: Path, pilot: PilotSource | None = None) -> Iterator[Recorded]:
    """Open a recorded flight.

    A run folder is read from its `flight.mcap`; without one, a lockstep flight is flown again, which gives
    the same flight, and a real-time flight is read from its log and video.

    Args:
        path: a run folder or an MCAP file.
        pilot: a contestant's file, to fly again a mission that needs one.

    Raises:
        RecordingError: there is no flight, it is damaged, or it cannot be flown again.
        ScenarioError: the scenario of a run folder is damaged.
        KeyboardInterrupt: Ctrl-C was pressed while it was flown again.
    """
    if path.is_file():
        with _mcap(path) as recorded:
            yield recorded
        return
    if not path.is_dir():
        raise RecordingError(f"replay '{path}': does not exist; name a run folder or an .mcap file")
    files = RunFiles(path)
    result = _read_result(files)
    # A real-time flight whose program was killed has no result, and its recording is incomplete.
    was_killed = result is None and files.tlog.is_file()
    if files.recording.is_file() and not (was_killed and _is_incomplete(files.recording)):
        with _mcap(files.recording) as recorded:
            yield recorded
    elif result is not None and result.state_sha256 and files.mission.is_file():
        with TemporaryDirectory(prefix="framerunner-replay-") as folder:
            again = RunFiles(Path(folder)).recording
            _fly_again(files, result, again, pilot)
            with _mcap(again) as recorded:
                yield recorded
    elif files.tlog.is_file():
        yield _tlog(files, result)
    elif result is not None:
        raise RecordingError(
            f"replay '{path}': holds a result, but neither recording nor log; fly it again with --record"
        )
    else:
        raise RecordingError(f"replay '{path}': holds no flight; name a folder that `framerunner fly` left")


def _read_result(files: RunFiles) -> FlightResult | None:
    try:
        return files.load_result()
    except (OSError, ResultError) as error:
        reason = " ".join(str(error).split())
        raise RecordingError(f"replay '{files.result}': damaged: {reason:.120}") from None


# Reading and writing MCAP needs an extra, which flights and their logs do not.


def _is_incomplete(recording: Path) -> bool:
    from mcap.writer import MCAP0_MAGIC

    from framerunner.recording.mcap_file import first_and_last_bytes

    return first_and_last_bytes(recording)[1] != MCAP0_MAGIC


def _mcap(path: Path) -> closing[McapRecording]:
    from framerunner.recording.mcap_reader import McapRecording

    return closing(McapRecording(path))


def _tlog(files: RunFiles, result: FlightResult | None) -> Recorded:
    from rich.console import Console

    from framerunner.recording.tlog_reader import TlogRecording

    scenario = files.load_scenario()
    with Console(stderr=True).status(f"reading {files.tlog.name}"):
        return TlogRecording(files, scenario, result)


def _fly_again(files: RunFiles, result: FlightResult, path: Path, pilot: PilotSource | None) -> None:
    """Fly the lockstep flight of a run folder again and record it; it must be the same to the last bit."""
    from framerunner.flying.display import LockstepProgress
    from framerunner.flying.lockstep import fly_lockstep
    from framerunner.flying.plan import FlightPlan
    from framerunner.recording.mcap_writer import FlightRecording

    folder = files.path
    if result.ended == "aborted" and INTERRUPTED in result.reason:
        raise RecordingError(
            f"replay '{folder}': the flight was stopped by hand, which no other flight repeats; "
            "fly with --record to keep such flights"
        )
    scenario = load_scenario(files.scenario)
    try:
        mission = load_mission(files.mission, pilot)
    except MissionError as error:
        first = str(error).split("\n", maxsplit=1)[0]
        todo = "; name its Python file with --pilot" if files.pilot.exists() and not pilot else ""
        raise RecordingError(f"replay '{folder}': its mission cannot be flown again: {first}{todo}") from None
    seed = result.seed
    if seed is None:
        raise RecordingError(f"replay '{folder}': result.json has no seed; fly it again with --record")
    with FlightRecording(path, scenario, mission, seed) as recording:
        with LockstepProgress(scenario.try_limit_s) as progress:
            observers = (recording.see, progress.see)
            plan = FlightPlan(scenario, mission, seed, calibration=files.load_calibration())
            flown = fly_lockstep(plan, observers=observers, on_image=recording.see_image)
        if flown.outcome.interrupted:
            raise KeyboardInterrupt
        recording.finish(flown.result, flown.track)
    if recording.problem:
        raise RecordingError(recording.problem)
    if flown.result.state_sha256 != result.state_sha256:
        raise RecordingError(
            f"replay '{folder}': flown again, it is another flight (state_sha256 differs): it was flown with "
            f"version {result.version}, this is {flown.result.version}; fly it again with --record"
        )
