"""Square markers on the base, which a camera reads: on its top, and below the top on each side.

A drone that is near, and higher than the base, sees more of the upper part of its sides. Each marker has a
number of its own, so one that is read says which face is seen. It is a black square with white cells in it,
on a white sheet that is a cell wider on each side.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from framerunner.geometry.vectors import Vec3

MarkerFamily = Literal["aruco_4x4", "apriltag_36h11"]

_CELLS: dict[MarkerFamily, int] = {"aruco_4x4": 6, "apriltag_36h11": 8}  # of the black square's edge
_COUNTS: dict[MarkerFamily, int] = {"aruco_4x4": 50, "apriltag_36h11": 587}
_FACES: tuple[tuple[str, Vec3, Vec3], ...] = (  # name, normal, and where the marker's upper side is
    ("top", (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)),
    ("x side", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ("y side", (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    ("-x side", (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ("-y side", (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
)
FACES = len(_FACES)


@dataclass(frozen=True, slots=True)
class MarkedFace:
    """A face of the base and its marker, in the base's axes: x and y along its edges, z up from the floor.

    Attributes:
        name: "top", or the side by the axis to which it looks.
        number: of the marker.
        centre_m: of the marker.
        right, up, normal: unit vectors, as one sees the marker from the front.
    """

    name: str
    number: int
    centre_m: Vec3
    right: Vec3
    up: Vec3
    normal: Vec3

    def at(self, right_m: float, up_m: float) -> Vec3:
        """A point of the face, from the marker's centre."""
        x, y, z = (
            c + right_m * r + up_m * u for c, r, u in zip(self.centre_m, self.right, self.up, strict=True)
        )
        return (x, y, z)

    def rectangle(self, left_m: float, right_m: float, lower_m: float, upper_m: float) -> tuple[Vec3, ...]:
        """Corners of a part of the face: upper left, upper right, lower right, lower left."""
        places = ((left_m, upper_m), (right_m, upper_m), (right_m, lower_m), (left_m, lower_m))
        return tuple(self.at(*place) for place in places)


@dataclass(frozen=True, slots=True)
class BaseMarkers:
    """The markers of a base.

    Attributes:
        family: of which they are.
        first: number of the one on the top; the sides have the next four.
        edge_m: of the black square.
    """

    family: MarkerFamily
    first: int
    edge_m: float

    @property
    def cells(self) -> int:
        """How many cells the black square is wide."""
        return _CELLS[self.family]

    @property
    def count(self) -> int:
        """How many markers the family has."""
        return _COUNTS[self.family]

    @property
    def sheet_m(self) -> float:
        """Edge of the white sheet, at least."""
        return self.edge_m * (1.0 + 2.0 / self.cells)

    def faces(self, base_edge_m: float, base_top_m: float) -> tuple[MarkedFace, ...]:
        """The faces of a base of this size."""
        found = []
        for offset, (name, normal, up) in enumerate(_FACES):
            x, y, z = normal
            half_m = base_edge_m / 2
            centre_m = (x * half_m, y * half_m, base_top_m - (0.0 if z else self.sheet_m / 2))
            (a, b, c), (d, e, f) = up, normal
            right = (b * f - c * e, c * d - a * f, a * e - b * d)
            found.append(MarkedFace(name, self.first + offset, centre_m, right, up, normal))
        return tuple(found)
