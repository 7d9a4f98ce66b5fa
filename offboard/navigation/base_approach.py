"""A drone that does not know its place looks at the base before it lands, and when it has drifted too far."""

from __future__ import annotations

from math import atan2, cos, dist, hypot, pi, sin

from framerunner.geometry.vectors import Vec3
from offboard.drone import DroneState
from offboard.navigation.goals import Point
from scenarios.models import Arena, Base, is_over_base

BEFORE_M = 1.4  # from the base's centre: from there the drone looks at it
FARTHER_M = 2.2  # likewise, when it was not seen from there: more is in view around it
ABOVE_M = 0.45  # its top: all of the top is in view
SIDE_M = 0.5  # from the arena's sides, at least
REACHED_M, REACHED_M_S = 0.25, 0.3
SEARCH_S = 1.2  # if the base is not seen in so long, it is looked for farther around
LOOK_S = 2.5  # likewise, from another side
SIGHTINGS, SIGHTINGS_S = 4, 1.2  # so many in so long, and
SURE_M = 0.03  # a place known so well are enough to land
NEAR_M = 2.4  # from here on that is so in flight, too
REACH_S = 15.0  # a place that is not reached within so long is given up
PLACES = 4  # from which it is looked for,
ROUNDS = 3  # so many times; then the drone lands where it believes the base to be
ASIDE_RAD = pi / 4  # between two of them
UNSURE_M, KNOWN_M = 0.5, 0.25  # a standard deviation from which a place is corrected, and until which
CORRECT_S, PAUSE_S = 25.0, 20.0  # for at most so long, and then not for so long


class WayHome:
    """Where to fly to first, on the way to a point, which may be on the base, or while exploring."""

    def __init__(self, base: Base, arena: Arena) -> None:
        self._base, self._arena = base, arena
        self._approach: BaseApproach | None = None
        self._correction: BaseApproach | None = None
        self._until_us = self._not_before_us = 0  # of corrections

    def begin(self) -> None:
        """Forget the way that was flown."""
        self._approach = self._correction = None

    @property
    def looks(self) -> bool:
        """The drone is on its way to a place from which it looks at the base, or is there."""
        return self._correction is not None or (self._approach is not None and not self._approach.lands)

    @property
    def searches(self) -> bool:
        """See `BaseApproach`."""
        return self._approach is not None and self._approach.searches

    def goal(
        self, goal_m: Vec3, state: DroneState, known: tuple[int, float] | None, *, no_path: bool
    ) -> Point:
        """Where to fly to now; a drone that knows its place flies to the point itself.

        Args:
            goal_m: the point.
            state: of the drone, as estimated.
            known: how often the base was seen in the last `SIGHTINGS_S`, and the standard deviation of the
                place in plan, metres; None for a drone that knows its place.
            no_path: there is none to where it was to fly.
        """
        if known is None or not is_over_base(self._base, goal_m[0], goal_m[1]):
            return self.correction(state, known, no_path=no_path) or Point(goal_m)
        here_m = (state.x, state.y, state.z)
        if self._approach is None:
            self._approach = BaseApproach(self._base, self._arena, goal_m, here_m)
        elif no_path:
            self._approach.refuse(here_m)
        return self._approach.goal(state, *known)

    def correction(
        self, state: DroneState, known: tuple[int, float] | None, *, no_path: bool
    ) -> Point | None:
        """From where to look at the base, before the drone goes on with a place that is too uncertain.

        None: it is known well enough, or looking has not helped. Arguments as for `goal`.
        """
        base, here_m, now_us = self._base, (state.x, state.y, state.z), state.time_us
        if known is None:
            return None
        _, std_m = known
        if self._correction is None:
            if std_m < UNSURE_M or now_us < self._not_before_us:
                return None
            self._correction = BaseApproach(base, self._arena, (base.x_m, base.y_m, base.top_m), here_m)
            self._until_us = now_us + round(CORRECT_S * 1e6)
        elif no_path:
            self._correction.refuse(here_m)
        place = self._correction.goal(state, *known)
        if std_m > KNOWN_M and now_us < self._until_us and not self._correction.lands:
            return place
        self._correction, self._not_before_us = None, now_us + round(PAUSE_S * 1e6)
        return None


class BaseApproach:
    """Where to fly to, in order to see a base well and to land on it.

    Args:
        base: whose place is known.
        arena: the drone stays inside it.
        goal_m: where it lands.
        here_m: where it is now.

    Attributes:
        lands: it is on its last way, to the goal.
        searches: the base is not seen where it should be, so it may be farther away.
    """

    def __init__(self, base: Base, arena: Arena, goal_m: Vec3, here_m: Vec3) -> None:
        self.lands = self.searches = False
        self._base, self._arena, self._goal_m = base, arena, goal_m
        self._place = Point((base.x_m, base.y_m, base.top_m + ABOVE_M))  # in an arena without room beside it
        self._angle_rad = self._side_rad = 0.0
        self._turns = 0  # to other sides
        self._refused = 0  # places from which it was not seen, or that were not reached
        self._chosen_us: int | None = None
        self._reached_us: int | None = None
        self._look_from(here_m)

    def goal(self, state: DroneState, sightings: int, std_m: float) -> Point:
        """Where to fly to now.

        Args:
            state: of the drone, as estimated.
            sightings: how often the base was seen in the last `SIGHTINGS_S`.
            std_m: standard deviation of the drone's place in plan.
        """
        base, here_m, now_us = self._base, (state.x, state.y, state.z), state.time_us
        if self.lands:
            return self._place
        if self._chosen_us is None:
            self._chosen_us = now_us
        sure = sightings >= SIGHTINGS and std_m <= SURE_M
        if sure and hypot(state.x - base.x_m, state.y - base.y_m) < NEAR_M:
            self._land(here_m)
        elif self._reached_us is None:
            slow = hypot(*state.velocity_arena_m_s) < REACHED_M_S
            if slow and dist(here_m, self._place.position_m) < REACHED_M:
                self._reached_us = now_us
            elif now_us - self._chosen_us > REACH_S * 1e6:
                self.refuse(here_m)
        elif now_us - self._reached_us > LOOK_S * 1e6:
            self.refuse(here_m)
        elif now_us - self._reached_us > SEARCH_S * 1e6 and not (sightings or self.searches):
            self.searches, self._place = True, self._place_at(self._angle_rad, FARTHER_M) or self._place
            self._chosen_us, self._reached_us = now_us, None
        return self._place

    def refuse(self, here_m: Vec3) -> None:
        """Look from another side, or land: the base is not seen from this one, or no path leads there."""
        if self.lands:
            return
        self._reached_us, self._chosen_us, self.searches = None, None, False
        self._refused += 1
        if self._refused >= PLACES * ROUNDS:
            self._land(here_m)
        elif self._refused % PLACES:
            self._turn()
        else:
            self._look_from(here_m)

    def _land(self, here_m: Vec3) -> None:
        self.lands = True
        towards_rad = atan2(self._base.y_m - here_m[1], self._base.x_m - here_m[0])
        self._place = Point(self._goal_m, towards_rad)

    def _look_from(self, here_m: Vec3) -> None:
        """Begin with the side on which the drone is."""
        self._side_rad = atan2(here_m[1] - self._base.y_m, here_m[0] - self._base.x_m)
        self._turns = 0
        self._turn()

    def _turn(self) -> None:
        """Take the next place from which to look: inside the arena, and as near to that side as can be."""
        for turn in range(self._turns, 8):
            aside = (turn + 1) // 2 * (1 if turn % 2 else -1)
            self._angle_rad = self._side_rad + ASIDE_RAD * aside
            self._turns = turn + 1
            place = self._place_at(self._angle_rad, BEFORE_M)
            if place is not None:
                self._place = place
                return

    def _place_at(self, angle_rad: float, away_m: float) -> Point | None:
        """A place on a side of the base, facing it; None outside the arena."""
        base, arena = self._base, self._arena
        x, y = base.x_m + away_m * cos(angle_rad), base.y_m + away_m * sin(angle_rad)
        if abs(x) > arena.length_x_m / 2 - SIDE_M or abs(y) > arena.width_y_m / 2 - SIDE_M:
            return None
        return Point((x, y, base.top_m + ABOVE_M), atan2(base.y_m - y, base.x_m - x))
