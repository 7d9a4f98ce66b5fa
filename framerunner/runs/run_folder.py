"""The folder that a flight leaves. A file that cannot be written costs one warning, not the verdict."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from framerunner.errors import SettingError, write_advice
from framerunner.extras import install_advice, is_installed
from framerunner.files.text_file import replace_file
from framerunner.runs import PlotError
from framerunner.runs.run_files import RunFiles
from framerunner.runs.track import Track
from framerunner.terminal import warn
from offboard.mission import Mission
from offboard.pilot_file import PilotFile
from scenarios.loader import dump_yaml
from scenarios.models import Scenario
from scenarios.result import FlightResult, ResultError

UNFINISHED = "the program was ended in flight"
"""Why a flight ended whose result was not written in order."""

_RESERVED_BYTES = 1 << 16  # more than a result has


class RunFolder(RunFiles):
    """`<out>/<time>-<scenario>/`, made when a flight begins.

    Args:
        out: folder of all runs; made if it does not exist.
        scenario: its name.

    Attributes:
        stopped_before_start: the flight was stopped before its first tick; set by the caller.

    Raises:
        SettingError: the folder cannot be made.
    """

    def __init__(self, out: Path, scenario: str) -> None:
        stamp = datetime.now().astimezone().strftime("%Y%m%d-%H%M%S")
        path = out / f"{stamp}-{scenario}"
        self.stopped_before_start = False
        self._made_out = not out.exists()
        try:
            out.mkdir(parents=True, exist_ok=True)
            number = 1
            while True:
                try:
                    path.mkdir()
                    break
                except FileExistsError:  # two flights within a second
                    number += 1
                    path = out / f"{stamp}-{scenario}-{number}"
        except OSError as error:
            raise SettingError(
                f"--out {out}: cannot be written to ({error.strerror}); choose another"
            ) from None
        super().__init__(path)
        self._part = self.result.with_suffix(".part")

    def write_plan(self, scenario: Scenario, mission: Mission) -> None:
        """Write what is to be flown, so that the flight can be judged, replayed and flown again.

        Room for the result is reserved: recordings and videos may fill the disk during the flight.

        Raises:
            SettingError: it cannot be written.
        """
        source = mission.path.read_bytes()
        try:
            self.scenario.write_text(dump_yaml(scenario), encoding="utf-8")
            self.mission.write_bytes(source)
            if isinstance(mission.pilot, PilotFile):
                self.pilot.write_text(mission.pilot.text, encoding="utf-8")
            self._part.write_bytes(bytes(_RESERVED_BYTES))
        except OSError as error:
            raise SettingError(
                f"--out {self.path.parent}: cannot be written to ({error.strerror}); {write_advice(error)}"
            ) from None

    def write_result(self, result: FlightResult) -> None:
        """Write `result.json`, complete or not at all.

        Raises:
            OSError: it cannot be written.
        """
        data = result.text().encode()
        try:
            with self._part.open("r+b" if self._part.exists() else "wb") as file:
                file.write(data)  # into the room that is reserved
                file.truncate()
            os.replace(self._part, self.result)
        except OSError:
            self._part.unlink(missing_ok=True)
            raise
        self.unfinished.unlink(missing_ok=True)

    def keep_unfinished(self, result: FlightResult) -> None:
        """Keep what `result.json` is to be if this program is ended now; it does not matter if that fails."""
        with suppress(OSError):
            replace_file(self.unfinished, result.text())

    def end_unfinished(self, why: str) -> bool:
        """Make what was kept the result, with the reason in it; whether there was something."""
        try:
            kept = FlightResult.parse(self.unfinished.read_bytes())
        except (OSError, ResultError):
            return False
        told = {name: getattr(kept, name).replace(UNFINISHED, why) for name in ("reason", "cause")}
        _try(self.result, lambda: self.write_result(kept.model_copy(update=told)))
        return True

    def remove_if_empty(self) -> None:
        """Remove empty files, and the folder if no result, log or recording remains.

        If the flight was stopped before its first tick, all is removed, also `out` if it was made for it.
        """
        self._part.unlink(missing_ok=True)
        self.unfinished.unlink(missing_ok=True)
        for path in self.path.iterdir():
            if path.is_dir():  # of PX4, with its log
                continue
            if path.stat().st_size == 0 or self.stopped_before_start:
                path.unlink()
        if not any(path.exists() for path in (self.result, self.tlog, self.recording)):
            for path in (self.scenario, self.mission, self.pilot, self.calibration):
                path.unlink(missing_ok=True)
            if not any(self.path.iterdir()):
                self.path.rmdir()
                if self._made_out and not any(self.path.parent.iterdir()):
                    self.path.parent.rmdir()


def write_outcome(folder: RunFolder, scenario: Scenario, track: Track, result: FlightResult) -> bool:
    """Write `result.json` and `track.png`; report on standard error what could not be written.

    The scenario must have its gates where they were in this flight. Returns whether `result.json` is there.
    """

    def plot() -> None:
        from framerunner.runs.plots import draw_track, save_figure

        save_figure(draw_track(scenario, track, result), folder.track)

    _try(folder.result, lambda: folder.write_result(result))
    _try(folder.track, plot)
    return folder.result.exists()


def left_lines(folder: RunFolder, result: FlightResult) -> list[str]:
    """Say where a flight's files are, if it left any, and how to replay it, if that is possible.

    To fly it again needs an extra, to show its log does not.
    """
    lines = [f"left in {folder.path}/"] if folder.path.is_dir() else []
    # A lockstep flight is flown again from its plan.
    shown_from = (folder.recording, folder.tlog) if result.seed is None else (folder.result,)
    if any(path.is_file() and path.stat().st_size for path in shown_from):
        command = shlex.join(["framerunner", "replay", str(folder.path)])
        lacks_extra = shown_from == (folder.result,) and not is_installed("mcap")
        advice = f" ({install_advice('mcap')})" if lacks_extra else ""
        lines.append(f"see it again: {command}{advice}")
    return lines


def _try(path: Path, write: Callable[[], None]) -> None:
    try:
        write()
    except PlotError as error:
        path.unlink(missing_ok=True)  # an incomplete plot
        warn(str(error))
    except OSError as error:
        warn(f"cannot write '{path}': {error.strerror or error}")
