"""The folder of an evaluation: each flight is kept as it ends, and a stopped evaluation can be continued."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout
from pydantic import TypeAdapter

from framerunner.errors import SettingError, write_advice
from framerunner.evaluation.plan import Identity
from framerunner.evaluation.rows import EvaluationRow
from framerunner.files.text_file import replace_file
from framerunner.runs.track import Track
from offboard.navigation.view import GateEstimate
from scenarios.loader import dump_yaml
from scenarios.models import Scenario

FORMAT = 2
IDENTITY, FLIGHTS, LOCK = "evaluation.json", "flights.jsonl", ".lock"
RESULTS, REPORT = "results.csv", "report.html"
_ESTIMATES = TypeAdapter(tuple[GateEstimate, ...])
_FOLDERS = ("scenarios", "tracks", "errors")
_FILES = (IDENTITY, FLIGHTS, RESULTS, REPORT)
_PART = re.compile(r"^\.?(.+?)(?:\.[0-9a-f]{8})?\.part$")  # what a killed program left of `replace_file`


@dataclass(frozen=True, slots=True)
class EvaluationFolder:
    """`evaluation.json` has the identity, `flights.jsonl` a line for each flight that has ended.

    Attributes:
        path: the folder.
        identity: of the evaluation.
        done: scenarios of all flights that have ended; their rows stay on disk, there may be thousands.
    """

    path: Path
    identity: Identity
    done: set[str]

    def scenario_file(self, name: str) -> Path:
        """The file of a scenario that was flown."""
        return self.path / "scenarios" / f"{name}.yaml"

    def error_file(self, name: str) -> Path:
        """The traceback of a flight that a fault of the program ended."""
        return self.path / "errors" / f"{name}.txt"

    def keep(self, scenario: Scenario, row: EvaluationRow) -> None:
        """Write a flight so that it survives a kill and a power cut.

        Its line is written last, so a flight that has a line has all its files.

        Raises:
            SettingError: it cannot be written.
        """
        with _writing(self.path):
            self.scenario_file(row.scenario).write_text(dump_yaml(scenario), encoding="utf-8")
            if row.track is not None:
                text = json.dumps(_track_as_dict(row.track), separators=(",", ":"))
                self._track_file(row.scenario).write_text(text, encoding="utf-8")
            if row.traceback:
                self.error_file(row.scenario).write_text(row.traceback, encoding="utf-8")
            with (self.path / FLIGHTS).open("ab", buffering=0) as file:
                line = row.to_json().encode() + b"\n"
                if file.write(line) < len(line):  # a part was written; the next start removes it
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                os.fsync(file.fileno())
        self.done.add(row.scenario)

    def rows(self) -> dict[str, EvaluationRow]:
        """All rows by scenario, in the scenarios' order, without tracks."""
        found, _ = _read_rows(self.path / FLIGHTS, self.identity)
        return {name: found[name] for name in self.identity.scenarios if name in found}

    def track(self, name: str) -> Track:
        """The track of a flight that failed; empty if it is not known."""
        try:
            return _track_from_dict(json.loads(self._track_file(name).read_bytes()))
        except (OSError, ValueError, KeyError, TypeError):
            return Track()

    def write(self, name: str, text: str) -> None:
        """Write a file of the folder completely or not at all; raises `SettingError`."""
        with _writing(self.path):
            replace_file(self.path / name, text)

    def _track_file(self, name: str) -> Path:
        return self.path / "tracks" / f"{name}.json"


@contextmanager
def open_folder(path: Path, identity: Identity, *, again: bool = False) -> Iterator[EvaluationFolder]:
    """Make an evaluation's folder or continue an existing one, and lock it.

    Args:
        path: the folder.
        identity: of what is to be flown.
        again: delete what was flown before.

    Raises:
        SettingError: the folder belongs to something else, is in use, or cannot be written to.
    """
    with _writing(path):
        path.mkdir(parents=True, exist_ok=True)
        try:
            lock = FileLock(path / LOCK, timeout=0).acquire()
        except Timeout:
            raise SettingError(
                f"--out {path}: another evaluation is writing here; wait, or choose another"
            ) from None
    with lock:
        is_new = _check(path, identity, again)
        with _writing(path):
            if is_new:
                _clear(path)
                data = {"format": FORMAT, **identity.as_data()}
                replace_file(path / IDENTITY, json.dumps(data, indent=2) + "\n")
            for name in _FOLDERS:
                (path / name).mkdir(exist_ok=True)
            done = _repair(path / FLIGHTS, identity)
        yield EvaluationFolder(path, identity, done)


def read_folder(path: Path, option: str) -> EvaluationFolder:
    """Read an evaluation, which may still be running, without changing it.

    Raises:
        SettingError: there is none; the message names the option that named the folder.
    """
    identity = _identity(path, option)
    if identity is None:
        raise SettingError(f"{option} {path}: holds no evaluation; give a folder that has {IDENTITY}")
    return EvaluationFolder(path, identity, set(_read_rows(path / FLIGHTS, identity)[0]))


def _check(path: Path, identity: Identity, again: bool) -> bool:
    """Whether the folder is to be cleared first; raises `SettingError` if it belongs to something else."""
    found = {_PART.sub(r"\1", each.name) for each in path.iterdir()}
    existing = _identity(path, "--out")
    if existing is None:
        if found <= {LOCK, IDENTITY}:
            return True
        raise SettingError(f"--out {path}: has other files in it; choose a new folder")
    if again:
        others = sorted(found - {*_FILES, *_FOLDERS, LOCK})
        if not others:
            return True
        raise SettingError(f"--out {path}: {others[0]} in it is not of an evaluation; choose another")
    difference = identity.difference(existing)
    if difference:
        raise SettingError(
            f"--out {path}: has an evaluation of {difference}; choose another, or --again to fly it again"
        )
    return False


def _identity(path: Path, option: str) -> Identity | None:
    try:
        data: dict[str, Any] = json.loads((path / IDENTITY).read_bytes())
        if data.pop("format") != FORMAT:
            raise SettingError(f"{option} {path}: was made by another version of framerunner; choose another")
        if set(data) | {"autopilot"} != {each.name for each in fields(Identity)}:
            raise ValueError("other fields")
        return TypeAdapter(Identity).validate_python(data)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        raise SettingError(f"{option} {path}: its {IDENTITY} cannot be read; choose another") from None


def _clear(path: Path) -> None:
    for name in _FILES:
        (path / name).unlink(missing_ok=True)
    for name in _FOLDERS:
        shutil.rmtree(path / name, ignore_errors=True)


def _repair(file: Path, identity: Identity) -> set[str]:
    """Remove incomplete lines, whose flights will be flown again; returns the scenarios that are done."""
    rows, is_complete = _read_rows(file, identity)
    if not is_complete:
        replace_file(file, "".join(row.to_json() + "\n" for row in rows.values()))
    return set(rows)


def _read_rows(file: Path, identity: Identity) -> tuple[dict[str, EvaluationRow], bool]:
    """Return the rows, and whether all lines were complete."""
    rows: dict[str, EvaluationRow] = {}
    is_complete = True
    try:
        with file.open("rb") as lines:
            for line in lines:
                try:
                    row = EvaluationRow.model_validate_json(line)
                except ValueError:
                    is_complete = False
                    continue
                is_complete = is_complete and line.endswith(b"\n")
                if row.scenario in identity.scenarios:
                    rows[row.scenario] = row
    except FileNotFoundError:
        pass
    return rows, is_complete


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise SettingError(
            f"--out {path}: cannot be written to ({error.strerror}); {write_advice(error)}; "
            "what was kept stays"
        ) from None


def _track_as_dict(track: Track) -> dict[str, Any]:
    """A track as plain data, with states by number."""
    states: Sequence[str] = list(dict.fromkeys(track.mission_state))
    numbers = {state: number for number, state in enumerate(states)}
    return {
        "time_s": track.time_s,
        "x": track.x,
        "y": track.y,
        "z": track.z,
        "states": states,
        "mission_state": [numbers[state] for state in track.mission_state],
        "estimates": [asdict(estimate) for estimate in track.estimates],
        "true_path": track.true_path,
        "estimated_path": track.estimated_path,
    }


def _track_from_dict(data: dict[str, Any]) -> Track:
    states = [data["states"][number] for number in data["mission_state"]]
    estimates = _ESTIMATES.validate_python(data.get("estimates", ()))
    paths = ([tuple(sample) for sample in data.get(name, ())] for name in ("true_path", "estimated_path"))
    return Track(data["time_s"], data["x"], data["y"], data["z"], states, estimates, *paths)
