"""What a navigator knows before the flight: all but the layout."""

from __future__ import annotations

from dataclasses import dataclass

from offboard.navigation.goals import FRAME_HEIGHT_M, FRAME_WIDTH_M
from scenarios.models import Arena, Base, Camera


@dataclass(frozen=True, slots=True)
class Surroundings:
    """The arena, the base and the drone's camera; nothing about the frames but their size."""

    arena: Arena
    base: Base
    camera: Camera
    frame_m: tuple[float, float] = (FRAME_WIDTH_M, FRAME_HEIGHT_M)  # outer width and height of each frame
    bar_m: float = 0.02  # thickness of its bars
