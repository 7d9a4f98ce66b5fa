"""The navigator: flies the stored mission by legs, checks the fence, and chooses a return's destination."""

from __future__ import annotations

from math import hypot, inf, isfinite

from firmware_py.missions.checks import mission_faults
from firmware_py.missions.executor import MissionExecutor
from firmware_py.missions.flight import IssuedCommand, MissionLeg, VehicleView
from firmware_py.missions.geofence import Geofence
from firmware_py.missions.items import Do
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from firmware_py.types import StatusText, VehicleState
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.geodesy import GeoReference

_MAX_ISSUED = 100
_NEARER_M = 2.0  # another place must be nearer than the best so far by this
_OF_HOME_M = 10.0  # a rally point this near to home counts as home
_HOME_OR_RALLY, _NOT_HOME, _MISSION_PATH, _NEAREST, _FEWEST_ITEMS = range(5)  # RTL_TYPE


class MissionNavigator:
    """Combines mission, fence and rally points.

    Args:
        store: of all three.
        parameters: MIS_, NAV_, GF_ and RTL_.
    """

    def __init__(self, store: MissionStore, parameters: Parameters) -> None:
        self._store = store
        self._view = VehicleView()
        self._parameters = parameters
        self._executor = MissionExecutor(store, parameters)
        self._fence = Geofence(store, parameters)
        self._checked: tuple[int, int, bool] = (0, 0, False)
        self._leg: MissionLeg | None = None
        self._issued: list[IssuedCommand] = []

    def observe(self, state: VehicleState, geo: GeoReference, *, landed: bool) -> None:
        """Update the view of the vehicle."""
        view = self._view
        view.time_us = state.time_us
        view.position_ned_m = state.position_ned_m
        view.velocity_ned_m_s = state.velocity_ned_m_s
        view.yaw_rad = state.yaw_rad
        view.landed = landed
        view.projection = geo.projection
        view.home_ned_m = geo.home_ned_m if geo.home is not None else None

    def check_mission(self, state: VehicleState, geo: GeoReference, *, landed: bool) -> list[StatusText]:
        """Check whether the mission can be flown, if it, the fence or home has changed; texts for people."""
        store, before = self._store, self._checked
        self._checked = now = (store.mission.version, store.fence.version, geo.home is not None)
        if now == before:
            return []
        self.observe(state, geo, landed=landed)
        if now[1:] != before[1:]:
            self._fence.breach_at(state.position_ned_m, self._view)
        store.valid, texts = mission_faults(store.mission.items, self._view, self._parameters, self._fence)
        return [*self._fence.take_texts(), *texts]

    def enter_mission(self) -> None:
        """Begin or continue the mission."""
        self._leg = None
        self._executor.enter(self._view)

    def leave_mission(self) -> None:
        """Mission mode has ended."""
        self._executor.leave()

    def disarmed(self) -> None:
        """The motors have stopped."""
        self._executor.disarmed()

    def next_leg(self) -> MissionLeg | None:
        """The mission's leg from this tick on; None: unchanged."""
        leg = self._executor.step(self._view)
        if leg is self._leg:
            return None
        self._leg = leg
        return leg

    def breach(self) -> str | None:
        """How the vehicle breaches the fence now, for people; None: it does not."""
        return _breach_text(self._fence.check(self._view))

    def breach_at(self, position_ned_m: Vec3) -> str | None:
        """How a place breaches the fence, for people; None: it does not."""
        return _breach_text(self._fence.breach_at(position_ned_m, self._view))

    def return_place(self) -> Vec3 | None:
        """A return's destination from here, NED metres; None before home is known."""
        return return_place(self._view, self._store, self._parameters)

    def take_texts(self) -> list[StatusText]:
        """Texts for people since the last call; commands to others are kept for `take_issued`."""
        texts = []
        for event in self._executor.take_events():
            if isinstance(event, StatusText):
                texts.append(event)
            elif len(self._issued) < _MAX_ISSUED:
                self._issued.append(event)
        return texts

    def take_issued(self) -> list[IssuedCommand]:
        """Commands to others since the last call."""
        taken, self._issued = self._issued, []
        return taken


def _breach_text(breach: str | None) -> str | None:
    return None if breach is None else f"Geofence violation: {breach}"


def return_place(view: VehicleView, store: MissionStore, parameters: Parameters) -> Vec3 | None:
    """A return's destination by RTL_TYPE and PX4's rules, NED metres; None before home is known.

    Heights such as RTL_RETURN_ALT count from there. The types that follow the mission's own path (2 and 4)
    are flown straight: to its landing if it has one, else home.
    """
    home_ned_m = view.home_ned_m
    if home_ned_m is None:
        return None
    rtl_type = parameters.integer("RTL_TYPE")
    follows_mission = rtl_type in (_MISSION_PATH, _FEWEST_ITEMS)
    best_ned_m, min_m = home_ned_m, _distance_m(view.position_ned_m, home_ned_m)
    if rtl_type == _NOT_HOME or follows_mission:
        min_m = inf
    places = []
    if rtl_type != _HOME_OR_RALLY and store.valid:
        landing = next((item for item in store.mission.items if item.command == Do.LAND), None)
        if landing is not None:
            places.append(view.place_of(landing))
    if not follows_mission:
        rally_points = (view.place_of(item) for item in store.rally.items if item.command == Do.RALLY_POINT)
        places += [place for place in rally_points if _distance_m(home_ned_m, place) > _OF_HOME_M]
    for place_ned_m in places:
        distance_m = _distance_m(view.position_ned_m, place_ned_m)
        if distance_m + _NEARER_M < min_m and all(map(isfinite, place_ned_m)):
            best_ned_m, min_m = place_ned_m, distance_m
    return best_ned_m


def _distance_m(one_ned_m: Vec3, other_ned_m: Vec3) -> float:
    return hypot(one_ned_m[0] - other_ned_m[0], one_ned_m[1] - other_ned_m[1])
