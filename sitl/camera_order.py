"""What hides what: a tree of planes that gives the faces of a scene from back to front for any eye.

What lies on the eye's side of a plane may hide what lies beyond it and never the reverse, so each plane
halves the question (Fuchs, Kedem, Naylor, "On visible surface generation by a priori tree structures", 1980).
Planes that pass between bodies come first: with the few, scattered bodies of an arena they part everything,
and within one body its own order of faces holds. Only bodies that no plane parts, entangled or intersecting
ones, are taken apart face by face, and faces cut in two where they must be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np
import numpy.typing as npt

from geometry.vectors import Vec3
from sitl.camera_scene import Body, Face

_FLAT_M = 1e-7  # corners nearer to a plane than this lie on it


@dataclass(frozen=True, slots=True)
class _Leaf:
    """Faces that may be painted one after the other, as numbers in the order of painting."""

    faces: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class _Node:
    """A plane normal . p = offset, the faces that lie on it and what is on either side of it."""

    normal: Vec3
    offset: float
    behind: _Leaf | _Node
    faces: tuple[int, ...]
    before: _Leaf | _Node


class PaintTree:
    """The faces of all bodies and their order.

    Attributes:
        faces: all faces; some may be parts of the faces given.
    """

    def __init__(self, bodies: Sequence[Body]) -> None:
        self.faces: list[Face] = []
        self._root = self._part_bodies(bodies)

    def back_to_front(self, eye_arena_m: Vec3) -> list[int]:
        """Return the faces as indices of `faces`: none is hidden by one before it."""
        order: list[int] = []
        _walk(self._root, eye_arena_m, order)
        return order

    def _part_bodies(self, bodies: Sequence[Body]) -> _Leaf | _Node:
        if len(bodies) < 2:
            return _Leaf(self._keep([face for body in bodies for face in body.faces]))
        plane = _plane_between(bodies)
        if plane is None:
            return self._part_faces([face for body in bodies for face in body.faces])
        normal, offset = plane
        beyond = [body for body in bodies if np.dot(normal, body.hull.centre_arena_m) < offset]
        near = [body for body in bodies if body not in beyond]
        return _Node(normal, offset, self._part_bodies(beyond), (), self._part_bodies(near))

    def _part_faces(self, faces: list[Face]) -> _Leaf | _Node:
        if not faces:
            return _Leaf(())
        chosen = min(faces, key=lambda face: sum(_is_cut(face, other) for other in faces))
        normal, offset = chosen.normal_arena, float(np.dot(chosen.normal_arena, chosen.corners_arena_m[0]))
        behind: list[Face] = []
        on_it: list[Face] = []
        before: list[Face] = []
        for face in faces:
            heights = _heights(chosen, face)
            if abs(heights).max() <= _FLAT_M:
                on_it.append(face)
                continue
            if heights.min() < -_FLAT_M:
                behind.append(_below(face, heights))
            if heights.max() > _FLAT_M:
                before.append(_below(face, -heights))
        far_side = self._part_faces(behind)
        own = self._keep(on_it)
        return _Node(normal, offset, far_side, own, self._part_faces(before))

    def _keep(self, faces: Sequence[Face]) -> tuple[int, ...]:
        first = len(self.faces)
        self.faces.extend(faces)
        return tuple(range(first, len(self.faces)))


def _walk(tree: _Leaf | _Node, eye: Vec3, order: list[int]) -> None:
    while isinstance(tree, _Node):
        normal = tree.normal
        above = normal[0] * eye[0] + normal[1] * eye[1] + normal[2] * eye[2] > tree.offset
        _walk(tree.behind if above else tree.before, eye, order)
        order.extend(tree.faces)
        tree = tree.before if above else tree.behind
    order.extend(tree.faces)


def _plane_between(bodies: Sequence[Body]) -> tuple[Vec3, float] | None:
    """Return the plane with the widest gap around it that parts the bodies without touching one, if any.

    For two upright boxes a plane along a face of one of them is enough (separating axis theorem).
    """
    axes: list[Vec3] = [(0.0, 0.0, 1.0)]
    for body in bodies:
        c, s = cos(body.hull.yaw_rad), sin(body.hull.yaw_rad)
        axes += [(c, s, 0.0), (-s, c, 0.0)]
    widest, plane = 0.0, None
    for axis in axes:
        spans = []
        for body in bodies:
            middle, reach = float(np.dot(axis, body.hull.centre_arena_m)), body.hull.reach_m(axis)
            spans.append((middle - reach, middle + reach))
        spans.sort()
        end = spans[0][1]
        for low, high in spans[1:]:
            if low - end > widest:
                widest, plane = low - end, (axis, (low + end) / 2)
            end = max(end, high)
    return plane


def _heights(plane: Face, face: Face) -> npt.NDArray[np.float64]:
    """Return how far a face's corners are before the plane of another, metres, shape (k,)."""
    heights: npt.NDArray[np.float64] = (face.corners_arena_m - plane.corners_arena_m[0]) @ np.array(
        plane.normal_arena
    )
    return heights


def _is_cut(plane: Face, face: Face) -> bool:
    heights = _heights(plane, face)
    return bool(heights.min() < -_FLAT_M and heights.max() > _FLAT_M)


def _below(face: Face, heights: npt.NDArray[np.float64]) -> Face:
    """Return the part of a face whose heights are not above zero."""
    if heights.max() <= _FLAT_M:
        return face
    kept = []
    for i, corner in enumerate(face.corners_arena_m):
        last, here = heights[i - 1], heights[i]
        if (last > 0.0) != (here > 0.0):
            before = face.corners_arena_m[i - 1]
            kept.append(before + (corner - before) * (last / (last - here)))
        if here <= 0.0:
            kept.append(corner)
    return replace(face, corners_arena_m=np.array(kept))
