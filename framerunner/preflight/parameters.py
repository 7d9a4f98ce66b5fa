"""A vehicle's parameters over MAVLink: read, set and checked, and kept in a file for return.

The file has the format of QGroundControl's parameter files, which can load it as well:
https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/parameters.html
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from math import isfinite
from pathlib import Path

from errors import SettingError
from framerunner.doctor.listen import parameter_value
from framerunner.preflight.session import VehicleSession
from offboard.drone import DroneError
from wire.dialect import AUTOPILOT_COMPONENT_ID, Message, mavlink

_FLOAT = mavlink.MAV_PARAM_TYPE_REAL32
_HEADER = "# vehicle-id component-id name value type"
_NAME_BYTES = 16
_SAME = 1e-6  # of a value that was set and read back, relative
_FIELDS = 5


@dataclass(frozen=True, slots=True)
class ParameterValue:
    """One parameter as a vehicle has it."""

    name: str
    value: float
    kind: int  # MAV_PARAM_TYPE


def read_parameters(session: VehicleSession, names: Iterable[str]) -> dict[str, ParameterValue]:
    """Read parameters; those that the vehicle does not answer for are left out."""
    found = {}
    for name in names:
        request = mavlink.MAVLink_param_request_read_message(
            session.system_id, AUTOPILOT_COMPONENT_ID, name.encode(), -1
        )
        value = session.request(request, partial(_value_of, session, name))
        if value is not None:
            found[name] = value
    return found


def set_parameter(session: VehicleSession, parameter: ParameterValue) -> None:
    """Set a parameter and read it back.

    Raises:
        DroneError: the vehicle does not answer, or keeps another value.
    """
    name = parameter.name
    message = mavlink.MAVLink_param_set_message(
        session.system_id,
        AUTOPILOT_COMPONENT_ID,
        name.encode(),
        _on_wire(parameter, bytewise=session.is_px4),
        parameter.kind,
    )
    answered = session.request(message, partial(_value_of, session, name))
    kept = read_parameters(session, [name]).get(name)
    if answered is None or kept is None:
        raise DroneError(f"{name}: the vehicle did not answer; check the link, then try again")
    if abs(kept.value - parameter.value) > _SAME * max(1.0, abs(parameter.value)):
        raise DroneError(f"{name}: was set to {parameter.value:g}, but the vehicle keeps {kept.value:g}")


def set_and_keep(
    session: VehicleSession, wanted: Mapping[str, float], kept: Mapping[str, ParameterValue], path: Path
) -> None:
    """Set parameters; their old values are written first, and where is told on standard error.

    Args:
        session: with the vehicle.
        wanted: new values by name.
        kept: the old ones, of at least these parameters.
        path: of the file for return.

    Raises:
        DroneError: one could not be set; those before it are.
        SettingError: the file cannot be written; nothing is set.
    """
    write_parameters(path, session.system_id, [kept[name] for name in wanted])
    hint = f"return them by framerunner preflight --restore-parameters {path}"
    print(f"old values: {path}; {hint}", file=sys.stderr, flush=True)
    for name, value in wanted.items():
        set_parameter(session, ParameterValue(name, value, kept[name].kind))


def write_parameters(path: Path, system_id: int, parameters: Iterable[ParameterValue]) -> None:
    """Write a parameter file.

    Raises:
        SettingError: it cannot be written.
    """
    lines = [_HEADER]
    for each in parameters:
        number = f"{each.value:.18g}" if each.kind == _FLOAT else f"{round(each.value)}"
        lines.append(f"{system_id}\t{AUTOPILOT_COMPONENT_ID}\t{each.name}\t{number}\t{each.kind}")
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise SettingError(f"{path}: cannot be written ({error.strerror}); nothing was set") from None


def load_parameters(path: Path) -> list[ParameterValue]:
    """Read a parameter file, of this program or of QGroundControl.

    Raises:
        SettingError: there is none, or a line is not understood.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "no text"
        raise SettingError(f"--restore-parameters {path}: cannot be read ({reason})") from None
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        try:
            found.append(_parsed(line))
        except ValueError:
            raise SettingError(
                f"--restore-parameters {path}: line {number} is not a parameter; each line has vehicle, "
                "component, name, value and type, separated by tabs"
            ) from None
    if not found:
        raise SettingError(f"--restore-parameters {path}: holds no parameters")
    return found


def _parsed(line: str) -> ParameterValue:
    fields = line.split("\t")
    if len(fields) != _FIELDS:
        raise ValueError(line)
    name, value, kind = fields[2], float(fields[3]), int(fields[4])
    whole = kind == _FLOAT or value.is_integer()
    if not 0 < len(name.encode()) <= _NAME_BYTES or not isfinite(value) or not whole:
        raise ValueError(line)
    return ParameterValue(name, value, kind)


def _value_of(session: VehicleSession, name: str, message: Message) -> ParameterValue | None:
    """The parameter that a PARAM_VALUE tells, if it is the one of this name."""
    if message.get_type() != "PARAM_VALUE" or message.param_id != name:
        return None
    value = parameter_value(message) if session.is_px4 else float(message.param_value)
    return ParameterValue(name, value, message.param_type)


def _on_wire(parameter: ParameterValue, *, bytewise: bool) -> float:
    """The field of a PARAM_SET: PX4 takes an integer's bytes in the place of a float's, others its value."""
    if parameter.kind == _FLOAT or not bytewise:
        return parameter.value
    layout = "<I" if parameter.kind == mavlink.MAV_PARAM_TYPE_UINT32 else "<i"
    as_float: float = struct.unpack("<f", struct.pack(layout, round(parameter.value)))[0]
    return as_float
