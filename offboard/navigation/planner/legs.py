"""Legs: motions between two states; each axis accelerates evenly, keeps its speed, and does the opposite.

The axes are level ones of one heading. An axis that needs less time than the leg takes accelerates less. The
duration is the shortest for which no axis exceeds its limits (the closed form of point-mass trajectories, as
in Foehn, Romero, Scaramuzza, "Time-optimal planning for quadrotor waypoint flight", 2021, section on
sampling). All functions take many legs at once: arrays of shape (..., 3), with axes forward, left, up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import pi
from operator import itemgetter
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from offboard.limits import FLOOR_M
from offboard.navigation.goals import FlightStyle

Array = npt.NDArray[np.float64]

_STRETCHES = np.array([1.02, 1.05, 1.1, 1.16, 1.24, 1.35, 1.5, 1.7, 2.0, 2.5, 3.5, 5.0, 8.0])
_TOLERANCE = 1.005  # of the acceleration, for rounding
_SHORTEST_S = 0.02
_TINY = 1e-9


def rotate(vectors: Array, cosine: Array | float, sine: Array | float) -> Array:
    """Vectors of shape (..., 3), turned about the vertical."""
    x, y = vectors[..., 0], vectors[..., 1]
    turned = vectors.copy()
    turned[..., 0] = cosine * x - sine * y
    turned[..., 1] = sine * x + cosine * y
    return turned


def fastest_legs(
    places_m: tuple[Array, Array],
    velocities_m_s: tuple[Array, Array],
    turns_rad: Array,
    *,
    speed_m_s: Array,
    limit: Array,
    least_s: Array,
) -> Legs:
    """The fastest legs that keep the limits; if none keep them, those that exceed them least.

    Args:
        places_m: of the starts and the ends, arena axes, shape (n, 3) each.
        velocities_m_s: there, likewise.
        turns_rad: headings of the legs' axes, shape (n,).
        speed_m_s: limit of each axis, shape (3,).
        limit: of the acceleration of each axis, m/s^2, shape (n, 3).
        least_s: legs may not be shorter than this, shape (n,).
    """
    c, s = np.cos(turns_rad), np.sin(turns_rad)
    offset_m = rotate(places_m[1] - places_m[0], c, -s)
    before_m_s, after_m_s = (rotate(velocity, c, -s) for velocity in velocities_m_s)
    # Speed limits, raised where a leg starts or ends faster.
    caps = np.maximum(speed_m_s, np.maximum(np.abs(before_m_s), np.abs(after_m_s)))
    fastest = _fastest(offset_m, before_m_s, after_m_s, caps, limit)
    times = np.maximum(np.maximum(fastest.max(axis=1), least_s), _SHORTEST_S)
    a = _accelerations(offset_m, before_m_s, after_m_s, caps, times[:, None])
    late = (np.abs(a) > limit * _TOLERANCE).any(axis=1)
    if late.any():  # rare: an axis has no motion of this duration, only shorter and longer ones
        times[late] = _stretched(
            offset_m[late],
            before_m_s[late],
            after_m_s[late],
            caps[late],
            lower=times[late],
            limit=limit[late] * _TOLERANCE,
        )
        a = _accelerations(offset_m, before_m_s, after_m_s, caps, times[:, None])
    a = np.where(np.isfinite(a), a, 0.0)
    strains = (np.abs(a) / limit).max(axis=1)
    return Legs(places_m[0], c, s, times, before_m_s, after_m_s, a, caps, strains)


def _stretched(
    offset: Array, before: Array, after: Array, cap: Array, *, lower: Array, limit: Array
) -> Array:
    """The shortest of some longer durations that is possible; the nearest to it if none is."""
    tried = lower[:, None] * _STRETCHES
    offset, before, after, cap = (each[:, None, :] for each in (offset, before, after, cap))
    need = np.abs(_accelerations(offset, before, after, cap, tried[..., None]))
    excess = (need / limit[:, None, :]).max(axis=-1)
    possible = excess <= 1.0
    first = np.where(possible.any(axis=-1), possible.argmax(axis=-1), excess.argmin(axis=-1))
    shortest: Array = np.take_along_axis(tried, first[:, None], axis=-1)[:, 0]
    return shortest


def _fastest(offset: Array, before: Array, after: Array, cap: Array, a: Array) -> Array:
    """The shortest time of each axis by itself, with a highest speed and an acceleration."""
    ramp = 0.5 * (before + after) * np.abs(after - before) / a  # distance of a change of speed without a peak
    sign = np.where(offset >= ramp, 1.0, -1.0)
    peak = np.sqrt(np.maximum(0.5 * (before * before + after * after) + sign * a * offset, 0.0))
    peak = np.minimum(peak, cap)
    up, down = peak - sign * before, peak - sign * after
    ramps = 0.5 * (up * (peak + sign * before) + down * (peak + sign * after)) / a
    cruise = np.maximum(sign * offset - ramps, 0.0)
    times: Array = (up + down) / a + cruise / np.maximum(peak, _TINY) * (cruise > _TINY)
    return times


def _accelerations(offset: Array, before: Array, after: Array, cap: Array, time: Array) -> Array:
    """The signed acceleration of the first phase with which each axis takes exactly a time; inf if none does.

    The last phase has its opposite. With two phases, T^2 a^2 - 4 D a - dv^2 = 0, where D is the offset from
    the mean velocity's; of the two roots, only the one of larger size fits into T.
    """
    change = after - before
    beyond = offset - 0.5 * time * (before + after)
    sign = np.where(beyond >= 0.0, 1.0, -1.0)
    a = (2.0 * beyond + sign * np.sqrt(4.0 * beyond * beyond + (time * change) ** 2)) / (time * time)
    peak = 0.5 * (before + after + a * time)
    top = np.where(a >= 0.0, cap, -cap)
    room = np.abs(top) * time - np.where(a >= 0.0, offset, -offset)
    with_cruise = ((top - before) ** 2 + (top - after) ** 2) / np.maximum(2.0 * room, _TINY)
    with_cruise = np.where(room > _TINY, with_cruise, np.inf) * np.where(a >= 0.0, 1.0, -1.0)
    return np.where(np.abs(peak) > cap + _TINY, with_cruise, a)


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """A motion with phases: acceleration, constant speed, its opposite; axes of one heading.

    Attributes:
        start_m: arena axes, shape (3,).
        turn: cosine and sine of the heading.
        speeds_m_s: at the start, shape (3,).
        accelerations_m_s2: of the first phase, shape (3,).
        phases_s: durations of the phases, shape (3 phases, 3 axes).
        duration_s: of the leg.
    """

    start_m: Array
    turn: tuple[float, float]
    speeds_m_s: Array
    accelerations_m_s2: Array
    phases_s: Array
    duration_s: float

    def at(self, times_s: Array) -> tuple[Array, Array, Array]:
        """Positions, velocities and accelerations in arena axes at times from 0 on, shapes (n, 3)."""
        first, second, _ = self.phases_s
        t = times_s[:, None]
        a = self.accelerations_m_s2
        moved, velocity = _moved(t, self.speeds_m_s, a, self.phases_s)
        acceleration = a * ((t < first).astype(float) - (t >= first + second).astype(float))
        c, s = self.turn
        return self.start_m + rotate(moved, c, s), rotate(velocity, c, s), rotate(acceleration, c, s)


@dataclass(frozen=True, eq=False)
class Legs:
    """Legs, many at once.

    Attributes:
        starts_m: arena axes, shape (n, 3).
        cosines: of the headings of their axes, shape (n,).
        sines: of these headings.
        durations_s: shape (n,).
        before_m_s: speeds at the start, in these axes, shape (n, 3).
        after_m_s: speeds at the end.
        accelerations_m_s2: of the first phase.
        caps_m_s: highest speeds.
        strains: the highest acceleration as a multiple of the limit, shape (n,).
    """

    starts_m: Array
    cosines: Array
    sines: Array
    durations_s: Array
    before_m_s: Array
    after_m_s: Array
    accelerations_m_s2: Array
    caps_m_s: Array
    strains: Array

    def __len__(self) -> int:
        return len(self.starts_m)

    def __getitem__(self, index: int) -> Leg:
        """One of them."""
        return Leg(
            self.starts_m[index],
            (float(self.cosines[index]), float(self.sines[index])),
            self.before_m_s[index],
            self.accelerations_m_s2[index],
            self.phases_s[:, index],
            float(self.durations_s[index]),
        )

    @cached_property
    def phases_s(self) -> Array:
        """Durations of the three phases, shape (3, n, 3)."""
        a, before, after = self.accelerations_m_s2, self.before_m_s, self.after_m_s
        time = self.durations_s[:, None]
        top = np.clip(0.5 * (before + after + a * time), -self.caps_m_s, self.caps_m_s)
        size = np.maximum(np.abs(a), _TINY)
        moving = np.abs(a) > 1e-7
        first = np.where(moving, np.abs(top - before) / size, 0.0)
        third = np.where(moving, np.abs(after - top) / size, 0.0)
        return np.stack((first, np.maximum(time - first - third, 0.0), third))

    def positions(self, shares: Array) -> Array:
        """Positions at shares of each leg's duration, shape (n, shares, 3)."""
        moved, _ = _moved(
            self.durations_s[:, None, None] * shares[None, :, None],
            speeds=self.before_m_s[:, None],
            a=self.accelerations_m_s2[:, None],
            phases=self.phases_s[:, :, None],
        )
        return self.starts_m[:, None] + rotate(moved, self.cosines[:, None], self.sines[:, None])


def _moved(times: Array, speeds: Array, a: Array, phases: Array) -> tuple[Array, Array]:
    """Distances and speeds at times; the shapes fit each other."""
    first, second, third = phases
    in_first = np.minimum(times, first)
    in_second = np.minimum(np.maximum(times - first, 0.0), second)
    in_third = np.minimum(np.maximum(times - first - second, 0.0), third)
    cruise = speeds + a * first
    moved = (
        (speeds + 0.5 * a * in_first) * in_first
        + cruise * in_second
        + (cruise - 0.5 * a * in_third) * in_third
    )
    return moved, speeds + a * (in_first - in_third)


LOOK_REACH_M = 0.5  # shorter legs to a gate are flown with the heading along them
NO_TURN_RAD = 0.1  # a smaller turn takes no time of its own
DESCENT_GAIN_PER_S2 = 1.5
"""A descent to a height that brakes with this times the height above the box's floor is nowhere faster than
the box allows: v^2 / 2a <= h for v = h / 1.1 s, which is `REACTION_S` and `BRAKE_HEIGHT_S`."""
_LEAST_DESCENT_M_S2 = 0.2


class Ends(NamedTuple):
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
        return Ends(*map(itemgetter(rows), self))

    @staticmethod
    def joined(parts: Sequence[Ends]) -> Ends:
        """All of several, in their order."""
        return Ends(*map(np.concatenate, zip(*parts, strict=True)))


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
