"""Flies the mission of the store, item by item; skeleton."""

from __future__ import annotations

from firmware_py.missions.flight import IssuedCommand, Leg, LegKind, View
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from firmware_py.types import StatusText


class MissionExecutor:
    """Decides what to fly next. `enter` at mode entry, `step` each tick, `leave` at mode exit."""

    def __init__(self, store: MissionStore, parameters: Parameters) -> None:
        self._store = store
        self._parameters = parameters

    def enter(self, view: View) -> None:
        """Begin, or go on at the current item."""

    def step(self, view: View) -> Leg:
        """What to fly now."""
        return Leg(LegKind.DONE, view.position_ned_m)

    def leave(self) -> None:
        """The mode has ended: stop what the mission had switched on."""

    def disarmed(self) -> None:
        """The motors have stopped: a mission that is done begins again from its first item."""

    def take_events(self) -> list[IssuedCommand | StatusText]:
        """What happened since the last call, oldest first."""
        return []
