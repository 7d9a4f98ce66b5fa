"""Colours of the hall and of what is in it."""

from __future__ import annotations

from scenarios.imaging.furnishings import PatchColour
from sitl.camera_scene import Bgr

HALL_BGR: Bgr = (196, 204, 206)
CEILING_BGR: Bgr = (226, 228, 228)
DAY_BGR: Bgr = (255, 250, 240)
SILL_BGR: Bgr = (214, 218, 220)
PATCH_BGR: dict[PatchColour, Bgr] = {
    "red": (36, 28, 214),
    "green": (60, 172, 34),
    "blue": (196, 66, 24),
    "cyan": (216, 178, 22),
    "magenta": (150, 34, 206),
    "yellow": (20, 208, 240),
    "orange": (22, 118, 236),
    "white": (240, 242, 242),
    "black": (34, 32, 30),
}
"""Colours of print and cloth: less pure than a gate's."""
