"""The navigator: gives the legs of the stored mission, checks the fence, and knows where a return goes."""

from __future__ import annotations

from firmware_py.geodesy import GeoReference
from firmware_py.missions import rally
from firmware_py.missions.executor import MissionExecutor
from firmware_py.missions.flight import IssuedCommand, Leg, View
from firmware_py.missions.geofence import Breach, Geofence
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from firmware_py.types import StatusText, VehicleState
from geometry.vectors import Vec3

_MAX_ISSUED = 100


class Navigator:
    """Joins mission, fence and rally points.

    Args:
        store: mission, fence and rally points.
        parameters: MIS_, NAV_, GF_ and RTL_.

    Attributes:
        store: see above.
        view: the vehicle as missions see it.
    """

    __slots__ = ("_executor", "_fence", "_issued", "_leg", "_parameters", "store", "view")

    def __init__(self, store: MissionStore, parameters: Parameters) -> None:
        self.store = store
        self.view = View()
        self._parameters = parameters
        self._executor = MissionExecutor(store, parameters)
        self._fence = Geofence(store, parameters)
        self._leg: Leg | None = None
        self._issued: list[IssuedCommand] = []

    def observe(self, state: VehicleState, geo: GeoReference, *, landed: bool) -> None:
        """Bring the view up to date."""
        view = self.view
        view.time_us = state.time_us
        view.position_ned_m = state.position_ned_m
        view.velocity_ned_m_s = state.velocity_ned_m_s
        view.yaw_rad = state.yaw_rad
        view.landed = landed
        view.projection = geo.projection
        view.home_ned_m = geo.home_ned_m if geo.home is not None else None

    def enter_mission(self) -> None:
        """Begin the mission, or go on with it."""
        self._leg = None
        self._executor.enter(self.view)

    def leave_mission(self) -> None:
        """Another mode is flown now."""
        self._executor.leave()

    def disarmed(self) -> None:
        """The motors have stopped."""
        self._executor.disarmed()

    def next_leg(self) -> Leg | None:
        """Take the mission one tick further; the leg to fly from now on, None: as before."""
        leg = self._executor.step(self.view)
        if leg is self._leg:
            return None
        self._leg = leg
        return leg

    def breach(self) -> Breach | None:
        """What part of the fence is broken now; None: none."""
        return self._fence.check(self.view)

    def breach_at(self, position_ned_m: Vec3) -> Breach | None:
        """What part of the fence a place is behind; None: none."""
        return self._fence.breach_at(position_ned_m, self.view)

    def return_place(self) -> Vec3 | None:
        """Where a return goes from here, NED metres; None before home is known."""
        found = rally.destination(self.view, self.store, self._parameters)
        return None if found is None else found.position_ned_m

    def take_texts(self) -> list[StatusText]:
        """What people are to be told since the last call; commands to others are kept for `take_issued`."""
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
