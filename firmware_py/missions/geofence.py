"""The fence: polygons, circles and distances from home that the vehicle must not leave; skeleton."""

from __future__ import annotations

from dataclasses import dataclass

from firmware_py.missions.flight import View
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from firmware_py.types import Vec3


@dataclass(frozen=True, slots=True)
class Breach:
    """The fence was left; `text` names which."""

    text: str


class Geofence:
    """The store's fence and the GF_ parameters, prepared for quick checks."""

    def __init__(self, store: MissionStore, parameters: Parameters) -> None:
        self._store = store
        self._parameters = parameters

    def check(self, view: View) -> Breach | None:
        """Whether the vehicle is outside (with GF_PREDICT: will be before it can stop)."""
        return self.breach_at(view.position_ned_m, view)

    def breach_at(self, position_ned_m: Vec3, view: View) -> Breach | None:
        """Whether a place is outside, for a place to go to."""
        return None
