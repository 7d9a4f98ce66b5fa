"""One attempt to fly through a gate: how far it is, and whether it can go on."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, dist, hypot, inf, pi, remainder, sin

from framerunner.geometry.vectors import Vec3, turned
from offboard.navigation.goals import Point
from offboard.navigation.path import Crossing, Path
from offboard.navigation.planner.clearance import deeper_m, room_share
from offboard.navigation.view import GateEstimate

COMMIT_M = 0.3  # before the opening; from there the path is not planned again
COMMIT_ACROSS_M = 0.06  # if the drone is no farther beside the opening's axis
STOP_M = 0.9  # before the opening; a drone that must look brakes on its path if it finds no other
SETTLED_M = 0.7  # before the opening; from there it is only if the gate turns out to be elsewhere,
SETTLED_MOVE_M = 0.02  # by this,
SETTLED_TURN_RAD = 0.05  # or this
CLEAR_M = 0.25  # behind the opening
BEHIND_M = 0.5  # likewise; where a drone goes that was stopped in the opening
MAX_CLEARING_S = 3.0
MAX_LOOK_S = 4.0
MAX_LOST_S = 1.5
MAX_UNPLANNED_S = 2.0
MAX_CROSSING_S = 25.0
MORE_NEAR_S = 10.0  # for a drone that is near the opening already: it may not be able to stop before it
SAME_GATE_M = 0.3  # what is certain no farther than this from the opening aimed at is that gate
STUCK_M = 0.3  # a drone that is no farther from one place,
MAX_STUCK_S = 6.0  # for so long, may hang on something that is not on the map


@dataclass(slots=True)
class CrossingAttempt:
    """Positions along the direction of flight are negative before the opening. Times are vehicle time.

    Attributes:
        colour: of the gate.
        began_s: when the attempt began.
        known_s: when the gate was last on the map.
        planned_s: when there was last a path.
        passed: the drone has gone through the opening.
        cleared: and is behind the gate's bars.
        refusal: why it cannot go on; empty if it can.
        after: where to look from behind the opening, if what comes next is not known; None if not chosen yet.
    """

    colour: str
    began_s: float
    known_s: float
    planned_s: float
    passed: bool = False
    cleared: bool = False
    refusal: str = ""
    after: Point | None = None
    _aim: Crossing | None = None  # the opening and the direction as last planned
    _along_m: float = -inf
    _across_m: float = 0.0
    _looking_since_s: float | None = None
    _passed_s: float = inf
    _certain_m: Vec3 | None = None  # where the gate was when it was last certain
    _place_m: Vec3 | None = None  # where the drone has been near
    _there_since_s: float = 0.0

    def aim(self, crossing: Crossing) -> None:
        """Note which opening the path leads through, and in which direction."""
        if crossing != self._aim:
            self._aim, self._along_m = crossing, -inf

    def move(self, position_m: Vec3, now_s: float) -> None:
        """Note where the drone is now."""
        if self._aim is not None:
            self._move(self._aim, position_m, now_s)
        near = -SETTLED_M < self._along_m < 0.0
        if now_s - self.began_s > MAX_CROSSING_S + (MORE_NEAR_S if near else 0.0):
            self._refuse(f"not through it within {MAX_CROSSING_S:g} s")
        if near or self._place_m is None or dist(self._place_m, position_m) > STUCK_M:
            self._place_m, self._there_since_s = position_m, now_s
        elif now_s - self._there_since_s > MAX_STUCK_S:
            self._refuse(f"stuck for {MAX_STUCK_S:g} s")

    def _move(self, aim: Crossing, position_m: Vec3, now_s: float) -> None:
        (x, y, z), heading = aim.gate.centre_m, aim.heading_rad
        dx, dy, dz = position_m[0] - x, position_m[1] - y, position_m[2] - z
        along_m, left_m = turned(dx, dy, -heading)
        if along_m >= 0.0 > self._along_m > -inf and not self.passed:
            opening_m = aim.gate.shape.opening_m
            inside = abs(left_m) < opening_m[0] / 2 and abs(dz) < opening_m[1] / 2
            self.passed = inside and self._aims_at_certain_gate
            why = "before it was certain" if inside else f"{hypot(left_m, dz):.2f} m from its centre"
            self._refuse(f"passed its plane {why}")
            self._passed_s = now_s
        self._along_m, self._across_m = along_m, hypot(left_m, dz)
        clear_m = CLEAR_M + deeper_m(aim.gate.shape)
        self.cleared = self.passed and (along_m > clear_m or now_s - self._passed_s > MAX_CLEARING_S)

    def _refuse(self, why: str) -> None:
        """Note why the attempt cannot go on; nothing can be refused behind the opening."""
        self.refusal = "" if self.passed else why

    @property
    def _aims_at_certain_gate(self) -> bool:
        """The opening that the path leads through is of a gate that has been certain."""
        aim, certain_m = self._aim, self._certain_m
        return aim is not None and certain_m is not None and dist(aim.gate.centre_m, certain_m) < SAME_GATE_M

    def is_on(self, path: Path | None) -> bool:
        """Whether a path leads through the opening: not one to a place before it, to look."""
        return path is not None and self._aim in path.crossings

    @property
    def behind(self) -> Point | None:
        """Straight behind the opening; None if no path has led through it yet."""
        if self._aim is None:
            return None
        (x, y, z), heading = self._aim.gate.centre_m, self._aim.heading_rad
        return Point((x + BEHIND_M * cos(heading), y + BEHIND_M * sin(heading), z), heading)

    @property
    def must_stop(self) -> bool:
        """The drone comes near, and must not fly on through the opening, since it must look."""
        return self.looks and -STOP_M < self._along_m < 0.0

    @property
    def is_committed(self) -> bool:
        """Straight before the opening of a certain gate, too near to plan again, or beyond it."""
        if self._aim is None or not (self.passed or self._aims_at_certain_gate):
            return False
        shape = self._aim.gate.shape
        near = -COMMIT_M - deeper_m(shape) < self._along_m < 0.0
        return self.passed or (near and self._across_m < COMMIT_ACROSS_M * room_share(shape))

    def is_settled(self, estimate: GateEstimate) -> bool:
        """The drone is near, and the path leads through the opening as it is known now."""
        if self._aim is None or not estimate.certain or not -SETTLED_M < self._along_m < 0.0:
            return False
        gate = self._aim.gate
        turned_rad = abs(remainder(gate.yaw_rad - estimate.yaw_rad, pi))
        moved_m = SETTLED_MOVE_M * room_share(gate.shape)
        return dist(gate.centre_m, estimate.position_m) < moved_m and turned_rad < SETTLED_TURN_RAD

    @property
    def looks(self) -> bool:
        """The drone stops before the gate, see `must_look`."""
        return self._looking_since_s is not None

    def must_look(self, estimate: GateEstimate, distance_m: float, near_m: float, now_s: float) -> bool:
        """Whether the drone must stop before the gate, because it is near and the gate is not certain.

        Args:
            estimate: of the gate.
            distance_m: from it to the drone.
            near_m: nearer to it, the drone must stop.
            now_s: vehicle time.
        """
        if estimate.certain:
            self._certain_m = estimate.position_m
        if estimate.certain or distance_m > near_m:
            self._looking_since_s = None
            return False
        if self._looking_since_s is None:
            self._looking_since_s = now_s
        if not self.refusal and now_s - self._looking_since_s > MAX_LOOK_S:
            self.refusal = f"still not certain after {MAX_LOOK_S:g} s before it"
        return True

    def lose(self, now_s: float) -> None:
        """The gate is not on the map."""
        if not self.refusal and now_s - self.known_s > MAX_LOST_S:
            self.refusal = "lost from the map"

    def fly(self, *, no_path: str, now_s: float) -> None:
        """Note whether there is a path; `no_path` says why there is none, and is empty if there is one."""
        if not no_path:
            self.planned_s = now_s
        elif not self.refusal and now_s - self.planned_s > MAX_UNPLANNED_S:
            self.refusal = f"no path: {no_path}"
