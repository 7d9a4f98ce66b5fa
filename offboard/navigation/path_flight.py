"""Flies to goals: plans a path, plans again when the map has changed, and follows it."""

from __future__ import annotations

from collections.abc import Sequence
from math import dist, pi, remainder

from geometry.vectors import Vec3
from offboard.drone import DroneState, VelocityCommand
from offboard.navigation.following import PathFollower
from offboard.navigation.goals import FlightStyle, Gate, Goal, Motion, Obstacles, Refusal
from offboard.navigation.path import Path
from offboard.navigation.planning import plan
from offboard.response import ResponseEstimate
from scenarios.models import Arena

STILL = VelocityCommand()
REPLAN_S = 0.4
RESTART_M = 0.28  # farther from its path, the drone's own motion is planned from
MAX_REFUSALS = 3  # in a row, until the drone stops
SAME_M = 0.004  # between two estimates of the frame that is crossed, for which the path stays as it is
NEARLY_SAME_M = 0.04  # likewise of the other frames
SAME_RAD_M = 1.0  # likewise of headings, for each metre


class PathFlight:
    """One path after another, each from the motion that the last one has then.

    Attributes:
        path: the one that is flown; None while the drone stands still.
        refusal: why the last planning found none; empty if it did.
    """

    def __init__(self, arena: Arena, style: FlightStyle) -> None:
        self.path: Path | None = None
        self.refusal = ""
        self._arena = arena
        self._style = self._usual_style = style
        self._follower = PathFollower()
        self._response = ResponseEstimate()
        self._planned_for: tuple[tuple[Goal, ...], Obstacles] | None = None
        self._tried_s = -REPLAN_S
        self._refusals = 0

    def learn(self, state: DroneState, sent: VelocityCommand | None) -> None:
        """How late the vehicle answers, from the command that it had since the last tick; call every tick."""
        self._response.update(state, sent)
        response = self._response.response
        if response != self._follower.response:
            self._follower.response = response
            self._style = self._usual_style.adapted(response) if response.late else self._usual_style
            self._planned_for = None

    def stop(self) -> None:
        """Leave the path."""
        self.path = None
        self.change()

    def change(self) -> None:
        """Plan at the next tick, for other goals."""
        self._planned_for = None
        self._tried_s = -REPLAN_S

    def fly(self, goals: Sequence[Goal], obstacles: Obstacles, state: DroneState) -> VelocityCommand:
        """Plan again if that is due and goals or obstacles have changed; the command for this tick."""
        now_s = state.time_us * 1e-6
        if now_s - self._tried_s >= REPLAN_S:
            planned_for = (tuple(goals), obstacles)
            off = self._follower.error_m > RESTART_M
            if self.path is None or off or _differ(planned_for, self._planned_for):
                self._tried_s = now_s
                self._plan(goals, obstacles, state)
        return self.follow(state)

    def follow(self, state: DroneState) -> VelocityCommand:
        """The command for this tick on the present path; without one, to stand still."""
        if self.path is None:
            return STILL
        prediction = self._response.predict() if self._follower.response.late else None
        return self._follower.command(self.path, state, state.time_us * 1e-6, prediction)

    def _plan(self, goals: Sequence[Goal], obstacles: Obstacles, state: DroneState) -> None:
        start = self._follower.reference() if self.path is not None else None
        if start is None or self._follower.error_m > RESTART_M:
            start = Motion(position_now(state), state.velocity_arena_m_s, state.yaw)
        found = self._find(start, goals, obstacles)
        if isinstance(found, Refusal) and len(goals) > 1:
            found = self._find(start, goals[:1], obstacles)
        if isinstance(found, Refusal):
            self.refusal = found.reason
            self._refusals += 1
            if self._refusals >= MAX_REFUSALS:
                self.path = None
            return
        self.path, self.refusal, self._refusals = found, "", 0
        self._planned_for = (tuple(goals), obstacles)

    def _find(self, start: Motion, goals: Sequence[Goal], obstacles: Obstacles) -> Path | Refusal:
        arena, style = self._arena, self._style
        return plan(start, goals, obstacles=obstacles, arena=arena, style=style, previous=self.path)


def position_now(state: DroneState) -> Vec3:
    """Where the drone is at the state's time."""
    vx, vy, vz = state.velocity_arena_m_s
    age_s = state.position_age_s
    return (state.x + vx * age_s, state.y + vy * age_s, state.z + vz * age_s)


def _differ(a: tuple[Sequence[Goal], Obstacles], b: tuple[Sequence[Goal], Obstacles] | None) -> bool:
    """Whether goals or obstacles differ by more than the map's noise."""
    if b is None or len(a[0]) != len(b[0]) or len(a[1].frames) != len(b[1].frames):
        return True
    if a[1].columns_m != b[1].columns_m:
        return True
    near = zip(a[0][:1], b[0][:1], strict=True)
    other = [*zip(a[0][1:], b[0][1:], strict=True), *zip(a[1].frames, b[1].frames, strict=True)]
    return any(_moved(*pair, SAME_M) for pair in near) or any(_moved(*pair, NEARLY_SAME_M) for pair in other)


def _moved(a: Goal, b: Goal, same_m: float) -> bool:
    if isinstance(a, Gate) and isinstance(b, Gate):
        turned = abs(remainder(a.yaw_rad - b.yaw_rad, pi))
        return dist(a.centre_m, b.centre_m) > same_m or turned > same_m * SAME_RAD_M
    return a != b
