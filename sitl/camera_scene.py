"""The scenario as flat, shaded polygons, made once, and the order in which they are painted for any eye.

Nothing in the arena moves, so in one light every face has one colour (Lambert's law with ambient light) and
every shadow on the floor is a fixed polygon.

The order is that of a tree of planes: what lies on the eye's side of a plane may hide what lies beyond it and
never the reverse (Fuchs, Kedem, Naylor, "On visible surface generation by a priori tree structures", 1980).
Planes that pass between bodies come first: they separate the few bodies of an arena, and within one body its
own order of faces holds. Only bodies that no plane separates, which intersect or interlock, are taken apart
face by face, and faces cut in two where they must be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.geometry.base_marker import BaseMarkers
from framerunner.geometry.marker_cells import white_parts
from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import Vec3
from scenarios.models import Arena, Base, Light, Scenario, UprightGate
from sitl.optics.texture import FaceTexture
from sitl.solids import gate_solids

Bgr = tuple[int, int, int]
Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

GATE_BGR: dict[str, Bgr] = {"red": (0, 0, 255), "green": (0, 255, 0), "blue": (255, 0, 0)}
DECOY_BGR: dict[str, Bgr] = {"cyan": (255, 255, 0), "magenta": (255, 0, 255)}
# Neither decoys nor these pass the detectors' colour tests, lit, shaded or after JPEG; nor does a pixel in
# which two of these are mixed. One in which a cyan decoy and the tatami are is green to the paper's test.
# The sky's are from the zenith down to the horizon.
SKY_BGR: tuple[Bgr, ...] = ((222, 206, 190), (224, 210, 196), (226, 214, 202), (228, 218, 208))
GROUND_BGR: Bgr = (132, 134, 134)
UNDERGROUND_BGR: Bgr = (28, 30, 32)
TATAMI_BGR: Bgr = (64, 180, 216)
TATAMI_MAT_BGR: Bgr = (55, 168, 204)
PRISM_BGR: Bgr = (160, 66, 109)  # of poles and walls: violet
BASE_BGR: Bgr = (168, 170, 172)
BASE_MARK_BGR: Bgr = (238, 238, 238)
PAPER_BGR: Bgr = (238, 238, 238)
INK_BGR: Bgr = (26, 26, 26)
DRONE_BGR: Bgr = (64, 62, 60)

WALL = "hall"
"""Name of the faces of a hall and of what is on its walls."""

_MAT_M = 2.0  # edge of one mat of the tatami
_DARKEST = 0.3  # share of its colour that every face keeps: a gate's colour must stay recognisable
SHADOW = 0.6  # brightness of the floor in a shadow
_FLAT_M = 1e-7  # corners nearer to a plane than this lie on it
_UP: Vec3 = (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """A convex flat polygon that is seen from one side."""

    corners_arena_m: Floats  # shape (k, 3), in order
    normal_arena: Vec3  # unit vector to the side it is seen from
    colour: Bgr  # as painted, shading included
    name: str  # of its solid; "tatami" or "ground" on the floor
    texture: FaceTexture | None = None  # a picture instead of the colour


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A base, a gate, a pole or a part of a wall."""

    hull: Solid  # the box around it
    faces: tuple[Face, ...]  # in an order of painting: a later one is never hidden by an earlier one
    inner: int = 0  # how many of the first faces are around an opening: they hide nothing that is in it


@dataclass(frozen=True, slots=True)
class Scene:
    """All that can be seen."""

    tatami: Face  # the arena's floor
    mats: tuple[Face, ...]  # every second mat of it, darker
    shadows: tuple[Face, ...]  # on the floor
    bodies: tuple[Body, ...]  # base, gates, decoys, poles and walls


def build_scene(scenario: Scenario, light: Light | None = None) -> Scene:
    """Make the faces that the camera paints, in the scenario's light or another."""
    arena, base = scenario.arena, scenario.base.solid
    light = light or scenario.light
    gates, prisms = scenario.all_gates, scenario.prisms
    solids = [base, *(bar for gate in gates for bar in _overlapping_bars(gate))]
    shadows = [face for solid in solids for face in _shadow(solid, arena, light)]
    shadows += [face for prism in prisms for face in _long_shadow(prism, arena, light)]
    return Scene(
        tatami=_on_floor(_rectangle(arena, 0.0, 1.0, 0.0, 1.0), lit(TATAMI_BGR, _UP, light), "tatami"),
        mats=_mats(arena, light),
        shadows=tuple(shadows),
        bodies=(
            _base_body(scenario.base, light),
            *(_gate_body(gate, light) for gate in gates),
            *(Body(prism, _upright_faces(prism, PRISM_BGR, light)) for prism in prisms),
        ),
    )


def _dim(colour: Bgr, share: float) -> Bgr:
    blue, green, red = (round(channel * share) for channel in colour)
    return (blue, green, red)


def lit(colour: Bgr, normal: Vec3, light: Light) -> Bgr:
    """The colour of a face in a light, see `brightness`."""
    return _dim(colour, brightness(normal, light))


def brightness(normal: Vec3, light: Light) -> float:
    """Share of its colour that a face has: ambient light and the sun by Lambert's law, `_DARKEST` or more."""
    x, y, z = light.sun_direction_arena
    length = hypot(x, y, z)
    facing = -(normal[0] * x + normal[1] * y + normal[2] * z) / length if length > 0 else 0.0
    return max(_DARKEST, light.ambient + (1.0 - light.ambient) * max(0.0, facing))


def _on_floor(corners_xy: Sequence[Sequence[float]] | Floats, colour: Bgr, name: str) -> Face:
    corners = np.zeros((len(corners_xy), 3))
    corners[:, :2] = corners_xy
    return Face(corners, _UP, colour, name)


def _rectangle(arena: Arena, x0: float, x1: float, y0: float, y1: float) -> list[tuple[float, float]]:
    """Corners of a part of the arena's floor, by shares 0..1 of its edges."""
    left, right = (x0 - 0.5) * arena.length_x_m, (x1 - 0.5) * arena.length_x_m
    near, far = (y0 - 0.5) * arena.width_y_m, (y1 - 0.5) * arena.width_y_m
    return [(left, near), (right, near), (right, far), (left, far)]


def _mats(arena: Arena, light: Light) -> tuple[Face, ...]:
    """Every second mat as on a chessboard; at most 20 by 20 mats, so that a huge arena stays cheap."""
    colour = lit(TATAMI_MAT_BGR, _UP, light)
    rows = min(20, max(1, round(arena.length_x_m / _MAT_M)))
    columns = min(20, max(1, round(arena.width_y_m / _MAT_M)))
    return tuple(
        _on_floor(
            _rectangle(arena, i / rows, (i + 1) / rows, j / columns, (j + 1) / columns), colour, "tatami"
        )
        for i in range(rows)
        for j in range(columns)
        if (i + j) % 2
    )


def box_face(box: Solid, local: Sequence[Vec3], normal: Vec3, colour: Bgr, light: Light) -> Face:
    """A face given in a box's own axes (metres from its centre)."""
    c, s = box.turn
    turned = (c * normal[0] - s * normal[1], s * normal[0] + c * normal[1], normal[2])
    return Face(
        np.array([box.to_arena(point) for point in local]), turned, lit(colour, turned, light), box.name
    )


def _base_body(base: Base, light: Light) -> Body:
    box = base.solid
    half, _, top = box.half_extents_m
    faces = list(_upright_faces(box, BASE_BGR, light))
    if base.mark_share > 0.0:
        mark = base.mark_share * half
        inset: list[Vec3] = [(-mark, -mark, top), (mark, -mark, top), (mark, mark, top), (-mark, mark, top)]
        faces.append(box_face(box, inset, _UP, BASE_MARK_BGR, light))
    if base.marker is not None:
        faces += _markers(box, base.marker.markers, light)
    return Body(box, tuple(faces))


def _markers(box: Solid, markers: BaseMarkers, light: Light) -> list[Face]:
    """White sheets, black squares on them, and white cells in these."""
    half, _, half_height = box.half_extents_m
    sheet, black = markers.sheet_m / 2, markers.edge_m / 2
    found = []
    for marked in markers.faces(2 * half, 2 * half_height):
        parts = [((-sheet, sheet, -sheet, sheet), PAPER_BGR), ((-black, black, -black, black), INK_BGR)]
        parts += [(part, PAPER_BGR) for part in white_parts(markers, marked.number)]
        for part, colour in parts:
            local = [(x, y, z - half_height) for x, y, z in marked.rectangle(*part)]
            found.append(box_face(box, local, marked.normal, colour, light))
    return found


def _upright_faces(box: Solid, colour: Bgr, light: Light) -> tuple[Face, ...]:
    """The sides and the top of a box on the floor."""
    return tuple(
        box_face(box, _side(box.half_extents_m, axis, sign), _normal(axis, sign), colour, light)
        for axis, sign in ((0, 1), (0, -1), (1, 1), (1, -1), (2, 1))
    )


def _gate_body(gate: UprightGate, light: Light) -> Body:
    """The faces of a gate's opening first, then those of its hull.

    Whatever hides a part of the opening's faces from an eye lies on the hull, and the faces of the hull that
    an eye sees never hide one another, so this order is right from everywhere.
    """
    colour = (GATE_BGR | DECOY_BGR)[gate.colour]
    box = gate.hull
    outer = box.half_extents_m
    inner: Vec3 = (outer[0], outer[1] - gate.bar_m, outer[2] - gate.bar_m)
    around = ((1, 1), (1, -1), (2, 1), (2, -1))
    faces = [
        box_face(box, _side(inner, axis, sign), _normal(axis, -sign), colour, light) for axis, sign in around
    ]
    for sign in (1, -1):
        x, y, z, v, w = sign * outer[0], outer[1], outer[2], inner[1], inner[2]
        for y0, y1, z0, z1 in ((-y, y, w, z), (-y, y, -z, -w), (v, y, -w, w), (-y, -v, -w, w)):
            quad: list[Vec3] = [(x, y0, z0), (x, y1, z0), (x, y1, z1), (x, y0, z1)]
            faces.append(box_face(box, quad, _normal(0, sign), colour, light))
    faces += [
        box_face(box, _side(outer, axis, sign), _normal(axis, sign), colour, light) for axis, sign in around
    ]
    return Body(box, tuple(faces), len(around))


def _normal(axis: int, sign: int) -> Vec3:
    return (float(sign * (axis == 0)), float(sign * (axis == 1)), float(sign * (axis == 2)))


def _side(half: Vec3, axis: int, sign: int) -> list[Vec3]:
    """Corners of one side of a box, in order around it."""
    corners = []
    for first, second in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        signs = [first, second]
        signs.insert(axis, sign)
        corners.append((signs[0] * half[0], signs[1] * half[1], signs[2] * half[2]))
    return corners


def _overlapping_bars(gate: UprightGate) -> list[Solid]:
    """The four bars of a gate, all of full length, so that their shadows leave no gap between them."""
    top, bottom, *sides = gate_solids(gate)
    half_m = (gate.shape.depth_m / 2, gate.bar_m / 2, gate.outer_height_m / 2)
    return [top, bottom, *(replace(side, half_extents_m=half_m) for side in sides)]


def _shadow(solid: Solid, arena: Arena, light: Light) -> list[Face]:
    """The shadow of a solid on the floor; none if the sun does not shine from above."""
    cast = _cast(solid, light)
    if cast is None:
        return []
    x, y = cast.mean(axis=0)
    on_tatami = abs(x) <= arena.length_x_m / 2 and abs(y) <= arena.width_y_m / 2
    return [_in_shadow(_outline(cast), light, on_tatami=on_tatami)]


def _long_shadow(solid: Solid, arena: Arena, light: Light) -> list[Face]:
    """The same for a solid whose shadow may reach beyond the tatami: on the ground, then on the tatami."""
    cast = _cast(solid, light)
    if cast is None:
        return []
    outline = _outline(cast)
    tatami = np.array(_rectangle(arena, 0.0, 1.0, 0.0, 1.0), np.float32)
    area, inside = cv2.intersectConvexConvex(outline, tatami)
    faces = [_in_shadow(outline, light, on_tatami=False)]
    return [*faces, _in_shadow(inside.reshape(-1, 2), light, on_tatami=True)] if area > 0.0 else faces


def _cast(solid: Solid, light: Light) -> Floats | None:
    """Where the sun casts a solid's corners on the floor, shape (8, 2); None if it is not above."""
    sun = np.array(light.sun_direction_arena)
    if sun[2] >= -1e-3 * float(np.linalg.norm(sun)):
        return None
    corners = np.array(solid.corners())
    cast: Floats = corners[:, :2] - corners[:, 2:] / sun[2] * sun[:2]
    return cast


def _outline(points: Floats) -> npt.NDArray[np.float32]:
    """The convex hull of points in plan, shape (k, 2)."""
    hull: npt.NDArray[np.float32] = cv2.convexHull(points.astype(np.float32)).reshape(-1, 2)
    return hull


def _in_shadow(outline: npt.NDArray[np.float32], light: Light, *, on_tatami: bool) -> Face:
    name, colour = ("tatami", TATAMI_BGR) if on_tatami else ("ground", GROUND_BGR)
    return _on_floor(outline.tolist(), _dim(lit(colour, _UP, light), SHADOW), name)


@dataclass(frozen=True, slots=True)
class _Node:
    """A plane normal . p = offset, the faces that lie on it and the trees on each side of it."""

    normal: Vec3
    offset: float
    behind: _Tree
    faces: tuple[int, ...]
    before: _Tree


_Tree = tuple[int, ...] | _Node  # a leaf has the numbers of faces in the order of painting


class PaintTree:
    """The faces of all bodies, some of them cut in parts, and their order of painting."""

    def __init__(self, bodies: Sequence[Body]) -> None:
        self.faces: list[Face] = []
        self.parts: list[int] = []  # numbers of the first faces of bodies, or of several that intersect
        self._bodies: dict[int, Body] = {}  # those that are leaves, by the number of their first face
        self._root = self._part_bodies(bodies)

    def back_to_front(self, eye_arena_m: Vec3) -> list[int]:
        """Indices of `faces` in the order of painting: none is hidden by one before it."""
        order: list[int] = []
        _walk(self._root, eye_arena_m, order)
        return order

    def places(self, eye_arena_m: Vec3, points_arena_m: Floats) -> Ints:
        """Where things that are not in the tree belong in the order of painting.

        Args:
            eye_arena_m: shape (3,).
            points_arena_m: one of each thing, shape (n, 3).

        Returns:
            For each how many faces of `back_to_front` are painted before it, shape (n,).
        """
        found = np.zeros(len(points_arena_m), np.int64)
        self._find_places(self._root, np.array(eye_arena_m), points_arena_m, found)
        return found

    def _find_places(self, tree: _Tree, eye: Floats, points: Floats, found: Ints) -> None:
        """Add to `found` what is painted before each point in this part of the tree."""
        if not len(points):
            return
        if not isinstance(tree, _Node):
            if tree:
                found += _before_body(self._bodies[tree[0]], eye, points)
            return
        normal = np.array(tree.normal)
        is_above = float(normal @ eye) > tree.offset
        is_near = (points @ normal > tree.offset) == is_above
        far, near = (tree.behind, tree.before) if is_above else (tree.before, tree.behind)
        for part, chosen, before in ((far, ~is_near, 0), (near, is_near, _count(far) + len(tree.faces))):
            inner = np.full(int(chosen.sum()), before, np.int64)
            self._find_places(part, eye, points[chosen], inner)
            found[chosen] += inner

    def _part_bodies(self, bodies: Sequence[Body]) -> _Tree:
        plane = _plane_between(bodies) if len(bodies) > 1 else None
        if plane is None and bodies:
            self.parts.append(len(self.faces))
        if len(bodies) < 2:
            for body in bodies:
                self._bodies[len(self.faces)] = body
            return self._keep([face for body in bodies for face in body.faces])
        if plane is None:
            return self._part_faces([face for body in bodies for face in body.faces])
        normal, offset = plane
        beyond = [body for body in bodies if np.dot(normal, body.hull.centre_arena_m) < offset]
        near = [body for body in bodies if body not in beyond]
        return _Node(normal, offset, self._part_bodies(beyond), (), self._part_bodies(near))

    def _part_faces(self, faces: list[Face]) -> _Tree:
        if not faces:
            return ()
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


def _walk(tree: _Tree, eye: Vec3, order: list[int]) -> None:
    while isinstance(tree, _Node):
        normal = tree.normal
        above = normal[0] * eye[0] + normal[1] * eye[1] + normal[2] * eye[2] > tree.offset
        _walk(tree.behind if above else tree.before, eye, order)
        order.extend(tree.faces)
        tree = tree.before if above else tree.behind
    order.extend(tree)


def _count(tree: _Tree) -> int:
    """Number of faces."""
    count = 0
    while isinstance(tree, _Node):
        count += _count(tree.behind) + len(tree.faces)
        tree = tree.before
    return count + len(tree)


def _before_body(body: Body, eye: Floats, points: Floats) -> Ints:
    """How many faces of a body are painted before each point: none, those around its opening, or all."""
    (c, s), half = body.hull.turn, np.array(body.hull.half_extents_m)
    offsets = np.vstack((eye, points)) - np.array(body.hull.centre_arena_m)
    offsets = offsets @ np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))  # in the hull's own axes
    beyond = np.where(np.abs(offsets) > half, np.sign(offsets), 0.0)  # which of its sides
    # Beyond a side that the eye sees, nothing of the body is nearer.
    is_nearer = (beyond[1:] * beyond[0] > 0.0).any(axis=1)
    is_within = ~beyond[1:].any(axis=1)
    return np.where(is_nearer, len(body.faces), np.where(is_within, body.inner, 0))


def _plane_between(bodies: Sequence[Body]) -> tuple[Vec3, float] | None:
    """The plane with the widest gap around it that separates the bodies without touching one, if any.

    For two upright boxes a plane along a face of one of them is enough (separating axis theorem).
    """
    axes: list[Vec3] = [(0.0, 0.0, 1.0)]
    for body in bodies:
        c, s = body.hull.turn
        axes += [(c, s, 0.0), (-s, c, 0.0)]
    widest, plane = 0.0, None
    for axis in axes:
        spans = []
        for body in bodies:
            middle, reach = float(np.dot(axis, body.hull.centre_arena_m)), _reach_m(body.hull, axis)
            spans.append((middle - reach, middle + reach))
        spans.sort()
        end = spans[0][1]
        for low, high in spans[1:]:
            if low - end > widest:
                widest, plane = low - end, (axis, (low + end) / 2)
            end = max(end, high)
    return plane


def _reach_m(box: Solid, axis: Vec3) -> float:
    """How far a box extends from its centre along a unit vector."""
    c, s = box.turn
    x, y, z = box.half_extents_m
    along, across = c * axis[0] + s * axis[1], c * axis[1] - s * axis[0]
    return x * abs(along) + y * abs(across) + z * abs(axis[2])


def _heights(plane: Face, face: Face) -> Floats:
    """How far a face's corners are in front of the plane of another, metres, shape (k,)."""
    heights: Floats = (face.corners_arena_m - plane.corners_arena_m[0]) @ np.array(plane.normal_arena)
    return heights


def _is_cut(plane: Face, face: Face) -> bool:
    heights = _heights(plane, face)
    return bool(heights.min() < -_FLAT_M and heights.max() > _FLAT_M)


def _below(face: Face, heights: Floats) -> Face:
    """The part of a face whose heights are not above zero."""
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
