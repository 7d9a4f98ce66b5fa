"""The gate as a solid: four bars, and where their edges are beside their axes in an image.

Axes of the model: x to the right and y down as the camera sees the gate, z away from the camera; its origin
is the centre of the opening. The sides are numbered clockwise: top, right, bottom, left; corner k is where
side k - 1 and side k meet: upper left, upper right, lower right, lower left.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from framerunner.geometry.gate_shape import GateShape

Floats = npt.NDArray[np.float64]
Point = tuple[float, float]
Segment = tuple[Point, Point]
Sides = tuple[Segment | None, Segment | None, Segment | None, Segment | None]

_NEAREST_M = 0.03  # in front of the camera; nearer bars are not projected


def rectangle(width_m: float, height_m: float) -> Floats:
    """The corners of a rectangle in the middle plane, shape (4, 3)."""
    x, y = width_m / 2, height_m / 2
    return np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])


@dataclass(frozen=True, slots=True, eq=False)
class ModelPose:
    """Where a gate is: a point p of the model is at `rotation @ p + shift_m` from the camera.

    Attributes:
        rotation: shape (3, 3); camera axes are right, down, ahead.
        shift_m: shape (3,).
        error_px: root mean square of the distances of four corners.
    """

    rotation: Floats
    shift_m: Floats
    error_px: float

    def project(self, points_m: Floats, focal_px: float) -> Floats | None:
        """Points of the model as pixels from the optical axis, shape (n, 2); None if one is too near."""
        seen = points_m @ self.rotation.T + self.shift_m
        depth_m = seen[:, 2:]
        if depth_m.min() < _NEAREST_M:
            return None
        flat: Floats = seen[:, :2] * (focal_px / depth_m)
        return flat


class GateModel:
    """A gate of one shape, as one camera sees it.

    Attributes:
        shape: its sizes.
        focal_px: focal length of the camera.
        axes_m: width and height of the rectangle of the bars' axes, which is in the gate's middle plane.
        axes_corners: its corners, shape (4, 3).
        axes_places: the same in the plane, right and down.
        outer_corners: those of the outline in the middle plane, shape (4, 3).
    """

    def __init__(self, shape: GateShape, focal_px: float) -> None:
        self.shape, self.focal_px = shape, focal_px
        self.axes_m = (shape.outer_width_m - shape.bar_m, shape.outer_height_m - shape.bar_m)
        self.axes_corners = rectangle(*self.axes_m)
        self.axes_places: list[Point] = [(x, y) for x, y, _ in self.axes_corners.tolist()]
        self.outer_corners = rectangle(shape.outer_width_m, shape.outer_height_m)
        self._bar_edges = self._edges()

    @classmethod
    def of_corners(cls, shape: GateShape, focal_px: float, *, of_opening: bool = False) -> Self:
        """A gate whose bars' axes meet where the corners of another one's outline are, or of its opening."""
        grown_m = -shape.bar_m if of_opening else shape.bar_m
        width_m, height_m = shape.outer_width_m + grown_m, shape.outer_height_m + grown_m
        return cls(GateShape(width_m, height_m, shape.bar_m, shape.depth_m), focal_px)

    def _edges(self) -> Floats:
        """Both ends of the axis and of the four edges of every bar, shape (4 sides * 5 * 2, 3)."""
        away = np.array([0.0, 0.0, self.shape.depth_m / 2])
        lines = []
        for side in range(4):
            start, end = self.axes_corners[side], self.axes_corners[(side + 1) % 4]
            across = self.shape.bar_m / 2 * np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]][side % 2])
            for a, b in ((0, 0), (-1, -1), (-1, 1), (1, -1), (1, 1)):
                lines += [point + (a * across + b * away) for point in (start, end)]
        return np.array(lines)

    def bar_offsets(
        self, pose: ModelPose, steep: tuple[bool, ...], inward: Floats, spans: Floats
    ) -> Floats | None:
        """How far a bar's outer and inner edge are from its axis in the image.

        Args:
            pose: of the gate.
            steep: per side, whether distances are measured along rows, not columns.
            inward: per side, 1 if the opening is on the side of larger columns (rows), else -1.
            spans: per side two columns (rows if steep) from the optical axis, shape (4, 2).

        Returns:
            Pixels towards the opening, shape (4, 2 edges, 2 places), outer edge first; None if the gate is so
            near that a part of it is beside the camera.
        """
        flat = pose.project(self._bar_edges, self.focal_px)
        if flat is None:
            return None
        ends = flat.reshape(4, 5, 2, 2)
        swap = np.array(steep)[:, None, None]
        t = np.where(swap, ends[..., 1], ends[..., 0])
        u = np.where(swap, ends[..., 0], ends[..., 1])
        run = t[..., 1] - t[..., 0]
        if np.abs(run).min() < 1e-6:
            return None
        slope = (u[..., 1] - u[..., 0]) / run
        at = u[..., :1] + slope[..., None] * (spans[:, None, :] - t[..., :1])
        beside = (at[:, 1:] - at[:, :1]) * inward[:, None, None]
        return np.stack([beside.min(axis=1), beside.max(axis=1)], axis=1)
