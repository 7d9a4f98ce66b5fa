"""What a vehicle had before a flight, in a file: parameters that were set, and the fence that was replaced.

The file has the format of QGroundControl's parameter files, which can load it as well:
https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/parameters.html
Vehicle and fence are in comments, which QGroundControl skips.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from framerunner.errors import SettingError
from framerunner.files.text_file import TextError, read_text
from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, mavlink
from framerunner.wire.session.client import VehicleClient
from framerunner.wire.session.fence import MAX_ITEMS, FenceItem, upload_fence
from framerunner.wire.session.session import ParameterValue, VehicleError

OPTION = "--restore-parameters"
OVERRIDE = "--any-vehicle"
_FLOAT = mavlink.MAV_PARAM_TYPE_REAL32
_HEADER = "# vehicle-id component-id name value type"
_UID, _FENCE, _ITEM = "# vehicle-uid", "# fence-items", "# fence-item"
_NAME_BYTES = 16
_FIELDS = 5
_ITEM_FIELDS = 10
_MAX_FILE_BYTES = 1 << 20  # thousands of parameters
_ITEM_LAYOUT = "<HB5f2i"  # command, frame, params and z, x and y, as MAVLink sends them
_LAYOUTS = {  # by MAV_PARAM_TYPE; PARAM_SET has no place for 64 bits
    mavlink.MAV_PARAM_TYPE_UINT8: "<B",
    mavlink.MAV_PARAM_TYPE_INT8: "<b",
    mavlink.MAV_PARAM_TYPE_UINT16: "<H",
    mavlink.MAV_PARAM_TYPE_INT16: "<h",
    mavlink.MAV_PARAM_TYPE_UINT32: "<I",
    mavlink.MAV_PARAM_TYPE_INT32: "<i",
    _FLOAT: "<f",
}


@dataclass(frozen=True, slots=True)
class KeptState:
    """What a vehicle had before.

    Attributes:
        uid: of the vehicle, as `VehicleClient.identity`; empty: the file does not say.
        parameters: old values.
        fence: the old fence, empty if there was none; None: it was not replaced.
    """

    uid: str
    parameters: tuple[ParameterValue, ...] = ()
    fence: tuple[FenceItem, ...] | None = None


def write_kept(path: Path, system_id: int, kept: KeptState) -> None:
    """Write a file for return.

    Raises:
        SettingError: it cannot be written.
    """
    lines = [f"{_UID}\t{kept.uid}"] if kept.uid else []
    if kept.fence is not None:
        lines.append(f"{_FENCE}\t{len(kept.fence)}")
        lines += [_item_line(item) for item in kept.fence]
    lines += parameter_lines(system_id, kept.parameters)
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise SettingError(f"{path}: cannot be written ({error.strerror}); nothing was set") from None


def parameter_lines(system_id: int, parameters: Iterable[ParameterValue]) -> list[str]:
    """The lines of a file with parameters of a vehicle."""
    lines = [_HEADER]
    for each in parameters:
        number = f"{each.value:.18g}" if each.kind == _FLOAT else f"{round(each.value)}"
        lines.append(f"{system_id}\t{AUTOPILOT_COMPONENT_ID}\t{each.name}\t{number}\t{each.kind}")
    return lines


def load_kept(path: Path) -> KeptState:
    """Read a file for return, of this program or of QGroundControl.

    Raises:
        SettingError: there is none, it is too large, a line is not understood or cannot be sent, or lines are
            of several vehicles or of another component than the autopilot.
    """
    try:
        text = read_text(path, _MAX_FILE_BYTES)
    except TextError as error:
        raise SettingError(f"{OPTION} {path}: {error}") from None
    uid, count = "", None
    items: list[FenceItem] = []
    parameters: list[ParameterValue] = []
    vehicles: set[tuple[str, ...]] = set()
    for number, line in enumerate(text.split("\n"), 1):
        kind, _, rest = line.partition("\t")
        try:
            if kind == _UID:
                uid = rest.strip()
            elif kind == _FENCE:
                count = int(rest)
            elif kind == _ITEM:
                items.append(_parsed_item(rest))
            elif line.strip() and not line.startswith("#"):
                parameters.append(_parsed(line))
                vehicles.add(tuple(line.split("\t")[:2]))
        except ValueError:
            raise SettingError(
                f"{OPTION} {path}: line {number} is not understood, or a number is too large; a parameter is "
                "vehicle, component, name, value and type, separated by tabs"
            ) from None
    if len(vehicles) > 1 or any(component != str(AUTOPILOT_COMPONENT_ID) for _, component in vehicles):
        found = ", ".join(" ".join(each) for each in sorted(vehicles))
        raise SettingError(
            f"{OPTION} {path}: has parameters of vehicle and component {found}; use a copy with those of one "
            f"vehicle's autopilot, component {AUTOPILOT_COMPONENT_ID}"
        )
    if count is None and not parameters:
        raise SettingError(f"{OPTION} {path}: holds no parameters and no fence")
    if len(items) != (count or 0) or len(items) > MAX_ITEMS:
        raise SettingError(
            f"{OPTION} {path}: has {len(items)} items of a fence of {count or 0} (at most {MAX_ITEMS}); "
            "use a copy"
        )
    return KeptState(uid, tuple(parameters), None if count is None else tuple(items))


def check_vehicle(kept: KeptState, path: Path, uid: str) -> None:
    """Raise SettingError if the values are not known to be this vehicle's.

    Args:
        kept: from the file.
        path: of the file, for the message.
        uid: of the vehicle on the link; empty if it reports none.
    """
    if kept.uid and kept.uid == uid:
        return
    advice = f"connect the right one, or add {OVERRIDE} if you are sure"
    if not kept.uid:
        raise SettingError(f"{OPTION} {path}: does not say of which vehicle its values are; {advice}")
    here = f"the one on the link has {uid}" if uid else "the one on the link reports no number"
    raise SettingError(
        f"{OPTION} {path}: the values are of the vehicle with the number {kept.uid}, but {here}; {advice}"
    )


def restore(client: VehicleClient, kept: KeptState, tell: Callable[[str], None]) -> None:
    """Return parameters and fence to a disarmed vehicle.

    Args:
        client: of the vehicle.
        kept: what it had.
        tell: called with a line for each thing that was returned.

    Raises:
        VehicleError: the vehicle is armed, or one thing could not be set; those before it are.
    """
    if client.session.armed:
        raise VehicleError("the vehicle is armed; land and disarm it before its parameters are changed")
    for parameter in kept.parameters:
        client.set_parameter(parameter)
        tell(f"{parameter.name} is {parameter.value:g} now")
    if kept.fence is not None:
        upload_fence(client, kept.fence)
        count = len(kept.fence)
        tell(f"the fence has {count} items, as before" if count else "there is no fence, as before")


def _item_line(item: FenceItem) -> str:
    numbers = (item.command, item.frame, *(f"{each:.9g}" for each in item.params), item.x, item.y)
    return "\t".join(map(str, (_ITEM, *numbers, f"{item.z:.9g}")))


def _parsed_item(text: str) -> FenceItem:
    fields = text.split("\t")
    if len(fields) != _ITEM_FIELDS - 1:
        raise ValueError(text)
    params = (float(fields[2]), float(fields[3]), float(fields[4]), float(fields[5]))
    command, frame, x, y, z = *map(int, (*fields[:2], *fields[6:8])), float(fields[8])
    _check_fits(_ITEM_LAYOUT, command, frame, *params, z, x, y)
    return FenceItem(command, frame, params, x, y, z)


def _parsed(line: str) -> ParameterValue:
    fields = line.split("\t")
    if len(fields) != _FIELDS:
        raise ValueError(line)
    name, value, kind = fields[2], float(fields[3]), int(fields[4])
    if kind not in _LAYOUTS or not isfinite(value) or (kind != _FLOAT and not value.is_integer()):
        raise ValueError(line)
    _check_fits(_LAYOUTS[kind], value if kind == _FLOAT else int(value))
    if not name.isascii() or not name.isprintable() or not 0 < len(name) <= _NAME_BYTES:
        raise ValueError(line)
    return ParameterValue(name, value, kind)


def _check_fits(layout: str, *numbers: float) -> None:
    """Raise ValueError if MAVLink's fields cannot hold the numbers."""
    try:
        struct.pack(layout, *numbers)
    except (struct.error, OverflowError) as error:
        raise ValueError(str(error)) from None
