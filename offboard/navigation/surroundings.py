"""What a navigator knows before the flight: all but the layout."""

from __future__ import annotations

from dataclasses import dataclass

from framerunner.geometry.vectors import Vec3
from scenarios.models import Arena, Base, Camera


@dataclass(frozen=True, slots=True)
class Surroundings:
    """The arena, the base and the drone's own measures; nothing about the frames but their size."""

    arena: Arena
    base: Base
    camera: Camera
    envelope_m: Vec3  # length, width and height of the drone
    frame_m: tuple[float, float] = (0.42, 0.22)  # outer width and height of each frame
    bar_m: float = 0.02  # thickness of its bars
