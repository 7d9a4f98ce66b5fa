"""How a flight can be shown again: from its recording, by flying it again, or from log and video."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from os import SEEK_END
from pathlib import Path
from tempfile import TemporaryDirectory

from mcap.writer import MCAP0_MAGIC

from framerunner.recording.errors import RecordingError
from framerunner.recording.events import Recorded
from offboard.pilot_file import PilotFile
from scenarios.result import MAX_RESULT_BYTES, FlightResult, ResultError


@contextmanager
def recorded_flight(path: Path, pilot: PilotFile | None = None) -> Iterator[Recorded]:
    """Open a recorded flight.

    A run folder is shown from its `flight.mcap`; without one, a lockstep flight is flown again, and of a
    real-time flight log and video are shown.

    Args:
        path: a run folder or an MCAP file.
        pilot: a contestant's file, to fly again a mission that needs one.

    Raises:
        RecordingError: there is nothing to show, or it is damaged.
    """
    if path.is_file():
        with _mcap(path) as recorded:
            yield recorded
        return
    if not path.is_dir():
        raise RecordingError(f"replay '{path}': does not exist; name a run folder or an .mcap file")
    result = read_result(path)
    if (path / "flight.mcap").is_file() and not _was_killed(path, result):
        with _mcap(path / "flight.mcap") as recorded:
            yield recorded
        return
    if result is not None and result.state_sha256 and (path / "mission.yaml").is_file():
        with (
            TemporaryDirectory(prefix="framerunner-replay-") as folder,
            _again(path, result, folder, pilot) as recorded,
        ):
            yield recorded
        return
    if (path / "flight.tlog").is_file():
        yield _tlog(path, result)
        return
    if result is not None:
        raise RecordingError(
            f"replay '{path}': holds a result, but neither recording nor log; fly it again with --record"
        )
    raise RecordingError(f"replay '{path}': holds no flight; name a folder that `framerunner fly` left")


def _was_killed(path: Path, result: FlightResult | None) -> bool:
    """Whether log and video tell of a real-time flight whose recording was not finished."""
    if result is not None or not (path / "flight.tlog").is_file():
        return False
    with (path / "flight.mcap").open("rb") as file:
        file.seek(max(0, file.seek(0, SEEK_END) - len(MCAP0_MAGIC)))
        return file.read() != MCAP0_MAGIC


@contextmanager
def _mcap(path: Path) -> Iterator[Recorded]:
    from framerunner.recording.mcap_reader import McapRecording

    recorded = McapRecording(path)
    try:
        yield recorded
    finally:
        recorded.close()


@contextmanager
def _again(path: Path, result: FlightResult, folder: str, pilot: PilotFile | None) -> Iterator[Recorded]:
    from framerunner.recording.again import fly_again

    target = Path(folder) / "flight.mcap"
    fly_again(path, result, target, pilot)
    with _mcap(target) as recorded:
        yield recorded


def _tlog(path: Path, result: FlightResult | None) -> Recorded:
    from rich.console import Console

    from framerunner.recording.tlog_reader import TlogRecording
    from scenarios.loader import load_scenario

    scenario_file = path / "scenario.yaml"
    scenario = load_scenario(scenario_file) if scenario_file.is_file() else None
    with Console(stderr=True).status("reading flight.tlog"):
        return TlogRecording(path, scenario, result)


def read_result(folder: Path) -> FlightResult | None:
    """Read a run folder's `result.json`; None if it has none.

    Raises:
        RecordingError: it is damaged.
    """
    path = folder / "result.json"
    if not path.is_file():
        return None
    try:
        with path.open("rb") as file:
            return FlightResult.parse(file.read(MAX_RESULT_BYTES + 1))
    except (OSError, ResultError) as error:
        reason = " ".join(str(error).split())
        raise RecordingError(f"replay '{path}': damaged: {reason:.120}") from None
