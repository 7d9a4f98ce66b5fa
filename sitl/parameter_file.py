"""A file of parameters, one a line, in the formats of ground stations.

A line is `vehicle component NAME value type`, separated by tabs (QGroundControl's .params), or `NAME value`
(MAVProxy's .parm); `#` begins a comment. MAV_SYS_ID is neither read nor written: the instance sets it.

The file is the user's, such as the export of a real drone. Saving replaces changed values in this vehicle's
lines, and adds lines for those that have none. All else stays as it is.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from struct import pack, unpack
from threading import Lock

from firmware_py.parameters import Parameter, ParameterError, Parameters
from framerunner.errors import UserError
from framerunner.files.text_file import TextError, decode_text, read_bytes, replace_file

SAVE_DELAY_S = 0.5  # changes within this time are saved together

_TYPES = {"int32": 6, "float": 9}  # MAV_PARAM_TYPE
_COMPONENT = 1  # the autopilot
_SYSTEM_ID = "MAV_SYS_ID"
_MAX_NAMED = 5  # in a notice
_MAX_BYTES = 1 << 20  # thousands of parameters
_LINE = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+")
_NUMBER = re.compile(r"[0-9]{1,9}")
_WORD = re.compile(r"\S+")
_HEAD = ("# Parameters that differ from their defaults.", "# Vehicle\tComponent\tName\tValue\tType")


class ParameterFileError(UserError):
    """A file that cannot be read or written; the message is one line for people."""


@dataclass(slots=True)
class LoadedParameters:
    """The content of a file.

    Attributes:
        values: valid ones of this vehicle, by name.
        unknown: names that this drone does not have or cannot set.
        vehicles: whose other lines are there: system and component.
        system_id: of this vehicle.
    """

    values: dict[str, float] = field(default_factory=dict)
    unknown: list[str] = field(default_factory=list)
    vehicles: set[tuple[int, int]] = field(default_factory=set)
    system_id: int = 1

    def notice(self) -> str:
        """One line about what is left out; empty if nothing is."""
        parts = []
        if self.unknown:
            some = ", ".join(self.unknown[:_MAX_NAMED])
            more = len(self.unknown) - _MAX_NAMED
            some += f" and {more} more" * (more > 0)
            parts.append(f"parameters left out, as this drone cannot set them: {some}")
        if self.vehicles:
            some = ", ".join(f"{system} {component}" for system, component in sorted(self.vehicles))
            parts.append(
                f"lines of other vehicles and components left out: {some}; this drone is {self.system_id} "
                f"{_COMPONENT}, by --instance {self.system_id - 1}"
            )
        return "; ".join(parts)


@dataclass(frozen=True, slots=True)
class _Line:
    """A line as it is written, with its end; the name is empty if it has no parameter of this vehicle.

    Attributes:
        start, stop: of the value in the text.
        has_vehicle: it begins with vehicle and component.
        other: system and component, if the line is of another vehicle or component.
    """

    text: str
    name: str = ""
    value: float = 0.0
    start: int = 0
    stop: int = 0
    has_vehicle: bool = True
    other: tuple[int, int] | None = None

    def with_value(self, text: str) -> str:
        return self.text[: self.start] + text + self.text[self.stop :]


def load_parameters(path: Path, parameters: Parameters, system_id: int = 1) -> LoadedParameters:
    """Read a file; a missing one is empty. The parameters only declare what is valid and are not changed.

    Args:
        path: of the file.
        parameters: of the vehicle.
        system_id: of the vehicle. Lines of others are left out.

    Raises:
        ParameterFileError: it cannot be read, or a line is wrong; the message names the line.
    """
    loaded = LoadedParameters(system_id=system_id)
    for number, line in enumerate(_read(path, system_id), start=1):
        if line.other is not None:
            loaded.vehicles.add(line.other)
        try:
            _add_line(loaded, line, parameters)
        except ParameterError as error:
            raise ParameterFileError(f"{path}: line {number}: {error}") from None
    return loaded


def _add_line(loaded: LoadedParameters, line: _Line, parameters: Parameters) -> None:
    if line.name in ("", _SYSTEM_ID):
        return
    if line.name not in parameters:
        loaded.unknown.append(line.name)
        return
    declared = parameters.declaration(line.name)
    if declared.constant:
        if line.value != declared.default:
            loaded.unknown.append(line.name)
        return
    loaded.values[line.name] = declared.checked(line.value)


def _read(path: Path, system_id: int) -> list[_Line]:
    try:
        data = read_bytes(path, _MAX_BYTES)
        decode_text(data)
    except TextError as error:
        if error.fault != "missing":
            raise ParameterFileError(f"{path}: {error}") from None
        if not path.parent.is_dir():
            raise ParameterFileError(f"{path}: there is no folder {path.parent}") from None
        return []
    lines = []
    for number, text in enumerate(_LINE.findall(data.decode("utf-8")), start=1):
        try:
            lines.append(_parsed(text, system_id))
        except ParameterError as error:
            raise ParameterFileError(f"{path}: line {number}: {error}") from None
    return lines


def _parsed(text: str, system_id: int) -> _Line:
    mark = text.startswith("\ufeff")  # it stays in the line
    words = list(_WORD.finditer(text.partition("#")[0], mark))
    vehicle: tuple[int, int] | None = None
    match [word.group() for word in words]:
        case []:
            return _Line(text)
        case [system, component, name, value, _] if _NUMBER.fullmatch(system) and _NUMBER.fullmatch(
            component
        ):
            place, vehicle = words[3], (int(system), int(component))
        case [name, value]:
            place = words[1]
        case others:
            raise ParameterError(
                f"{' '.join(others)}: must be `vehicle component NAME value type` or `NAME value`"
            )
    try:
        number = float(value)
    except ValueError:
        raise ParameterError(f"{name}: {value} is not a number") from None
    if vehicle is not None and vehicle != (system_id, _COMPONENT):
        return _Line(text, other=vehicle)
    return _Line(text, name, number, *place.span(), has_vehicle=vehicle is not None)


def save_parameters(
    path: Path,
    changed: Mapping[str, float],
    parameters: Parameters,
    *,
    system_id: int = 1,
    since: Collection[str] | None = None,
) -> None:
    """Write changed values into a file; lines that are not of them stay as they are.

    Args:
        path: of the file; a new one is made if there is none.
        changed: values that differ from the defaults, by name.
        parameters: gives their types and defaults.
        system_id: of the vehicle.
        since: names of what was set since the file was read or written, whose lines are changed; None: all.

    Raises:
        ParameterFileError: it is not understood or cannot be written; the old file is unchanged.
    """
    lines = _read(path, system_id)
    last = {line.name: number for number, line in enumerate(lines) if line.name}  # that one counts
    written = [line.text for line in lines]
    end = next((end for line in lines for end in ("\r\n", "\n", "\r") if line.text.endswith(end)), "\n")
    for name, number in last.items():
        if name == _SYSTEM_ID or name not in parameters or not (since is None or name in since):
            continue
        declared, line = parameters.declaration(name), lines[number]
        value = changed.get(name, declared.default)
        if not declared.constant and not declared.same(value, line.value):
            written[number] = line.with_value(_shortest(declared, value))
    short = bool(last) and not all(lines[number].has_vehicle for number in last.values())
    added = [] if lines else list(_HEAD)
    for name, value in changed.items():
        if name != _SYSTEM_ID and name not in last:
            declared = parameters.declaration(name)
            fields = [name, _shortest(declared, value)]
            if not short:
                fields = [str(system_id), str(_COMPONENT), *fields, str(_TYPES[declared.kind])]
            added.append("\t".join(fields))
    if written and added and not written[-1].endswith(("\n", "\r")):
        written[-1] += end
    try:
        replace_file(path, "".join((*written, *(line + end for line in added))))
    except OSError as error:
        raise ParameterFileError(f"{path}: cannot be written ({error.strerror})") from error


def _shortest(declared: Parameter, value: float) -> str:
    """The fewest digits that give the same single-precision number."""
    if declared.kind == "int32":
        return str(int(value))
    single = pack("<f", value)
    (value,) = unpack("<f", single)
    rounded = (float(f"{value:.{digits}g}") for digits in range(1, 10))
    return f"{next(each for each in rounded if pack('<f', each) == single):.9g}"  # true of nine digits


def open_parameters(
    parameters: Parameters, path: Path, notice: Callable[[str], None], system_id: int = 1
) -> ParameterKeeper:
    """Set the parameters that a file holds, and save later changes to it; notices are lines for people.

    Args: see `ParameterKeeper`.

    Raises:
        ParameterFileError: the file cannot be read, or a line is wrong; no parameter is set then.
    """
    loaded = load_parameters(path, parameters, system_id)
    for name, value in loaded.values.items():
        parameters.set(name, value)
    if loaded.notice():
        notice(f"{path}: {loaded.notice()}")
    return ParameterKeeper(parameters, path, notice, system_id)


class ParameterKeeper:
    """Saves parameters after they have changed, `SAVE_DELAY_S` later and in a thread.

    Args:
        parameters: to be changed on the event loop's thread only.
        path: of the file.
        notice: called with a line for people when saving fails.
        system_id: of the vehicle.
    """

    def __init__(
        self, parameters: Parameters, path: Path, notice: Callable[[str], None], system_id: int = 1
    ) -> None:
        self._parameters = parameters
        self._path = path
        self._notice = notice
        self._system_id = system_id
        self._since: set[str] = set()  # names of what was set since the file was read or written
        self._saving = Lock()  # a save may still be under way when the last one begins
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
                await asyncio.to_thread(self._save, self._parameters.changed(), self._taken())
        finally:
            if self._changed.is_set() or self._since:  # perhaps it can be written by now
                self._save(self._parameters.changed(), self._taken())

    def _note(self, name: str, _value: float) -> None:
        if name != _SYSTEM_ID:
            self._since.add(name)
            self._changed.set()

    def _taken(self) -> set[str]:
        since, self._since = self._since, set()
        return since

    def _save(self, changed: Mapping[str, float], since: set[str]) -> None:
        try:
            with self._saving:
                save_parameters(self._path, changed, self._parameters, system_id=self._system_id, since=since)
        except ParameterFileError as error:
            self._since.update(since)
            self._notice(f"parameters are not saved: {error}")
