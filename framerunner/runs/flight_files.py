"""The files that a flight leaves. One that cannot be written costs one line, never the verdict."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from framerunner.extras import advice
from framerunner.runs.pictures import Outcome, PictureError, Track, track_picture
from framerunner.runs.run_folder import RunFolder
from scenarios.models import Scenario


def write_outcome(folder: RunFolder, scenario: Scenario, track: Track, result: dict[str, Any]) -> None:
    """Write `result.json` and `track.png`; say on standard error what could not be written.

    Args:
        folder: of the flight.
        scenario: what was flown, its frames where they were.
        track: where the drone was.
        result: as in `result.json`.
    """
    _try(folder.result, lambda: folder.write_result(result))
    _try(folder.track, lambda: track_picture(scenario, track, Outcome.from_result(result), folder.track))


def warn(problem: str) -> None:
    """Say in one line what a flight does not leave; nothing if there is no problem."""
    if problem:
        print(f"warning: {problem}", file=sys.stderr, flush=True)


def left_lines(folder: RunFolder, result: dict[str, Any]) -> list[str]:
    """Say where a flight's files are, and how to see it again; nothing that is not there.

    Args:
        folder: of the flight; it may be gone.
        result: as in `result.json`.
    """
    lines = [f"left in {folder.path}/"] if folder.path.is_dir() else []
    # A lockstep flight is flown again from its plan.
    shown_from = (folder.recording, folder.tlog) if result["seed"] is None else (folder.result,)
    if any(path.is_file() and path.stat().st_size for path in shown_from):
        command = shlex.join(["framerunner", "replay", str(folder.path)])
        lines.append(f"see it again: {command}")
    return lines


def _try(path: Path, write: Callable[[], None]) -> None:
    try:
        write()
    except PictureError as error:
        path.unlink(missing_ok=True)  # half a picture
        warn(str(error))
    except ModuleNotFoundError as error:
        missing = advice(error.name or "")
        if missing is None:
            raise
        warn(f"{path.name} was not drawn: {missing}")
    except OSError as error:
        warn(f"cannot write '{path}': {error.strerror or error}")
