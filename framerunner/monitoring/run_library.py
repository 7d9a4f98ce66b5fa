"""The runs of a folder, for the monitor's replay, and the processes that read them."""

from __future__ import annotations

import contextlib
import json
import re
import signal
import subprocess
import sys
import threading
import time
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from framerunner.monitor.ports import RunError, RunInfo, RunNotReadError
from framerunner.monitoring.read_run import IMAGES, RECORDING, SPANS
from framerunner.runs import run_files
from scenarios.result import MAX_RESULT_BYTES, FlightResult

KEPT_RUNS = 6
"""So many runs are kept unpacked, in folders that are removed when the program ends."""
UNREADABLE = "unreadable"
_FAILURE_KEPT_S = 60.0  # for so long a run that could not be read is not read again, unless it changes
_MAX_FAILURES = 100
_MAX_NAME = 80
_MAX_READ_S = 300.0
_MAX_STDERR_BYTES = 100_000
_SIGNS = (run_files.RESULT, run_files.RECORDING, run_files.LOG)
_FILES = (*_SIGNS, run_files.SCENARIO, run_files.MISSION, run_files.VIDEO)
_STAMP = re.compile(r"\d{8}-\d{6}")

Mark = tuple[int, ...]
"""When each of `_SIGNS` was written, nanoseconds; 0 where there is none."""


@dataclass(frozen=True, slots=True)
class _Seen:
    """A folder as it was when it was last listed."""

    mark: Mark
    info: RunInfo
    order: float


@dataclass(frozen=True)
class _Unpacked:
    """A run that was read; the images' places are start and length in the file of images."""

    mark: Mark
    folder: TemporaryDirectory[str]
    recording: Mapping[str, Any]
    spans: Sequence[tuple[int, int]]


@dataclass(frozen=True, slots=True)
class _Failed:
    """A run that could not be read."""

    mark: Mark
    at_s: float
    message: str


class RunFolders:
    """The run folders in a folder, which need not exist yet; may be used from several threads.

    Implements `framerunner.monitor.ports.RunLibrary`, which says what is returned and raised.

    Args:
        path: of the folder.
        session: a second folder, whose flights are kept until the program ends; None: there is none.
        pilot: a contestant's file that the user named, or a pilot's name; missions that need it can be shown.
    """

    def __init__(self, path: Path, session: Path | None = None, pilot: str | None = None) -> None:
        self.path = path
        self._session = session
        self._pilot = pilot
        self._lock = threading.Lock()
        self._seen: dict[str, _Seen] = {}
        self._unpacked: OrderedDict[str, _Unpacked] = OrderedDict()
        self._failed: OrderedDict[str, _Failed] = OrderedDict()
        self._readers = Readers()

    def runs(self) -> Sequence[RunInfo]:
        """All runs, newest first; one that is damaged has the verdict "unreadable"."""
        with self._lock:
            seen = {folder.name: self._look(folder) for folder in self._folders()}
            self._seen = {name: each for name, each in seen.items() if each is not None}
            return [each.info for each in sorted(self._seen.values(), key=lambda one: -one.order)]

    def recording(self, name: str) -> Mapping[str, Any]:
        """Read a run, unless it is known."""
        known = self.kept(name)
        return self._read(name).recording if known is None else known

    def kept(self, name: str) -> Mapping[str, Any] | None:
        """A run that was read and has not changed since."""
        folder = self._folder(name)
        known = self._kept(name)
        return known.recording if known is not None and known.mark == _mark(folder) else None

    def close(self) -> None:
        """Stop reading runs."""
        self._readers.close()

    def image(self, name: str, index: int) -> bytes:
        """A JPEG of its camera."""
        self._folder(name)
        run = self._kept(name)
        if run is None:
            raise RunNotReadError(f"run '{name:.{_MAX_NAME}}': is not read yet")
        if not 0 <= index < len(run.spans):
            raise RunError(f"run '{name:.{_MAX_NAME}}': has no image {index}; it has {len(run.spans)}")
        start, length = run.spans[index]
        try:
            with (Path(run.folder.name) / IMAGES).open("rb") as file:
                file.seek(start)
                return file.read(length)
        except OSError as error:
            raise RunError(f"run '{name}': its images are gone: {error.strerror}") from None

    def _folders(self) -> list[Path]:
        """Folders that may be runs; no links, which could lead anywhere."""
        entries: list[Path] = []
        for path in (self.path, self._session):
            with contextlib.suppress(OSError):
                entries += [] if path is None else path.iterdir()
        return [each for each in entries if _is_text(each.name) and not each.is_symlink() and each.is_dir()]

    def _look(self, folder: Path) -> _Seen | None:
        """What a folder contains; None if it is not a run."""
        mark = _mark(folder)
        if not any(mark):
            return None
        known = self._seen.get(folder.name)
        if known is not None and known.mark == mark:
            return known
        info = replace(_info(folder), session=folder.parent == self._session)
        started_s = _unix_s(info.started)
        return _Seen(mark, info, max(mark) / 1e9 if started_s is None else started_s)

    def _read(self, name: str) -> _Unpacked:
        """Read a run, unless that failed shortly before."""
        folder = self._folder(name)
        mark = _mark(folder)
        with self._lock:
            failed = self._failed.get(name)
        if failed and failed.mark == mark and time.monotonic() - failed.at_s < _FAILURE_KEPT_S:
            raise RunError(failed.message)
        try:
            run = _unpack(folder, mark, self._readers, self._pilot)
        except RunError as error:
            with self._lock:
                self._failed[name] = _Failed(mark, time.monotonic(), str(error))
                while len(self._failed) > _MAX_FAILURES:
                    self._failed.popitem(last=False)
            raise
        with self._lock:
            self._unpacked[name] = run
            while len(self._unpacked) > KEPT_RUNS:
                self._unpacked.popitem(last=False)
        return run

    def _kept(self, name: str) -> _Unpacked | None:
        with self._lock:
            known = self._unpacked.get(name)
            if known is not None:
                self._unpacked.move_to_end(name)
            return known

    def _folder(self, name: str) -> Path:
        """The folder of a run; only names in the listing are accepted, so none leads to another place."""
        for folder in self._folders():
            if folder.name == name and any(_mark(folder)):
                return folder
        raise RunError(f"run '{name[:_MAX_NAME]!s}': there is no such run in {self.path}/")


def _is_text(name: str) -> bool:
    """Whether a file's name is valid text; Linux accepts any bytes."""
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True


def _mark(folder: Path) -> Mark:
    times: list[int] = []
    for sign in _SIGNS:
        try:
            times.append((folder / sign).lstat().st_mtime_ns)
        except OSError:
            times.append(0)
    return tuple(times)


def _info(folder: Path) -> RunInfo:
    name = folder.name
    try:
        result = _result(folder / run_files.RESULT)
    except (OSError, ValueError, RecursionError):
        return RunInfo(name, "", "", UNREADABLE, None, _started("", name))
    stamp = _STAMP.match(name)
    scenario = name[stamp.end() + 1 :][:_MAX_NAME] if stamp else ""
    if result is None:
        return RunInfo(name, scenario, "", "", None, _started("", name))
    return RunInfo(
        name,
        result.scenario[:_MAX_NAME] or scenario,
        result.mission[:_MAX_NAME],
        result.verdict,
        result.total_time_s if "total_time_s" in result.model_fields_set else None,
        _started(result.started[:_MAX_NAME], name),
    )


def _result(path: Path) -> FlightResult | None:
    """The valid fields of a result; None without one. ValueError: damaged; OSError: cannot be read."""
    if not path.exists():
        return None
    if path.is_symlink() or not path.is_file() or path.stat().st_size > MAX_RESULT_BYTES:
        raise ValueError("not a result of this program")
    result = json.loads(path.read_bytes())
    if not isinstance(result, dict):
        raise ValueError("not an object")
    return FlightResult.from_outside(result)


def _started(text: str, name: str) -> str:
    """When a flight began, ISO 8601; without a valid text from the folder's name, in local time."""
    if _unix_s(text) is not None:
        return text
    stamp = _STAMP.match(name)
    try:
        return "" if stamp is None else datetime.strptime(stamp[0], "%Y%m%d-%H%M%S").astimezone().isoformat()
    except (ValueError, OverflowError, OSError):
        return ""


def _unix_s(text: str) -> float | None:
    try:
        moment = datetime.fromisoformat(text)
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError, OSError):
        return None


class Readers:
    """The processes that are reading runs; may be used from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[bytes]] = set()
        self._closed = False

    def run(self, command: Sequence[str]) -> tuple[int, str]:
        """Run a process to its end; returns its exit code and standard error.

        Its standard input ends with this process. OSError: it cannot be started, or `close` was called.
        """
        with self._lock:
            if self._closed:
                raise OSError("closed")
            process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
            )
            self._running.add(process)
        assert process.stdin is not None
        assert process.stderr is not None
        deadline = threading.Timer(_MAX_READ_S, process.kill)
        deadline.start()
        try:
            printed = process.stderr.read(_MAX_STDERR_BYTES)
            code = process.wait()
        finally:
            deadline.cancel()
            with self._lock:
                self._running.discard(process)
            process.stdin.close()
            process.stderr.close()
        return code, printed.decode(errors="replace")

    def close(self) -> None:
        """Kill the running processes; nothing more is run."""
        with self._lock:
            self._closed = True
            for process in self._running:
                process.kill()


def _unpack(folder: Path, mark: Mark, readers: Readers, pilot: str | None = None) -> _Unpacked:
    """Read a run in a separate process; RunError if it cannot be shown."""
    linked = [name for name in _FILES if (folder / name).is_symlink()]
    if linked:
        raise RunError(f"run '{folder.name}': its {linked[0]} is a link; linked files are not shown")
    target = TemporaryDirectory(prefix="framerunner-run-", ignore_cleanup_errors=True)
    command = [sys.executable, "-m", "framerunner.monitoring.read_run", str(folder.absolute()), target.name]
    command += [] if pilot is None else [pilot]
    try:
        code, printed = readers.run(command)
    except OSError:
        raise RunError(f"run '{folder.name}': it cannot be read now") from None
    if code in (-signal.SIGKILL, -signal.SIGXCPU):
        raise RunError(f"run '{folder.name}': reading it takes too long")
    if code != 0:
        lines = printed.strip().splitlines()
        reason = lines[-1][:300] if lines and code == 2 else "it is damaged"
        raise RunError(f"run '{folder.name}': cannot be shown: {reason}")
    try:
        recording = json.loads((Path(target.name) / RECORDING).read_bytes())
        spans = json.loads((Path(target.name) / SPANS).read_bytes())
    except (OSError, ValueError):
        raise RunError(f"run '{folder.name}': no room to unpack it") from None
    return _Unpacked(mark, target, recording, [(int(start), int(length)) for start, length in spans])
