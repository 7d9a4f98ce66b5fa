"""Climbs or sinks before a steep flight: the camera does not see what is far above or below."""

from __future__ import annotations

from math import atan2, cos, hypot, remainder, sin, tau
from typing import Final

from framerunner.geometry.vectors import Vec3
from offboard.drone import DroneState, VelocityFluCommand
from offboard.navigation.goals import FlightStyle
from offboard.navigation.seen_space import ViewedSpace
from scenarios.models import Arena

_SLOPE: Final = 0.35  # height above or below, for its distance, at which a place is well in view
_STEEP_M: Final = 0.2  # by which a place must be above or below that, to stop the drone
_BESIDE_RAD: Final = 0.8  # likewise, by which it must be beside the camera's axis
_REACHED_M: Final = 0.1
_FACED_RAD: Final = 0.3
_WAIT_S: Final = 0.6  # at that height, for the place to come into view
_LONGEST_S: Final = 5.0
_TURN_PER_S: Final = 2.0
_TURN_RAD_S: Final = 0.9
_CLIMB_PER_S: Final = 4.0
_CLIMB_M_S: Final = 0.9
_CREEP_M_S: Final = 0.4  # towards the place meanwhile, but not nearer than this:
_AWAY_M: Final = 0.5


class Lookout:
    """Brings one place at a time into view.

    Args:
        arena: its height limits climbs.
        style: how near the drone may come to floor and ceiling.
    """

    def __init__(self, arena: Arena, style: FlightStyle) -> None:
        self._low_m, self._high_m = style.floor_margin_m, arena.height_m - style.side_margin_m
        self._place_m: Vec3 | None = None
        self._began_s = self._reached_s = 0.0

    @property
    def active(self) -> bool:
        """A place is being brought into view."""
        return self._place_m is not None

    def leave(self) -> None:
        """Look no longer."""
        self._place_m = None

    def begin(self, places_m: list[Vec3], state: DroneState, viewed: ViewedSpace) -> bool:
        """Look at the first of the places on a path that was not in view; false if none is steep."""
        hidden_m = viewed.first_unviewed(places_m, (state.x, state.y, state.z))
        if hidden_m is None:
            return False
        beside = abs(turn_to(hidden_m, state)) > _BESIDE_RAD
        if not beside and abs(self._rise_m(hidden_m, state)) < _STEEP_M:
            return False
        self._place_m = hidden_m
        self._began_s = self._reached_s = state.time_us * 1e-6
        return True

    def command(self, state: DroneState, viewed: ViewedSpace) -> VelocityFluCommand | None:
        """Face the place and climb or sink; None once it was in view, or does not come into view."""
        place_m, now_s = self._place_m, state.time_us * 1e-6
        if place_m is None:
            return None
        rise_m, away_m = self._rise_m(place_m, state), hypot(place_m[0] - state.x, place_m[1] - state.y)
        turn_rad = turn_to(place_m, state)
        if abs(turn_rad) > _FACED_RAD or abs(rise_m) > _REACHED_M:
            self._reached_s = now_s
        gives_up = now_s - self._reached_s > _WAIT_S or now_s - self._began_s > _LONGEST_S
        if gives_up:
            viewed.excuse(place_m)
        if gives_up or viewed.is_viewed(place_m):
            self._place_m = None
            return None
        creep_m_s = min(max(away_m - _AWAY_M, 0.0), _CREEP_M_S)
        return VelocityFluCommand(
            creep_m_s * cos(turn_rad),
            creep_m_s * sin(turn_rad),
            min(max(_CLIMB_PER_S * rise_m, -_CLIMB_M_S), _CLIMB_M_S),
            min(max(_TURN_PER_S * turn_rad, -_TURN_RAD_S), _TURN_RAD_S),
        )

    def _rise_m(self, place_m: Vec3, state: DroneState) -> float:
        """How far to climb until a place is well in view; below zero to sink."""
        reach_m = _SLOPE * hypot(place_m[0] - state.x, place_m[1] - state.y)
        height_m = min(max(state.z, place_m[2] - reach_m), place_m[2] + reach_m)
        return min(max(height_m, self._low_m), self._high_m) - state.z


def turn_to(place_m: Vec3, state: DroneState) -> float:
    """The turn to the left that makes the drone face a place."""
    return remainder(atan2(place_m[1] - state.y, place_m[0] - state.x) - state.yaw, tau)
