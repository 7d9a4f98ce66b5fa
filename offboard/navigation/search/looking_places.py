"""Places to look at a gate from: in the arena and clear of obstacles, if there is one."""

from __future__ import annotations

from itertools import product
from math import atan2, cos, pi, sin

import numpy as np

from framerunner.geometry.vectors import Vec3
from offboard.navigation.goals import FlightStyle, Obstacles, Point
from offboard.navigation.planner.clearance import Clearance
from offboard.navigation.planner.legs import Array
from offboard.navigation.view import GateEstimate
from scenarios.models import Arena

BEFORE_M = (1.0, 0.85, 0.7, 0.55, 0.45)  # from a gate that is to be crossed; the first that is free
BEFORE_ASIDE_RAD = (0.0, pi, 0.3, -0.3, 0.6, -0.6)
ASIDE_M = (1.6, 1.3, 1.0)
ASIDE_RAD = (0.5, 0.9, 0.1)
BACK_M = 1.0
UP_M = 0.3
SIGHT_SHARES = np.linspace(0.1, 0.8, 8)  # of the way to a gate, where it must be free


class LookingPlaces:
    """Chooses places.

    Args:
        arena: they are in it.
        style: how far from its sides, and from obstacles.
    """

    def __init__(self, arena: Arena, style: FlightStyle) -> None:
        self._arena = arena
        self._style = style

    def before(self, gate: GateEstimate, here_m: Vec3, obstacles: Obstacles, farther_m: float = 0.0) -> Point:
        """On a gate's normal; if its yaw is not known, on the line to it.

        On the drone's side, if there is room; from a gate that is large, so much farther.
        """
        bearing = _bearing(gate, here_m)
        if not gate.ambiguous:
            normal = gate.yaw_rad
            bearing = normal if cos(bearing - normal) > 0.0 else normal + pi
        before_m = [away_m + farther_m for away_m in BEFORE_M if away_m <= self._style.look_again_m]
        places = [(away_m, bearing + aside) for aside, away_m in product(BEFORE_ASIDE_RAD, before_m)]
        return self._facing(gate, places, 0.0, obstacles)

    def aside(self, gate: GateEstimate, here_m: Vec3, side: int, obstacles: Obstacles) -> Point:
        """Away from a gate, to one side as seen from the drone (1 or -1), or else to the other."""
        bearing = _bearing(gate, here_m)
        turns = [sign * aside for sign in (side, -side) for aside in ASIDE_RAD]
        places = [(away_m, bearing + turn) for turn, away_m in product(turns, ASIDE_M)]
        return self._facing(gate, places, 0.1, obstacles)

    def back(self, here_m: Vec3, yaw_rad: float) -> Point:
        """Behind the drone and a little higher."""
        x, y, z = here_m
        place = np.array([x - BACK_M * cos(yaw_rad), y - BACK_M * sin(yaw_rad), z + UP_M])
        return Point(_inside(place, Clearance(Obstacles(), self._arena, self._style)), yaw_rad)

    def _facing(
        self, gate: GateEstimate, places: list[tuple[float, float]], up_m: float, obstacles: Obstacles
    ) -> Point:
        """The first clear place, by distance and bearing from a gate; else the first in the arena.

        Places from which the way to the gate is free are preferred.
        """
        clearance = Clearance(obstacles, self._arena, self._style)
        x, y, z = gate.position_m
        at = np.array([(x + away * cos(turn), y + away * sin(turn), z + up_m) for away, turn in places])
        at[:, 2] = np.clip(at[:, 2], clearance.low_m[2], clearance.high_m[2])
        clear = clearance.depths(at).max(axis=1) <= 0.0
        towards = at[:, None] + SIGHT_SHARES[:, None] * (np.array(gate.position_m) - at[:, None])
        hidden = clearance.column_depths(towards.reshape(-1, 3)).max(axis=1, initial=-1.0) > 0.0
        in_sight = ~hidden.reshape(len(at), -1).any(axis=1)
        place = _inside(at[int((2 * clear + in_sight).argmax())], clearance)
        return Point(place, atan2(y - place[1], x - place[0]))


def _inside(place: Array, clearance: Clearance) -> Vec3:
    x, y, z = np.clip(place, clearance.low_m, clearance.high_m).tolist()
    return (x, y, z)


def _bearing(gate: GateEstimate, here_m: Vec3) -> float:
    return atan2(here_m[1] - gate.position_m[1], here_m[0] - gate.position_m[0])
