"""Legs between states: in which axes, within which limits, and how long turns of the heading take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
import numpy.typing as npt

from offboard.limits import FLOOR_M
from offboard.navigation.goals import FlightStyle
from offboard.navigation.planner.legs import Array, Legs, fastest_legs

LOOK_REACH_M = 0.5  # shorter legs to a gate are flown with the heading along them
NO_TURN_RAD = 0.1  # a smaller turn takes no time of its own
DESCENT_GAIN_PER_S2 = 1.5
"""A descent to a height that brakes with this times the height above the box's floor is nowhere faster than
the box allows: v^2 / 2a <= h for v = h / 1.1 s, which is `REACTION_S` and `BRAKE_HEIGHT_S`."""
_LEAST_DESCENT_M_S2 = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Ends:
    """Where legs start or end.

    Attributes:
        places_m: arena axes, shape (n, 3).
        velocities_m_s: shape (n, 3).
        yaws_rad: headings, NaN for any, shape (n,).
        turns_s: how long after a leg's end a turn to its heading may still last, shape (n,).
        at_gates: there a gate is entered, which is looked at before, shape (n,).
    """

    places_m: Array
    velocities_m_s: Array
    yaws_rad: Array
    turns_s: Array
    at_gates: npt.NDArray[np.bool_]

    def take(self, rows: npt.NDArray[np.intp]) -> Ends:
        """Some of them."""
        return Ends(
            self.places_m[rows],
            self.velocities_m_s[rows],
            self.yaws_rad[rows],
            self.turns_s[rows],
            self.at_gates[rows],
        )

    @staticmethod
    def joined(parts: Sequence[Ends]) -> Ends:
        """All of several, in their order."""
        return Ends(
            np.concatenate([part.places_m for part in parts]),
            np.concatenate([part.velocities_m_s for part in parts]),
            np.concatenate([part.yaws_rad for part in parts]),
            np.concatenate([part.turns_s for part in parts]),
            np.concatenate([part.at_gates for part in parts]),
        )


class Connector:
    """Makes legs; obstacles are left out.

    Args:
        style: how boldly to fly.
    """

    def __init__(self, style: FlightStyle) -> None:
        self._style = style
        self._speeds: Array = np.array([style.axis_speed_m_s, style.axis_speed_m_s, style.climb_speed_m_s])
        self._accelerations: Array = np.array(
            [style.acceleration_m_s2, style.acceleration_m_s2, style.climb_acceleration_m_s2]
        )

    def legs(self, starts: Ends, ends: Ends) -> Legs:
        """The fastest legs, each from one start to the end of the same index."""
        return fastest_legs(
            (starts.places_m, ends.places_m),
            (starts.velocities_m_s, ends.velocities_m_s),
            self._headings(ends.places_m - starts.places_m, starts.yaws_rad, ends),
            speed_m_s=self._speeds,
            limit=self._acceleration_limits(starts.places_m[:, 2], ends.places_m[:, 2]),
            least_s=self._turn_times(starts.yaws_rad, ends),
        )

    def _headings(self, way: Array, yaw_before: Array, ends: Ends) -> Array:
        """Headings of the legs' axes; where they may differ from the direction, both axes are used."""
        limit, yaw_after = self._style.look_offset_rad, ends.yaws_rad
        bearing = np.arctan2(way[:, 1], way[:, 0])
        reach = np.hypot(way[:, 0], way[:, 1])
        aside = np.where(np.isnan(yaw_before), 0.0, wrap(yaw_before - bearing))
        side = np.where(np.abs(aside) > NO_TURN_RAD, aside, wrap(yaw_after - bearing))
        looking = np.copysign(limit, side) * np.clip(reach - LOOK_REACH_M, 0.0, 1.0)
        quarter = np.floor(aside / (pi / 2)) * (pi / 2) + pi / 4
        if not limit:
            quarter = np.round(aside / (pi / 2)) * (pi / 2)
        offset = np.where(ends.at_gates, looking, np.where(np.isnan(yaw_after), quarter, 0.0))
        upright = np.where(np.isnan(yaw_before), 0.0, yaw_before)
        turn: Array = np.where(reach > 1e-6, bearing + offset, upright)
        return turn

    def _turn_times(self, yaw_before: Array, ends: Ends) -> Array:
        """Times that turns need within legs; none where a heading is free or the turn small."""
        turn = np.abs(wrap(ends.yaws_rad - yaw_before))
        needed = turn / self._style.yaw_rate_rad_s + self._style.turn_smoothing_s - ends.turns_s
        return np.maximum(np.where(turn > NO_TURN_RAD, needed, 0.0), 0.0)

    def _acceleration_limits(self, before_m: Array, after_m: Array) -> Array:
        """Of each leg's axes, shape (n, 3): descents brake early enough for the box's floor."""
        acceleration = np.tile(self._accelerations, (len(before_m), 1))
        gentle = DESCENT_GAIN_PER_S2 * (after_m - FLOOR_M)
        gentle = np.clip(gentle, _LEAST_DESCENT_M_S2, acceleration[:, 2])
        acceleration[:, 2] = np.where(after_m < before_m, gentle, acceleration[:, 2])
        return acceleration


def wrap(angle: Array) -> Array:
    """Angles between -pi and pi."""
    wrapped: Array = (angle + pi) % (2 * pi) - pi
    return wrapped
