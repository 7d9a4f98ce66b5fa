"""Things that look like gates and have another size, such as pictures on walls.

One image cannot tell a gate from a larger one farther away. While the drone moves, parallax says how far
away a thing is, whatever its size: all its sightings then agree on one place and one size.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from framerunner.geometry.rotations import to_world
from framerunner.geometry.vectors import Vec3
from offboard.navigation.gates.gate_measurement import Floats, GateView, upright_edges

Mask: TypeAlias = npt.NDArray[np.bool_]

KEPT = 24  # sightings of a colour
APART_M = 0.15  # a thing is looked at again from a place of the camera so far from the others, or
APART_RAD = 0.25  # in another direction
BASE_M = 0.5  # between two places whose parallax is used
AGREEING = 6  # sightings that must agree
LEFT = 4  # of them, without those of one place
SIZES = (0.2, 8.0)  # that are considered, times that of a gate
OTHER_SIZE = 1.25  # a thing that is so many times larger or smaller than a gate is none,
SURE = 20.0  # if the sum of its squared deviations is by so much less than with the size of a gate
AGREES = 3.0  # deviations

# Standard deviations of a sighting; the position's is stated with each view.
DIRECTION_STD_RAD = 0.015
EDGE_STD_PX = 0.7
EDGE_STD = 0.03  # share of an edge's length


@dataclass(frozen=True, slots=True, eq=False)
class Lookalike:
    """A thing that looks like a gate.

    Attributes:
        colour: of the gate.
        place_m: its centre, arena axes, shape (3,).
        size: times that of a gate.
        half_width_m: of it.
        seemed_m: where gates would have been that look like its sightings, shape (n, 3).
    """

    colour: str
    place_m: Floats
    size: float
    half_width_m: float
    seemed_m: Floats

    def agrees_with(self, sighting: _Sightings) -> bool:
        """Whether one sighting may be of it, or of a part of it."""
        x, y, z = sighting.directions[0].tolist()
        away_m = float(np.linalg.norm(self.place_m - sighting.eyes_m[0]))
        std, place_std_m = sighting.stds[0].tolist()
        margin_m = AGREES * hypot(std * away_m, place_std_m) + self.half_width_m
        nearer_m = abs(away_m - self.size * float(sighting.away_m[0]))
        return nearer_m < margin_m and self.is_at(sighting.eyes_m[0], (x, y, z))

    def is_at(self, eye_m: Vec3 | Floats, direction: Vec3) -> bool:
        """Whether a line of sight meets it."""
        way_m = self.place_m - eye_m
        along_m = float(way_m @ direction)
        beside2_m2 = float(way_m @ way_m) - along_m**2
        return along_m > 0.0 and beside2_m2 < self.half_width_m**2


class Lookalikes:
    """Finds them among what the camera sees, and remembers them."""

    def __init__(self) -> None:
        self._sightings: dict[str, _Sightings] = {}  # of nothing known, by colour
        self._found: list[Lookalike] = []

    def note(self, view: GateView) -> Lookalike | None:
        """Remember a view; returns what is now known to be no gate, if this view has shown it."""
        sighting = _sighting_of(view) if view.whole else None
        if sighting is None or self.shows(view):
            return None
        known = self._sightings.get(view.colour)
        if known is not None and not known.is_new(sighting):
            return None
        sightings = sighting if known is None else known.with_one(sighting)
        thing = _thing_of(sightings)
        if thing is None:
            self._sightings[view.colour] = sightings
            return None
        place_m, size, chosen = thing
        self._sightings[view.colour] = sightings.some(~chosen)
        half_width_m = size * view.shape.half_m[0]
        seemed_m = sightings.some(chosen).seemed_m()
        lookalike = Lookalike(view.colour, place_m, size, half_width_m, seemed_m)
        self._found.append(lookalike)
        return lookalike

    def forget(self, colour: str) -> None:
        """Begin anew with a colour: what was found while the drone's place was wrong may be a gate."""
        self._sightings.pop(colour, None)
        self._found = [each for each in self._found if each.colour != colour]

    def shows(self, view: GateView) -> bool:
        """Whether a view is of such a thing."""
        found = [each for each in self._found if each.colour == view.colour]
        sighting = _sighting_of(view) if found else None
        return sighting is not None and any(each.agrees_with(sighting) for each in found)

    def are_at(self, colour: str, eye_m: Vec3, direction: Vec3) -> bool:
        """Whether such a thing is in a direction, a unit vector in arena axes."""
        return any(each.is_at(eye_m, direction) for each in self._found if each.colour == colour)


class _Sightings(NamedTuple):
    """Sightings of whole outlines.

    Attributes:
        eyes_m: places of the camera, arena axes, shape (n, 3).
        directions: to the middle of the outline, unit vectors, shape (n, 3).
        away_m: distance of a gate that looks as large, shape (n,).
        stds: standard deviations of that distance, as a share, and of the place, metres; shape (n, 2).
    """

    eyes_m: Floats
    directions: Floats
    away_m: Floats
    stds: Floats

    def some(self, chosen: Mask) -> _Sightings:
        """Those where a mask is true."""
        return _Sightings(*(values[chosen] for values in self))

    def with_one(self, other: _Sightings) -> _Sightings:
        """With one more, the last; the oldest of too many are forgotten."""
        return _Sightings(*(np.concatenate(pair)[-KEPT:] for pair in zip(self, other, strict=True)))

    def is_new(self, other: _Sightings) -> bool:
        """Whether one is from elsewhere, or in another direction, than each of these."""
        near = np.linalg.norm(self.eyes_m - other.eyes_m, axis=1) < APART_M
        same = self.directions @ other.directions[0] > np.cos(APART_RAD)
        return not bool((near & same).any())

    def seemed_m(self) -> Floats:
        """Where gates would be that look so, shape (n, 3)."""
        return np.asarray(self.eyes_m + self.away_m[:, None] * self.directions)


def _sighting_of(view: GateView) -> _Sightings | None:
    """What a view says of direction and distance; None if no upright edge is seen from end to end."""
    rotation, focal_px = view.camera.rotation, view.focal_px

    def ray(right_px: float, down_px: float) -> Vec3:
        return to_world(rotation, 1.0, -right_px / focal_px, -down_px / focal_px)

    def slope(place_px: tuple[float, float]) -> float:
        x, y, z = ray(*place_px)
        return z / hypot(x, y)

    # At a horizontal distance of 1 m, an upright edge is as long as the difference of its ends' slopes.
    lengths = [slope(high) - slope(low) for high, low in upright_edges(view)]
    if not lengths or min(lengths) * focal_px < 1.0:
        return None
    length = sum(lengths) / len(lengths)
    rays = np.array([ray(*place_px) for place_px in view.corners_px.reshape(-1, 2).tolist()])
    middle = (rays / np.linalg.norm(rays, axis=1, keepdims=True)).sum(axis=0)
    middle /= np.linalg.norm(middle)
    away_m = view.shape.outer_height_m / length / hypot(middle[0], middle[1])
    std = hypot(EDGE_STD, EDGE_STD_PX / (length * focal_px))
    return _Sightings(
        np.array((view.camera.position_m,)),
        middle[None, :],
        np.array((away_m,)),
        np.array(((std, view.position_var_m2**0.5),)),
    )


def _deviations2(sightings: _Sightings, places_m: Floats, sizes: Floats) -> Floats:
    """Squares of the deviations of direction and distance from things, in standard deviations.

    Args:
        sightings: n of them.
        places_m: of the things, shape (k, 3).
        sizes: of the things, shape (k,).

    Returns:
        Shape (2, k, n).
    """
    ways_m = places_m[:, None, :] - sightings.eyes_m
    away_m = np.maximum(np.linalg.norm(ways_m, axis=2), 1e-6)
    turned = np.arccos(np.clip((ways_m * sightings.directions).sum(axis=2) / away_m, -1.0, 1.0))
    grown = np.log(away_m / (sizes[:, None] * sightings.away_m))
    away_std, place_std_m = sightings.stds.T
    moved = place_std_m / away_m
    return np.stack(
        ((turned / np.hypot(DIRECTION_STD_RAD, moved)) ** 2, (grown / np.hypot(away_std, moved)) ** 2)
    )


def _agree(sightings: _Sightings, places_m: Floats, sizes: Floats) -> Mask:
    """Which sightings may be of which thing, shape (k, n)."""
    agree: Mask = np.all(_deviations2(sightings, places_m, sizes) < AGREES**2, axis=0)
    return agree


def _thing_of(sightings: _Sightings) -> tuple[Floats, float, Mask] | None:
    """What the last sighting is of, if it is surely no gate: its place, its size and its sightings' mask.

    The sightings may be of several things: each earlier one together with the last suggests a place and a
    size, and the one that most others agree with is taken (random sample consensus, with all pairs; Fischler
    & Bolles, 1981).
    """
    eyes_m, seemed_m = sightings.eyes_m, sightings.away_m[:, None] * sightings.directions
    moved_m, shrunk_m = eyes_m[-1] - eyes_m[:-1], seemed_m[:-1] - seemed_m[-1]
    far = np.linalg.norm(moved_m, axis=1) >= BASE_M
    if far.sum() < AGREEING - 1:
        return None
    squares = np.maximum((shrunk_m**2).sum(axis=1), 1e-9)
    sizes = np.clip((moved_m * shrunk_m).sum(axis=1) / squares, *SIZES)[far]
    agree = _agree(sightings, eyes_m[-1] + sizes[:, None] * seemed_m[-1], sizes)
    best = int(agree.sum(axis=1).argmax())
    chosen: Mask = agree[best]
    some = sightings.some(chosen)
    # A few sightings of another thing can bend a size: it must follow without those of any one place, too.
    apart_m = np.linalg.norm(some.eyes_m[:, None, :] - some.eyes_m, axis=2)
    parts = (some, *(some.some(row) for row in apart_m > BASE_M))
    if len(some.away_m) < AGREEING or not all(_is_no_gate(part, float(sizes[best])) for part in parts):
        return None
    place_m, size, _ = _fit(some, float(sizes[best]), is_gate=False)
    return place_m, size, chosen


def _is_no_gate(sightings: _Sightings, size: float) -> bool:
    """Whether sightings are surely of one thing that has another size than a gate, about the one given."""
    if len(sightings.away_m) < LEFT:
        return False
    _, size, cost = _fit(sightings, size, is_gate=False)
    if 1.0 / OTHER_SIZE < size < OTHER_SIZE or cost > AGREES**2 * len(sightings.away_m):
        return False
    return _fit(sightings, 1.0, is_gate=True)[2] - cost > SURE


def _fit(sightings: _Sightings, size: float, *, is_gate: bool) -> tuple[Floats, float, float]:
    """Place and size that fit sightings best (linear least squares), and the sum of squared deviations.

    Args:
        sightings: of one thing.
        size: about.
        is_gate: the size is that of a gate, and only the place is found.
    """
    away_std, place_std_m = sightings.stds.T
    away_m = size * sightings.away_m
    across = 1.0 / np.hypot(DIRECTION_STD_RAD * away_m, place_std_m)
    along = 1.0 / np.hypot(away_std * away_m, place_std_m)
    directions = sightings.directions
    beside = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    rows = np.concatenate((across[:, None, None] * beside, (along[:, None] * directions)[:, None, :]), axis=1)
    seen = np.einsum("nij,nj->ni", rows, sightings.eyes_m)
    sized = np.zeros_like(seen)
    sized[:, 3] = along * sightings.away_m
    if is_gate:
        place_m = np.linalg.lstsq(rows.reshape(-1, 3), (seen + sized).ravel(), rcond=None)[0]
    else:
        system = np.concatenate((rows, -sized[:, :, None]), axis=2).reshape(-1, 4)
        *place, size = np.linalg.lstsq(system, seen.ravel(), rcond=None)[0].tolist()
        place_m, size = np.array(place), min(max(size, SIZES[0]), SIZES[1])
    cost = float(_deviations2(sightings, place_m[None, :], np.array((size,))).sum())
    return place_m, size, cost
