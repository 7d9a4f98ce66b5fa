"""A file of the parameters that differ from their defaults, one a line, in the formats of ground stations.

A line is `vehicle component NAME value type`, separated by tabs (QGroundControl's .params), or `NAME value`
(MAVProxy's .parm); `#` begins a comment. MAV_SYS_ID is neither read nor written: the instance sets it.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from struct import pack, unpack
from tempfile import NamedTemporaryFile

from errors import UserError
from firmware_py.parameters import Parameter, ParameterError, Parameters

SAVE_DELAY_S = 0.5  # changes within this time are saved together

_TYPES = {"int32": 6, "float": 9}  # MAV_PARAM_TYPE
_SYSTEM_ID = "MAV_SYS_ID"
_MAX_NAMED = 5  # in a notice


class ParameterFileError(UserError):
    """A file that cannot be read or written; the message is one line for people."""


@dataclass(slots=True)
class LoadedParameters:
    """The content of a file: valid values by name, and names that this drone does not have or cannot set."""

    values: dict[str, float] = field(default_factory=dict)
    unknown: list[str] = field(default_factory=list)

    def notice(self) -> str:
        """One line about unknown names; empty if there are none."""
        if not self.unknown:
            return ""
        some = ", ".join(self.unknown[:_MAX_NAMED])
        more = len(self.unknown) - _MAX_NAMED
        return f"parameters left out, as this drone cannot set them: {some}{f' and {more} more' * (more > 0)}"


def load_parameters(path: Path, parameters: Parameters) -> LoadedParameters:
    """Read a file; a missing one is empty. The parameters only declare what is valid and are not changed.

    Raises:
        ParameterFileError: it cannot be read, or a line is wrong; the message names the line.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        if not path.parent.is_dir():
            raise ParameterFileError(f"{path}: there is no folder {path.parent}") from None
        return LoadedParameters()
    except UnicodeDecodeError:
        raise ParameterFileError(f"{path}: is not a text") from None
    except OSError as error:
        raise ParameterFileError(f"{path}: cannot be read ({error.strerror})") from error
    loaded = LoadedParameters()
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        try:
            _add_line(loaded, words, parameters)
        except ParameterError as error:
            raise ParameterFileError(f"{path}: line {number}: {error}") from None
    return loaded


def _add_line(loaded: LoadedParameters, words: list[str], parameters: Parameters) -> None:
    name, value = _name_and_value(words)
    if name == _SYSTEM_ID:
        return
    if name not in parameters:
        loaded.unknown.append(name)
        return
    declared = parameters.declaration(name)
    if declared.constant:
        if value != declared.default:
            loaded.unknown.append(name)
        return
    loaded.values[name] = declared.checked(value)


def _name_and_value(words: list[str]) -> tuple[str, float]:
    match words:
        case [_, _, name, value, _] | [name, value]:
            pass
        case _:
            raise ParameterError(
                f"{' '.join(words)}: must be `vehicle component NAME value type` or `NAME value`"
            )
    try:
        return name, float(value)
    except ValueError:
        raise ParameterError(f"{name}: {value} is not a number") from None


def save_parameters(path: Path, changed: Mapping[str, float], parameters: Parameters) -> None:
    """Replace a file by one with the changed values (by name); `parameters` gives their types.

    Raises:
        ParameterFileError: it cannot be written; the old file is unchanged.
    """
    lines = ["# Parameters that differ from their defaults.", "# Vehicle\tComponent\tName\tValue\tType"]
    system_id = parameters.integer(_SYSTEM_ID)
    for name, value in changed.items():
        if name != _SYSTEM_ID:
            declared = parameters.declaration(name)
            lines.append(f"{system_id}\t1\t{name}\t{_shortest(declared, value)}\t{_TYPES[declared.kind]}")
    temporary: Path | None = None
    try:
        with NamedTemporaryFile(
            "w", encoding="utf-8", dir=path.parent, prefix=f".{path.name}.", delete=False
        ) as file:
            temporary = Path(file.name)
            file.write("\n".join(lines) + "\n")
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        raise ParameterFileError(f"{path}: cannot be written ({error.strerror})") from error


def _shortest(declared: Parameter, value: float) -> str:
    """The fewest digits that give the same single-precision number."""
    if declared.kind == "int32":
        return str(int(value))
    single = pack("<f", value)
    (value,) = unpack("<f", single)
    texts = (f"{value:.{digits}g}" for digits in range(1, 10))
    return next(text for text in texts if pack("<f", float(text)) == single)  # true of nine digits


def open_parameters(parameters: Parameters, path: Path, notice: Callable[[str], None]) -> ParameterKeeper:
    """Set the parameters that a file holds, and save later changes to it; notices are lines for people.

    Raises:
        ParameterFileError: the file cannot be read, or a line is wrong; no parameter is set then.
    """
    loaded = load_parameters(path, parameters)
    for name, value in loaded.values.items():
        parameters.set(name, value)
    if loaded.unknown:
        notice(f"{path}: {loaded.notice()}")
    return ParameterKeeper(parameters, path, notice)


class ParameterKeeper:
    """Saves parameters after they have changed, `SAVE_DELAY_S` later and in a thread.

    Args:
        parameters: to be changed on the event loop's thread only.
        path: of the file.
        notice: called with a line for people when saving fails.
    """

    def __init__(self, parameters: Parameters, path: Path, notice: Callable[[str], None]) -> None:
        self._parameters = parameters
        self._path = path
        self._notice = notice
        self._changed = asyncio.Event()
        self._running: asyncio.Task[None] | None = None
        parameters.on_change(self._note)
        parameters.on_save(self._changed.set)

    def start(self) -> None:
        """Begin saving; to be called in an event loop."""
        self._running = asyncio.create_task(self._run())

    async def close(self) -> None:
        """Save what is not saved yet, and stop."""
        if self._running is not None:
            self._running.cancel()
            await asyncio.gather(self._running, return_exceptions=True)

    async def _run(self) -> None:
        try:
            while True:
                await self._changed.wait()
                await asyncio.sleep(SAVE_DELAY_S)
                self._changed.clear()
                await asyncio.to_thread(self._save, self._parameters.changed())
        finally:
            if self._changed.is_set():
                self._save(self._parameters.changed())

    def _note(self, name: str, _value: float) -> None:
        if name != _SYSTEM_ID:
            self._changed.set()

    def _save(self, changed: Mapping[str, float]) -> None:
        try:
            save_parameters(self._path, changed, self._parameters)
        except ParameterFileError as error:
            self._notice(f"parameters are not saved: {error}")
