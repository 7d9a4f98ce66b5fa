"""People in the hall: bodies of boxes, painted among all others."""

from __future__ import annotations

from dataclasses import dataclass

from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import Vec3
from scenarios.imaging.furnishings import Person
from scenarios.models import Light
from sitl.camera_scene import Bgr, Body, box_face
from sitl.optics.colours import PATCH_BGR

_BoxFace = tuple[list[Vec3], Vec3]  # corners and normal
_SKIN_BGR: Bgr = (118, 152, 206)
_GIRTH = 1.75  # height of a person of these widths, metres


@dataclass(frozen=True, slots=True)
class _Layer:
    """Boxes beside each other, of the same depth and height.

    Attributes:
        bottom: share of the person's height.
        top: the same.
        half_depth_m: along their line of sight.
        spans_m: from right to left, where each box begins and ends.
    """

    bottom: float
    top: float
    half_depth_m: float
    spans_m: tuple[tuple[float, float], ...]


_LEGS = _Layer(0.0, 0.48, 0.09, ((-0.19, -0.03), (0.03, 0.19)))
_TRUNK = _Layer(0.48, 0.83, 0.11, ((-0.31, -0.23), (-0.205, 0.205), (0.23, 0.31)))
_HEAD = _Layer(0.83, 1.0, 0.09, ((-0.08, 0.08),))


def person_body(person: Person, light: Light) -> Body:
    """A person's faces in an order of painting that is right from everywhere.

    Within a layer nothing hides the outer faces, and only they hide the inner ones: their order is that of a
    gate's. For an eye above the plane between two layers the lower one hides nothing of the upper one. To an
    eye below it the lower one hides only the upper one's bottom, which is painted first. That a shoulder may
    hide a little of the head is left out.
    """
    half_height_m = person.height_m / 2
    reach_m = _TRUNK.spans_m[-1][1] * person.height_m / _GIRTH
    half_m = (_TRUNK.half_depth_m * person.height_m / _GIRTH, reach_m, half_height_m)
    hull = Solid("person", (person.x_m, person.y_m, half_height_m), person.yaw_rad, half_m)
    layers = (
        (_LEGS, PATCH_BGR[person.trousers]),
        (_TRUNK, PATCH_BGR[person.shirt]),
        (_HEAD, _SKIN_BGR),
    )
    flat = [
        (face, colour)
        for make in (_bottoms, _other_faces)
        for layer, colour in layers
        for face in make(layer, person.height_m)
    ]
    return Body(hull, tuple(box_face(hull, corners, normal, each, light) for (corners, normal), each in flat))


def _bottoms(layer: _Layer, height_m: float) -> list[_BoxFace]:
    """Corners and normals of what is seen from below, in the person's axes, metres from its centre."""
    z = height_m * (layer.bottom - 0.5)
    return [_level(layer, span, height_m, z, -1.0) for span in layer.spans_m] if layer.bottom > 0.0 else []


def _other_faces(layer: _Layer, height_m: float) -> list[_BoxFace]:
    """The same of all that is not seen from below, the faces between the boxes first."""
    scale = height_m / _GIRTH
    low, high = (height_m * (share - 0.5) for share in (layer.bottom, layer.top))
    x = layer.half_depth_m * scale

    def side(y_m: float, sign: float) -> _BoxFace:
        y = scale * y_m
        return [(-x, y, low), (x, y, low), (x, y, high), (-x, y, high)], (0.0, sign, 0.0)

    spans = layer.spans_m
    # Who sees these sees the farther ones before the nearer ones.
    faces = [side(left, 1.0) for _, left in spans[:-1]]
    faces += [side(right, -1.0) for right, _ in reversed(spans[1:])]
    for span in spans:
        right, left = (scale * y_m for y_m in span)
        for sign in (-1.0, 1.0):
            at = sign * x
            corners: list[Vec3] = [(at, right, low), (at, left, low), (at, left, high), (at, right, high)]
            faces.append((corners, (sign, 0.0, 0.0)))
        faces.append(_level(layer, span, height_m, high, 1.0))
    return [*faces, side(spans[0][0], -1.0), side(spans[-1][1], 1.0)]


def _level(layer: _Layer, span_m: tuple[float, float], height_m: float, z: float, sign: float) -> _BoxFace:
    """The top or the bottom of a box."""
    scale = height_m / _GIRTH
    right, left, x = scale * span_m[0], scale * span_m[1], scale * layer.half_depth_m
    return [(-x, right, z), (x, right, z), (x, left, z), (-x, left, z)], (0.0, 0.0, sign)
