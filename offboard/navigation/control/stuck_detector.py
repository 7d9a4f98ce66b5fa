"""Detects a drone that is stuck: a bar holds it, or no way leads on. Remembers the way that it came."""

from __future__ import annotations

from collections import deque
from math import atan2, dist

from framerunner.geometry.vectors import Vec3
from offboard.navigation.goals import Point

OFF_PATH_M = 0.1  # a drone that is so far from its path, and
HELD_M = 0.08  # not farther than this from one place
HELD_S = 1.0  # for so long, is held
STUCK_S = 3.0  # near one place, and off its path at times, or without a way: it flies back the way it came
BACK_M = 0.8  # by this, and farther if it is stuck there again
STEP_M = 0.1  # between two places of this way
WAY_M = 8.0  # that is remembered
MAX_BACK_S = 3.0


class StuckDetector:
    """Compares where the drone is with where its path is; call `observe` every tick.

    Attributes:
        is_held: it is off its path and does not move; a path must be planned from where it is.
        back: where to fly instead of to the goals: back the way it came, facing what holds it; None: nowhere.
    """

    def __init__(self) -> None:
        self.is_held = False
        self.back: Point | None = None
        self._back_s = 0.0  # since when it flies back
        self._free_m: Vec3 = (0.0, 0.0, 0.0)  # where the drone was last on its path, or moved
        self._free_s = 0.0
        self._near_m: Vec3 = (0.0, 0.0, 0.0)  # where the drone is
        self._near_s = 0.0  # since when it has been near there, with a path to fly
        self._way_s = 0.0  # when there was a way last
        self._was_off = False  # and has been off its path
        self._way: deque[Vec3] = deque(maxlen=round(WAY_M / STEP_M))  # that the drone came

    def observe(
        self, here_m: Vec3, now_s: float, off_path_m: float, *, has_path: bool, has_way: bool
    ) -> None:
        """Take a tick.

        Args:
            here_m: where the drone is, in the arena.
            now_s: the vehicle's time.
            off_path_m: how far from its path.
            has_path: it has one to fly.
            has_way: no obstacles block the way to its goals.
        """
        if not has_path or off_path_m < OFF_PATH_M or dist(here_m, self._free_m) > HELD_M:
            self._free_m, self._free_s = here_m, now_s
        self.is_held = now_s - self._free_s > HELD_S
        if self.back is None and (not self._way or dist(here_m, self._way[-1]) > STEP_M):
            self._way.append(here_m)
        if not has_path or dist(here_m, self._near_m) > STEP_M:
            self._near_m, self._near_s, self._was_off = here_m, now_s, False
        self._was_off = self._was_off or off_path_m > OFF_PATH_M
        if has_way:
            self._way_s = now_s
        if self.back is not None:
            arrived = dist(here_m, self.back.position_m) < STEP_M
            if arrived or now_s - self._back_s > MAX_BACK_S:
                self.back = None
        elif (has_path and self._was_off and now_s - self._near_s > STUCK_S) or now_s - self._way_s > STUCK_S:
            self._turn_back(here_m, now_s)

    def _turn_back(self, here_m: Vec3, now_s: float) -> None:
        """Fly back, if the drone has come from anywhere."""
        for _ in range(min(round(BACK_M / STEP_M), len(self._way)) - 1):
            self._way.pop()
        (x, y, _), place_m = here_m, self._way[-1]
        if dist(here_m, place_m) > STEP_M:
            self.back = Point(place_m, atan2(y - place_m[1], x - place_m[0]))
            self._back_s = self._near_s = self._way_s = now_s

    def planned(self, now_s: float) -> None:
        """A path was planned from where the drone is held; it has time to fly it."""
        if self.is_held:
            self._free_s = now_s

    def forget(self) -> None:
        """Forget the way: the drone has other goals."""
        self.back = None
        self._way.clear()
