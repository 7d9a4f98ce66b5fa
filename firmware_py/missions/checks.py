"""Whether a mission can be flown: PX4's checks after an upload and before a start."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import hypot, isnan

from firmware_py.missions.flight import VehicleView
from firmware_py.missions.geofence import Geofence
from firmware_py.missions.items import Do, MissionItem
from firmware_py.missions.route import jump_of
from firmware_py.parameters import Parameters
from firmware_py.types import CRITICAL, INFO, StatusText

_NOT_FLOWN = frozenset({Do.CONDITION_DELAY, Do.CONDITION_DISTANCE})  # accepted at upload, as by PX4
_VTOL = frozenset({Do.VTOL_TAKEOFF, Do.VTOL_LAND, Do.VTOL_TRANSITION})
_MIN_GATE_DISTANCE_M = 0.05


def mission_faults(
    items: Sequence[MissionItem], view: VehicleView, parameters: Parameters, fence: Geofence
) -> tuple[bool, list[StatusText]]:
    """Check a mission.

    Args:
        items: of the mission.
        view: of the vehicle now.
        parameters: for MIS_DIST_1WP.
        fence: in which all places must be.

    Returns:
        Whether it can be flown, and texts for people, some of which are only warnings.
    """
    if not items:
        return False, []
    if view.home_ned_m is None or view.projection is None:
        return False, [StatusText(INFO, "Not yet ready for mission, no position lock.")]
    faults = [
        fault
        for faults in (
            _item_faults(items, view),
            _takeoff_faults(items, view),
            _gate_faults(items, view),
            _fence_faults(items, view, fence),
        )
        for fault in faults
    ]
    texts = [*faults, *_first_place_warnings(items, view, parameters)]
    return not faults, [StatusText(CRITICAL, text) for text in texts]


def _item_faults(items: Sequence[MissionItem], view: VehicleView) -> Iterator[str]:
    if items[0].command == Do.LAND and view.landed:
        yield "Mission rejected: starts with landing"
    for item in items:
        if item.command in _NOT_FLOWN:
            yield f"Mission rejected: item {item.seq + 1}: unsupported cmd: {item.command}"
        elif item.command in _VTOL:
            yield "Mission rejected: Mission contains VTOL items but vehicle is not a VTOL"
        elif item.command == Do.JUMP and not 0 <= jump_of(item)[0] < len(items):
            target = jump_of(item)[0]
            yield f"Mission rejected: item {item.seq + 1} jumps to item {target + 1} of {len(items)}"


def _takeoff_faults(items: Sequence[MissionItem], view: VehicleView) -> Iterator[str]:
    """A take-off must be before all other places and lead upwards."""
    home_down_m = view.home_ned_m[2] if view.home_ned_m is not None else 0.0
    place_seen = False
    for item in items:
        if item.command == Do.TAKEOFF:
            if home_down_m - view.place_of(item)[2] <= 0.0:
                yield "Mission rejected: Takeoff altitude below home altitude!"
            if place_seen:
                yield "Mission rejected: takeoff not first waypoint item"
        place_seen = place_seen or item.has_place or item.command == Do.CONDITION_GATE


def _gate_faults(items: Sequence[MissionItem], view: VehicleView) -> Iterator[str]:
    """A gate and the places before and after it must differ, to have a direction."""
    before: MissionItem | None = None
    for item in items:
        if not item.has_place and item.command != Do.CONDITION_GATE:
            continue
        if before is not None and Do.CONDITION_GATE in (item.command, before.command):
            one_ned_m, other_ned_m = view.place_of(before), view.place_of(item)
            apart_m = hypot(one_ned_m[0] - other_ned_m[0], one_ned_m[1] - other_ned_m[1])
            if apart_m < _MIN_GATE_DISTANCE_M:
                yield f"Distance between waypoint and gate too close: {apart_m:.2f} meters"
        before = item


def _fence_faults(items: Sequence[MissionItem], view: VehicleView, fence: Geofence) -> Iterator[str]:
    for item in items:
        if not item.has_place:
            continue
        north_m, east_m, down_m = view.place_of(item)
        if isnan(north_m):
            continue  # at the vehicle's position then
        breach = fence.breach_at((north_m, east_m, down_m), view)
        if breach is not None:
            yield f"Geofence violation for waypoint {item.seq + 1}: {breach}"
            return


def _first_place_warnings(
    items: Sequence[MissionItem], view: VehicleView, parameters: Parameters
) -> Iterator[str]:
    limit_m, home_ned_m = parameters.value("MIS_DIST_1WP"), view.home_ned_m
    first = next((item for item in items if item.has_place), None)
    if limit_m <= 0.0 or first is None or home_ned_m is None:
        return
    north_m, east_m, _ = view.place_of(first)
    distance_m = hypot(north_m - home_ned_m[0], east_m - home_ned_m[1])
    if distance_m >= limit_m:
        yield f"First waypoint far away from home: {distance_m:.0f}m. Correct mission loaded?"
