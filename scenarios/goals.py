"""What a scenario asks for instead of crossing all gates, and the watch that sees it done.

Lessons use it: hover at a place, face a gate.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, dist, hypot, pi, remainder
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from framerunner.files.yaml_file import refusal
from framerunner.geometry.rotations import yaw_of
from framerunner.geometry.vectors import Quaternion, Vec3
from scenarios.part import Metres, Part

_DISTANCES_M = (0.0, 100.0)
_Distance = Annotated[float, Field(ge=0, le=1000)]


class Goal(Part):
    """What is to be done for some time without a break: be near a place, or have a frame straight ahead.

    A goal has `hold_m` or `face`.
    """

    hold_m: tuple[Metres, Metres, Metres] | None = Field(None, description="the place, arena axes")
    radius_m: float = Field(0.3, ge=0.01, le=10, description="how far from the place counts as there")
    face: Literal["red", "green", "blue"] | None = Field(None, description="colour of the frame")
    distance_m: tuple[_Distance, _Distance] = Field(
        _DISTANCES_M, description="least and greatest horizontal distance from the frame"
    )
    angle_rad: float = Field(0.2, ge=0.01, le=3.15, description="between heading and direction to its centre")
    seconds: float = Field(1.0, ge=0, le=600, description="for how long")

    @model_validator(mode="after")
    def _is_one_thing(self) -> Self:
        if (self.hold_m is None) == (self.face is None):
            raise refusal("", "needs either hold_m (a place) or face (a colour)")
        if self.distance_m[0] >= self.distance_m[1]:
            text = f"[{self.distance_m[0]:g}, {self.distance_m[1]:g}]"
            raise refusal(text, "must be the least distance, then the greatest", "distance_m")
        return self

    def __str__(self) -> str:
        if self.hold_m is not None:
            place = ", ".join(f"{each:g}" for each in self.hold_m)
            return f"within {self.radius_m:g} m of ({place}) for {self.seconds:g} s"
        least_m, most_m = self.distance_m
        return f"facing {self.face} from {least_m:g} to {most_m:g} m away for {self.seconds:g} s"

    def holds(self, position_m: Vec3, yaw_rad: float, centres_m: dict[str, Vec3]) -> bool:
        """Whether the drone is there, or faces the gate, now.

        Args:
            position_m: of the drone's centre, arena axes, shape (3,).
            yaw_rad: heading, counter-clockwise from x.
            centres_m: of the gates, by colour, arena axes.
        """
        if self.hold_m is not None:
            return dist(position_m, self.hold_m) <= self.radius_m
        if self.face is None:
            return False
        centre_m = centres_m[self.face]
        x_m, y_m = centre_m[0] - position_m[0], centre_m[1] - position_m[1]
        off_rad = abs(remainder(atan2(y_m, x_m) - yaw_rad, 2.0 * pi))
        return self.distance_m[0] <= hypot(x_m, y_m) <= self.distance_m[1] and off_rad <= self.angle_rad


class GoalWatch:
    """Sees goals reached, in their order.

    Args:
        goals: what is to be done.
        centres_m: of the gates, by colour, arena axes.

    Attributes:
        times_us: when each was reached, as far as they are.
    """

    def __init__(self, goals: Sequence[Goal], centres_m: dict[str, Vec3]) -> None:
        self._goals = tuple(goals)
        self._centres_m = centres_m
        self._since_us: int | None = None
        self.times_us: list[int] = []

    @property
    def next_goal(self) -> Goal | None:
        """The goal to reach next; None: all are reached."""
        done = len(self.times_us)
        return self._goals[done] if done < len(self._goals) else None

    def follow(self, time_us: int, position_m: Vec3, attitude: Quaternion) -> None:
        """Take the next state in flight.

        Args:
            time_us: vehicle time.
            position_m: of the drone's centre, arena axes, shape (3,).
            attitude: unit quaternion, body FLU to arena.
        """
        goal = self.next_goal
        if goal is None:
            return
        if not goal.holds(position_m, yaw_of(attitude), self._centres_m):
            self._since_us = None
            return
        if self._since_us is None:
            self._since_us = time_us
        if time_us - self._since_us >= goal.seconds * 1e6:
            self.times_us.append(time_us)
            self._since_us = None
