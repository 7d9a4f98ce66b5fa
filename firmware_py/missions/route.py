"""The order of a mission's items: jumps, the next place, and the settings that earlier items have made."""

from __future__ import annotations

from collections.abc import MutableMapping, Sequence
from math import inf, isfinite, nan

from firmware_py.missions.items import Do, MissionItem

_MAX_JUMPS = 10  # jumps that lead to jumps; PX4 stops then, too
_STOPS = frozenset(
    {Do.DELAY, Do.RETURN_TO_LAUNCH, Do.ARM_DISARM, Do.LAND, Do.VTOL_LAND, Do.GRIPPER, Do.WINCH}
)
_TRIGGERS = frozenset(
    {
        Do.SET_CAM_TRIGG_DIST,
        Do.SET_CAM_TRIGG_INTERVAL,
        Do.TRIGGER_CONTROL,
        Do.IMAGE_START_CAPTURE,
        Do.IMAGE_STOP_CAPTURE,
    }
)
_KEPT = (Do.SET_CAMERA_MODE, Do.GIMBAL_CONFIGURE, Do.GIMBAL_PITCHYAW)

Items = Sequence[MissionItem]
Jumps = MutableMapping[int, int]
"""How often each jump item has been followed."""


def jump_of(item: MissionItem) -> tuple[int, float]:
    """A jump's target, and how often to follow it (a negative number: for ever)."""
    target, repeats = item.params[0], item.params[1]
    return int(target) if isfinite(target) else -1, inf if repeats < 0 else repeats


def behind_jumps(items: Items, index: int, jumps: Jumps, *, follow: bool) -> int | None:
    """The first item from an index on that is no jump; None when jumps lead out of the mission.

    Args:
        items: of the mission.
        index: where to begin.
        jumps: how often each was followed.
        follow: count the jumps that are followed.
    """
    for _ in range(_MAX_JUMPS):
        if not 0 <= index < len(items):
            return None
        item = items[index]
        if item.command != Do.JUMP:
            return index
        target, repeats = jump_of(item)
        if jumps.get(index, 0) < repeats:
            if follow:
                jumps[index] = jumps.get(index, 0) + 1
            index = target
        else:
            index += 1
    return None


def next_place(items: Items, index: int, jumps: Jumps, *, without_stop: bool = False) -> MissionItem | None:
    """The first item from an index on that has a place.

    Args:
        items: of the mission.
        index: where to begin.
        jumps: how often each was followed.
        without_stop: return None if the vehicle has to stop before.
    """
    for _ in range(len(items)):
        found = behind_jumps(items, index, jumps, follow=False)
        if found is None:
            return None
        item = items[found]
        if without_stop and item.command in _STOPS:
            return None
        if item.has_place:
            return item
        index = found + 1
    return None


def next_without_stop(items: Items, item: MissionItem, jumps: Jumps) -> MissionItem | None:
    """The next item with a place after one at which the vehicle need not stop; None: it stops."""
    if not item.autocontinue or item.hold_us > 0 or item.command == Do.LOITER_UNLIM:
        return None
    return next_place(items, item.seq + 1, jumps, without_stop=True)


def place_before(items: Items, index: int) -> int | None:
    """The nearest earlier item that has a place."""
    return next((seq for seq in range(index - 1, -1, -1) if items[seq].has_place), None)


def speed_before(items: Items, index: int) -> float:
    """The speed in m/s that earlier items have set; NaN: none."""
    for item in reversed(items[:index]):
        if item.command == Do.CHANGE_SPEED:
            return commanded_speed(item)
    return nan


def commanded_speed(item: MissionItem) -> float:
    """The speed in m/s of a speed item; NaN: back to MPC_XY_CRUISE."""
    speed_m_s = item.params[1]
    return speed_m_s if isfinite(speed_m_s) and speed_m_s > 0.0 else nan


def trigger_before(items: Items, index: int) -> MissionItem | None:
    """The earlier item by which a camera takes repeated pictures at this one; None: there is none."""
    for item in reversed(items[:index]):
        if item.command in _TRIGGERS:
            return item if _takes_pictures(item) else None
    return None


def _takes_pictures(item: MissionItem) -> bool:
    match item.command:
        case Do.IMAGE_START_CAPTURE:
            return item.params[2] != 1.0  # not a single picture
        case Do.SET_CAM_TRIGG_DIST | Do.SET_CAM_TRIGG_INTERVAL:
            return item.params[0] > 0.0
        case Do.TRIGGER_CONTROL:
            return item.params[0] == 1.0
    return False


def settings_before(items: Items, index: int) -> list[MissionItem]:
    """The last of each earlier item that sets up camera or gimbal."""
    found = [next((item for item in reversed(items[:index]) if item.command == kind), None) for kind in _KEPT]
    return [item for item in found if item is not None]
