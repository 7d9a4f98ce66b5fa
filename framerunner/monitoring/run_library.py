"""The runs of a folder, for the monitor's replay."""

from __future__ import annotations

import json
import re
import signal
import sys
import threading
import time
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from framerunner.monitoring.read_run import IMAGES, RECORDING, SPANS
from framerunner.monitoring.readers import Readers
from monitor.ports import RunError, RunInfo, RunNotReadError
from scenarios.result import MAX_RESULT_BYTES, FlightResult

KEPT_RUNS = 6
"""As many are kept unpacked, in a folder that vanishes with the program."""
UNREADABLE = "unreadable"
_FAILURE_KEPT_S = 60.0  # so long a run that could not be read is not tried again, unless it changes
_MOST_FAILURES = 100
_MOST_NAME = 80
_SIGNS = ("result.json", "flight.mcap", "flight.tlog")
_FILES = (*_SIGNS, "scenario.yaml", "mission.yaml", "video.avi")
_STAMP = re.compile(r"\d{8}-\d{6}")


@dataclass(frozen=True, slots=True)
class _Seen:
    """A folder as it was when it was last looked at."""

    mark: tuple[int, ...]
    info: RunInfo
    order: float


@dataclass(frozen=True)
class _Unpacked:
    """A run that was read."""

    mark: tuple[int, ...]
    folder: TemporaryDirectory[str]
    recording: Mapping[str, Any]
    spans: Sequence[tuple[int, int]]


@dataclass(frozen=True, slots=True)
class _Failed:
    """A run that could not be read, and when."""

    mark: tuple[int, ...]
    at_s: float
    words: str


@dataclass
class RunFolders:
    """The run folders in a folder, as `monitor.ports.RunLibrary`; may be used from several threads.

    Args:
        path: the folder; it may come to be later.
    """

    path: Path
    _seen: dict[str, _Seen] = field(default_factory=dict, init=False, repr=False)
    _unpacked: OrderedDict[str, _Unpacked] = field(default_factory=OrderedDict, init=False, repr=False)
    _looking: threading.Lock = field(default_factory=threading.Lock, init=False, repr=False)
    _failed: OrderedDict[str, _Failed] = field(default_factory=OrderedDict, init=False, repr=False)
    _readers: Readers = field(default_factory=Readers, init=False, repr=False)

    def runs(self) -> Sequence[RunInfo]:
        """All runs, newest first; one that is damaged has the verdict "unreadable"."""
        with self._looking:
            seen = {folder.name: self._look(folder) for folder in self._folders()}
            self._seen = {name: each for name, each in seen.items() if each is not None}
            return [each.info for each in sorted(self._seen.values(), key=lambda one: -one.order)]

    def recording(self, name: str) -> Mapping[str, Any]:
        """A run as `docs/monitor-channels.md` says; reads it first, which may take seconds.

        Raises:
            RunError: there is no such run, or it cannot be shown.
        """
        known = self.kept(name)
        return self._read(name).recording if known is None else known

    def kept(self, name: str) -> Mapping[str, Any] | None:
        """A run that was read and has not changed since, at once; None: it has to be read.

        Raises:
            RunError: there is no such run.
        """
        folder = self._folder(name)
        known = self._kept(name)
        return known.recording if known is not None and known.mark == _mark(folder) else None

    def close(self) -> None:
        """Let go: what is being read is broken off, and nothing more is read."""
        self._readers.close()

    def image(self, name: str, index: int) -> bytes:
        """A JPEG of its camera.

        Raises:
            RunNotReadError: the run is to be read first; `recording` does so.
            RunError: there is no such run or image.
        """
        self._folder(name)
        run = self._kept(name)
        if run is None:
            raise RunNotReadError(f"run '{name:.{_MOST_NAME}}': is not read yet")
        if not 0 <= index < len(run.spans):
            raise RunError(f"run '{name:.{_MOST_NAME}}': has no image {index}; it has {len(run.spans)}")
        start, length = run.spans[index]
        try:
            with (Path(run.folder.name) / IMAGES).open("rb") as file:
                file.seek(start)
                return file.read(length)
        except OSError as error:
            raise RunError(f"run '{name}': its images are gone: {error.strerror}") from None

    def _folders(self) -> list[Path]:
        """Folders that may be runs; no links, which could lead anywhere."""
        try:
            entries = list(self.path.iterdir())
        except OSError:
            return []
        return [each for each in entries if _is_text(each.name) and not each.is_symlink() and each.is_dir()]

    def _look(self, folder: Path) -> _Seen | None:
        """What a folder is; None if it is no run."""
        mark = _mark(folder)
        if not any(mark):
            return None
        known = self._seen.get(folder.name)
        if known is not None and known.mark == mark:
            return known
        info = _info(folder)
        return _Seen(mark, info, _order(info, max(mark)))

    def _read(self, name: str) -> _Unpacked:
        """Read a run, unless that failed a moment ago."""
        folder = self._folder(name)
        mark = _mark(folder)
        with self._looking:
            failed = self._failed.get(name)
        if failed and failed.mark == mark and time.monotonic() - failed.at_s < _FAILURE_KEPT_S:
            raise RunError(failed.words)
        try:
            run = _unpack(folder, mark, self._readers)
        except RunError as error:
            with self._looking:
                self._failed[name] = _Failed(mark, time.monotonic(), str(error))
                while len(self._failed) > _MOST_FAILURES:
                    self._failed.popitem(last=False)
            raise
        self._keep(name, run)
        return run

    def _kept(self, name: str) -> _Unpacked | None:
        with self._looking:
            known = self._unpacked.get(name)
            if known is not None:
                self._unpacked.move_to_end(name)
            return known

    def _keep(self, name: str, run: _Unpacked) -> None:
        with self._looking:
            self._unpacked[name] = run
            while len(self._unpacked) > KEPT_RUNS:
                self._unpacked.popitem(last=False)

    def _folder(self, name: str) -> Path:
        """The folder of a run; the name must be one that stands in the listing, so it leads nowhere else."""
        for folder in self._folders():
            if folder.name == name and any(_mark(folder)):
                return folder
        raise RunError(f"run '{name[:_MOST_NAME]!s}': there is no such run in {self.path}/")


def _is_text(name: str) -> bool:
    """Whether a file's name is text at all; Linux takes any bytes."""
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True


def _mark(folder: Path) -> tuple[int, ...]:
    """When each of the files that make a run was written, nanoseconds; 0 where there is none."""
    times: list[int] = []
    for sign in _SIGNS:
        try:
            status = (folder / sign).lstat()
        except OSError:
            times.append(0)
        else:
            times.append(status.st_mtime_ns)
    return tuple(times)


def _info(folder: Path) -> RunInfo:
    try:
        result = _result(folder / "result.json")
    except (OSError, ValueError, RecursionError):
        return RunInfo(folder.name, "", "", UNREADABLE, None, _started("", folder.name))
    if result is None:
        return RunInfo(folder.name, _scenario_of(folder.name), "", "", None, _started("", folder.name))
    return RunInfo(
        folder.name,
        result.scenario[:_MOST_NAME] or _scenario_of(folder.name),
        result.mission[:_MOST_NAME],
        result.verdict,
        result.total_time_s if "total_time_s" in result.model_fields_set else None,
        _started(result.started[:_MOST_NAME], folder.name),
    )


def _result(path: Path) -> FlightResult | None:
    """What makes sense in a result; None if there is none, or no verdict in it.

    Raises:
        ValueError: it is damaged.
        OSError: it cannot be read.
    """
    if not path.exists():
        return None
    if path.is_symlink() or not path.is_file() or path.stat().st_size > MAX_RESULT_BYTES:
        raise ValueError("no result of ours")
    result = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(result, dict):
        raise ValueError("no object")
    return FlightResult.from_outside(result)


def _scenario_of(name: str) -> str:
    """The scenario as the folder's name tells it."""
    stamp = _STAMP.match(name)
    return name[stamp.end() + 1 :][:_MOST_NAME] if stamp else ""


def _started(text: str, name: str) -> str:
    """When a flight began, ISO 8601; from the folder's name, in local time, if the result does not tell."""
    if _instant(text) is not None:
        return text
    stamp = _STAMP.match(name)
    if stamp is None:
        return ""
    try:
        return datetime.strptime(stamp[0], "%Y%m%d-%H%M%S").astimezone().isoformat()
    except (ValueError, OverflowError, OSError):
        return ""


def _instant(text: str) -> float | None:
    try:
        moment = datetime.fromisoformat(text)
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError, OSError):
        return None


def _order(info: RunInfo, written_ns: int) -> float:
    instant = _instant(info.started)
    return written_ns / 1e9 if instant is None else instant


def _unpack(folder: Path, mark: tuple[int, ...], readers: Readers) -> _Unpacked:
    """Read a run in a process of its own.

    Raises:
        RunError: it cannot be shown.
    """
    linked = [name for name in _FILES if (folder / name).is_symlink()]
    if linked:
        raise RunError(f"run '{folder.name}': its {linked[0]} is a link; only files of its own are shown")
    target = TemporaryDirectory(prefix="framerunner-run-", ignore_cleanup_errors=True)
    command = [sys.executable, "-m", "framerunner.monitoring.read_run", str(folder.absolute()), target.name]
    try:
        code, said = readers.run(command)
    except OSError:
        raise RunError(f"run '{folder.name}': it cannot be read now") from None
    if code in (-signal.SIGKILL, -signal.SIGXCPU):
        raise RunError(f"run '{folder.name}': reading it takes too long")
    if code != 0:
        lines = said.strip().splitlines()
        reason = lines[-1][:300] if lines and code == 2 else "it is damaged"
        raise RunError(f"run '{folder.name}': cannot be shown: {reason}")
    try:
        recording = json.loads((Path(target.name) / RECORDING).read_text(encoding="utf-8"))
        spans = json.loads((Path(target.name) / SPANS).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise RunError(f"run '{folder.name}': no room to unpack it") from None
    return _Unpacked(mark, target, recording, [(int(start), int(length)) for start, length in spans])
