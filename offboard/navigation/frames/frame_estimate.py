"""What the map knows of one frame."""

from __future__ import annotations

from dataclasses import dataclass

from framerunner.geometry.vectors import Vec3


@dataclass(frozen=True, slots=True)
class FrameEstimate:
    """A frame in the arena, as estimated from all images so far.

    Attributes:
        colour: red, green, blue, or the colour of a frame that is no part of the task.
        position_m: centre of the opening, arena axes.
        yaw_rad: heading of its normal, -pi/2..pi/2: a frame may be crossed from either side.
        position_std_m: standard deviations along x, y, z.
        yaw_std_rad: standard deviation of the yaw.
        ambiguous: another yaw explains the images (nearly) as well.
        certain: known well enough to fly through.
        views: how many images have been used.
        seen_us: vehicle time of the last one.
    """

    colour: str
    position_m: Vec3
    yaw_rad: float
    position_std_m: Vec3
    yaw_std_rad: float
    ambiguous: bool
    certain: bool
    views: int
    seen_us: int
