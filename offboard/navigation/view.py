"""What a navigator shows of its map and its plan, for displays and records."""

from __future__ import annotations

from dataclasses import dataclass

from framerunner.geometry.vectors import Vec3
from offboard.navigation.frames.frame_estimate import FrameEstimate


@dataclass(frozen=True, slots=True)
class NavigationView:
    """The map of frames and the plan at one time.

    Attributes:
        frames: all frames seen so far.
        path_m: points of the planned path, in order, arena axes; empty without a plan.
        goal: what the navigator does now, a word or a short phrase such as "explore" or "cross red".
        trouble: why it last could not go on, such as "red: lost from the map"; empty if it can.
    """

    frames: tuple[FrameEstimate, ...] = ()
    path_m: tuple[Vec3, ...] = ()
    goal: str = ""
    trouble: str = ""
