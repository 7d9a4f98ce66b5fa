"""What a vehicle had before a flight, in a file: parameters that were set, and the fence that was replaced.

The file has the format of QGroundControl's parameter files, which can load it as well:
https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/parameters.html
Vehicle and fence are in comments, which QGroundControl skips.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from errors import SettingError
from framerunner.preflight.fence_upload import FenceItem, upload_fence
from framerunner.preflight.parameters import ParameterValue, set_parameter
from framerunner.preflight.session import VehicleSession
from offboard.drone import DroneError
from wire.dialect import AUTOPILOT_COMPONENT_ID, mavlink

OPTION = "--restore-parameters"
OVERRIDE = "--any-vehicle"
_FLOAT = mavlink.MAV_PARAM_TYPE_REAL32
_HEADER = "# vehicle-id component-id name value type"
_UID, _FENCE, _ITEM = "# vehicle-uid", "# fence-items", "# fence-item"
_NAME_BYTES = 16
_FIELDS = 5
_ITEM_FIELDS = 10


@dataclass(frozen=True, slots=True)
class KeptState:
    """What a vehicle had before.

    Attributes:
        uid: of the vehicle, as `VehicleSession.uid`; empty: the file does not say.
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
    lines.append(_HEADER)
    for each in kept.parameters:
        number = f"{each.value:.18g}" if each.kind == _FLOAT else f"{round(each.value)}"
        lines.append(f"{system_id}\t{AUTOPILOT_COMPONENT_ID}\t{each.name}\t{number}\t{each.kind}")
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise SettingError(f"{path}: cannot be written ({error.strerror}); nothing was set") from None


def load_kept(path: Path) -> KeptState:
    """Read a file for return, of this program or of QGroundControl.

    Raises:
        SettingError: there is none, or a line is not understood.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "no text"
        raise SettingError(f"{OPTION} {path}: cannot be read ({reason})") from None
    uid, count = "", None
    items: list[FenceItem] = []
    parameters: list[ParameterValue] = []
    for number, line in enumerate(text.splitlines(), 1):
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
        except ValueError:
            raise SettingError(
                f"{OPTION} {path}: line {number} is not understood; a parameter is vehicle, component, name, "
                "value and type, separated by tabs"
            ) from None
    if count is None and not parameters:
        raise SettingError(f"{OPTION} {path}: holds no parameters and no fence")
    if len(items) != (count or 0):
        raise SettingError(f"{OPTION} {path}: has {len(items)} items of a fence of {count or 0}; use a copy")
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


def restore(session: VehicleSession, kept: KeptState, tell: Callable[[str], None]) -> None:
    """Return parameters and fence to a disarmed vehicle.

    Args:
        session: with the vehicle.
        kept: what it had.
        tell: called with a line for each thing that was returned.

    Raises:
        DroneError: the vehicle is armed, or one thing could not be set; those before it are.
    """
    if session.record.armed:
        raise DroneError("the vehicle is armed; land and disarm it before its parameters are changed")
    for parameter in kept.parameters:
        set_parameter(session, parameter)
        tell(f"{parameter.name} is {parameter.value:g} again")
    if kept.fence is not None:
        upload_fence(session, kept.fence)
        count = len(kept.fence)
        tell(f"the fence has its {count} items again" if count else "there is no fence again")


def _item_line(item: FenceItem) -> str:
    numbers = (item.command, item.frame, *(f"{each:.9g}" for each in item.params), item.x, item.y)
    return "\t".join(map(str, (_ITEM, *numbers, f"{item.z:.9g}")))


def _parsed_item(text: str) -> FenceItem:
    fields = text.split("\t")
    if len(fields) != _ITEM_FIELDS - 1:
        raise ValueError(text)
    first, second, third, fourth = map(float, fields[2:6])  # a circle's unused ones may be NaN
    whole = (int(fields[0]), int(fields[1]))
    return FenceItem(*whole, (first, second, third, fourth), int(fields[6]), int(fields[7]), float(fields[8]))


def _parsed(line: str) -> ParameterValue:
    fields = line.split("\t")
    if len(fields) != _FIELDS:
        raise ValueError(line)
    name, value, kind = fields[2], float(fields[3]), int(fields[4])
    whole = kind == _FLOAT or value.is_integer()
    if not 0 < len(name.encode()) <= _NAME_BYTES or not isfinite(value) or not whole:
        raise ValueError(line)
    return ParameterValue(name, value, kind)
