"""Where a return goes: home, the nearest rally point, or the mission's landing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from math import hypot, inf, isfinite

from firmware_py.missions.flight import View
from firmware_py.missions.items import Do, MissionItem
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from geometry.vectors import Vec3

_NEARER_M = 2.0  # another place must be nearer than the best so far by this
_OF_HOME_M = 10.0  # a rally point this near to home is home
_HOME_OR_RALLY, _NOT_HOME, _MISSION_PATH, _NEAREST, _FEWEST_ITEMS = range(5)


class DestinationKind(Enum):
    """What a return goes to."""

    HOME = "home"
    RALLY = "rally"
    MISSION_LANDING = "mission landing"


@dataclass(frozen=True, slots=True)
class Destination:
    """Where a return goes.

    Attributes:
        kind: what it is.
        position_ned_m: shape (3,); for heights above it, as RTL_RETURN_ALT, count from here.
        seq: the rally point's or landing's item; -1 for home.
    """

    kind: DestinationKind
    position_ned_m: Vec3
    seq: int = -1


def destination(view: View, store: MissionStore, parameters: Parameters) -> Destination | None:
    """Where RTL_TYPE sends the vehicle from here, by PX4's rules; None before home is known.

    The types that follow the mission's own path (2 and 4) are flown straight: to its landing if it has one,
    else home.
    """
    home_ned_m = view.home_ned_m
    if home_ned_m is None:
        return None
    rtl_type = parameters.integer("RTL_TYPE")
    best = Destination(DestinationKind.HOME, home_ned_m)
    follows_mission = rtl_type in (_MISSION_PATH, _FEWEST_ITEMS)
    min_m = inf if rtl_type == _NOT_HOME or follows_mission else _distance_m(view.position_ned_m, home_ned_m)
    if rtl_type != _HOME_OR_RALLY:
        for landing in _landing(view, store):
            distance_m = _distance_m(view.position_ned_m, landing.position_ned_m)
            if distance_m + _NEARER_M < min_m:
                best, min_m = landing, distance_m
    if follows_mission:
        return best
    for point in _rally_points(view, store):
        distance_m = _distance_m(view.position_ned_m, point.position_ned_m)
        of_home = _distance_m(home_ned_m, point.position_ned_m) <= _OF_HOME_M
        if not of_home and distance_m + _NEARER_M < min_m:
            best, min_m = point, distance_m
    return best


def _landing(view: View, store: MissionStore) -> Iterator[Destination]:
    """The first landing of a mission that can be flown."""
    if not store.valid:
        return
    for item in store.mission.items:
        if item.command == Do.LAND:
            yield from _at(DestinationKind.MISSION_LANDING, item, view)
            return


def _rally_points(view: View, store: MissionStore) -> Iterator[Destination]:
    for item in store.rally.items:
        if item.command == Do.RALLY_POINT:
            yield from _at(DestinationKind.RALLY, item, view)


def _at(kind: DestinationKind, item: MissionItem, view: View) -> Iterator[Destination]:
    """The destination, unless the item leaves its place open."""
    place_ned_m = view.place_of(item)
    if all(map(isfinite, place_ned_m)):
        yield Destination(kind, place_ned_m, item.seq)


def _distance_m(one_ned_m: Vec3, other_ned_m: Vec3) -> float:
    return hypot(one_ned_m[0] - other_ned_m[0], one_ned_m[1] - other_ned_m[1])
