"""The arena in perspective: floor, base, gates, obstacles, the drone and its trail.

Painted from back to front at twice the size and then reduced, so that edges are smooth and nothing shows
through the seams between faces.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from math import cos, pi, sin

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.film import style
from framerunner.film.style import Bgr
from framerunner.film.timeline import Floats, Instant, Timeline
from framerunner.film.viewpoint import FilmCamera
from framerunner.runs.plots import STATE_COLOURS
from framerunner.vehicle.airframe import Airframe, load_airframe
from scenarios.models import Light
from sitl.camera_scene import PaintTree, build_scene
from vision.types import Image

FINE = 2
"""Painted pixels for each pixel of the result, along each edge."""
DRONE_SCALE = 1.6
"""The drone is drawn larger than it is: at its own size it is hard to see on a small screen."""
_SEEN_THROUGH = ("pole", "wall")  # so that the drone is seen behind them
_SLAB_M = 0.06  # thickness of the floor
_TRAIL = [style.bgr(text) for text in STATE_COLOURS]

_BODY = style.bgr("#2b2f36")
_TOP = style.bgr("#454b55")
_ARM = style.bgr("#3a3f47")
_NOSE = style.bgr("#ff9a1f")
_DISC = style.bgr("#8d949e")
_BLADE = style.bgr("#2b2f36")
_CIRCLE_RAD = np.linspace(0.0, 2 * pi, 20, endpoint=False)
_TURNS_PER_S = 2.3  # of the drawn rotors: at their true speed they would only flicker


def state_colour(kind: int) -> Bgr:
    """The colour of a kind of state, as in the plots of flights."""
    return _TRAIL[kind % len(_TRAIL)]


class ArenaView:
    """Paints the arena of one flight into images of one size, width and height in pixels."""

    def __init__(self, timeline: Timeline, size_px: tuple[int, int]) -> None:
        self._timeline = timeline
        self._size_px = size_px
        scenario = timeline.scenario
        scene = build_scene(scenario.model_copy(update={"light": Light()}))
        self._floor = [replace(scene.tatami, colour=style.TATAMI)]
        self._floor += [replace(mat, colour=style.MAT) for mat in scene.mats]
        self._floor += [
            replace(shadow, colour=style.SHADOW) for shadow in scene.shadows if shadow.name == "tatami"
        ]
        self._tree = PaintTree(scene.bodies)
        self._drone = _DroneShape(load_airframe(scenario.airframe), DRONE_SCALE)
        self._slab = _slab(scene.tatami.corners_arena_m)
        self._paper = np.full((FINE * size_px[1], FINE * size_px[0], 3), style.PAPER, np.uint8)
        self._canvas = self._paper.copy()
        self._pen = max(1.0, FINE * size_px[1] / 430)  # pixels of a line's width at the usual size

    def paint(self, instant: Instant, viewpoint: FilmCamera, film_s: float) -> Image:
        """Paint an instant of the flight; the time of the film turns the rotors.

        Returns:
            A new image, BGR, shape (height, width, 3).
        """
        view = viewpoint.scaled(FINE)
        np.copyto(self._canvas, self._paper)
        for corners, colour in self._slab:
            self._fill(view, corners, colour)
        for face in self._floor:
            self._fill(view, face.corners_arena_m, face.colour)
        self._stems(view)
        centre = np.array(instant.position_arena_m)
        self._drop_shadow(view, centre)
        self._solids_and_trail(view, instant, film_s)
        return np.asarray(cv2.resize(self._canvas, self._size_px, interpolation=cv2.INTER_AREA), np.uint8)

    def _solids_and_trail(self, view: FilmCamera, instant: Instant, film_s: float) -> None:
        """Paint the faces, and each piece of the trail where it belongs among them."""
        centre = np.array(instant.position_arena_m)
        points = np.concatenate((self._timeline.trail_m[: instant.trail], centre[None]))
        pixels = view.project(points)
        eye = (float(view.eye_m[0]), float(view.eye_m[1]), float(view.eye_m[2]))
        order = self._tree.back_to_front(eye)
        slots = self._tree.places(eye, (points[1:] + points[:-1]) / 2)
        drone_slot = int(self._tree.places(eye, centre[None])[0])
        runs = _runs(slots, self._timeline.trail_kind[: len(slots)])
        if runs:  # a light line under the whole trail, so that it stands out from the floor
            self._polyline(pixels[runs[0].first : runs[-1].end + 1], style.WHITE, round(4.2 * self._pen))
        patches = self._drone.patches(centre, instant.yaw_rad, film_s, instant.motors_on)
        painted = 0
        for slot in sorted({*(run.slot for run in runs), drone_slot, len(order)}):
            self._faces(view, order[painted:slot])
            painted = slot
            for run in runs:
                if run.slot == slot:
                    width = max(1, round(2.5 * self._pen))
                    self._polyline(pixels[run.first : run.end + 1], state_colour(run.kind), width)
            if slot == drone_slot:
                for patch in patches:
                    self._patch(view, patch)

    def _faces(self, view: FilmCamera, numbers: Iterable[int]) -> None:
        for number in numbers:
            face = self._tree.faces[number]
            if float(np.dot(view.eye_m - face.corners_arena_m[0], face.normal_arena)) > 0.0:
                if face.name in _SEEN_THROUGH:
                    self._patch(view, _Patch(face.corners_arena_m, face.colour, 0.45))
                else:
                    self._fill(view, face.corners_arena_m, face.colour)

    def _patch(self, view: FilmCamera, patch: _Patch) -> None:
        outline = view.polygon(patch.corners_m)
        if len(outline) < 3:
            return
        if patch.opacity >= 1.0:
            cv2.fillConvexPoly(
                self._canvas, style.fixed_point(outline), patch.colour, cv2.LINE_AA, style.SUBPIXEL_BITS
            )
        else:
            self._fill_translucent(outline, patch.colour, patch.opacity)

    def _fill_translucent(self, outline: Floats, colour: Bgr, opacity: float) -> None:
        height, width = self._canvas.shape[:2]
        left, top = np.clip(np.floor(outline.min(axis=0)) - 2, 0, (width, height)).astype(int)
        right, bottom = np.clip(np.ceil(outline.max(axis=0)) + 3, 0, (width, height)).astype(int)
        if right <= left or bottom <= top:
            return
        under = self._canvas[top:bottom, left:right]
        over = under.copy()
        cv2.fillConvexPoly(
            over, style.fixed_point(outline - (left, top)), colour, cv2.LINE_AA, style.SUBPIXEL_BITS
        )
        under[:] = cv2.addWeighted(over, opacity, under, 1.0 - opacity, 0.0)

    def _stems(self, view: FilmCamera) -> None:
        """Thin lines from the gates down to the floor, which show where they are."""
        for gate in self._timeline.scenario.all_gates:
            below_m = gate.z_m - gate.outer_height_m / 2
            self._line(view, np.array([(gate.x_m, gate.y_m, 0.0), (gate.x_m, gate.y_m, below_m)]), style.STEM)

    def _drop_shadow(self, view: FilmCamera, centre_m: Floats) -> None:
        """The drone's shadow straight below it, and a line down to it."""
        x, y, z = centre_m
        base = self._timeline.scenario.base
        over_base = max(abs(x - base.x_m), abs(y - base.y_m)) <= base.edge_m / 2
        if over_base and z >= base.top_m > 0.0:
            return  # the base is painted later
        angles = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
        radius = 0.8 * self._drone.radius_m
        spot = np.stack((x + radius * np.cos(angles), y + radius * np.sin(angles), np.zeros_like(angles)), 1)
        outline = view.polygon(spot)
        if len(outline) > 2:
            self._fill_translucent(outline, style.mixed(style.SHADOW, (40, 50, 60), 0.5), 0.55)
        self._line(view, np.array([(x, y, 0.0), (x, y, z)]), style.mixed(style.STEM, (40, 50, 60), 0.4))

    def _line(self, view: FilmCamera, ends_m: Floats, colour: Bgr) -> None:
        pixels = view.project(ends_m)
        if np.isfinite(pixels).all():
            self._polyline(pixels, colour, max(1, round(1.2 * self._pen)))

    def _polyline(self, pixels: Floats, colour: Bgr, width: int) -> None:
        line = [style.fixed_point(pixels)]
        cv2.polylines(self._canvas, line, False, colour, width, cv2.LINE_AA, style.SUBPIXEL_BITS)

    def _fill(self, view: FilmCamera, corners_m: Floats, colour: Bgr) -> None:
        outline = view.polygon(corners_m)
        if len(outline) > 2:
            cv2.fillConvexPoly(
                self._canvas, style.fixed_point(outline), colour, cv2.LINE_8, style.SUBPIXEL_BITS
            )


@dataclass(frozen=True, slots=True)
class _Run:
    """Neighbouring pieces of the trail, `first` to `end` - 1, that have one slot and one kind of state."""

    slot: int
    kind: int
    first: int
    end: int


def _runs(slots: npt.NDArray[np.int64], kinds: npt.NDArray[np.int32]) -> list[_Run]:
    if not len(slots):
        return []
    ends = np.flatnonzero((np.diff(slots) != 0) | (np.diff(kinds) != 0)) + 1
    bounds = [0, *ends.tolist(), len(slots)]
    return [_Run(int(slots[a]), int(kinds[a]), a, b) for a, b in pairwise(bounds)]


def _slab(corners_m: Floats) -> list[tuple[Floats, Bgr]]:
    """The edges of the floor, a slab a few centimetres thick; those behind it are painted over."""
    low = corners_m - np.array((0.0, 0.0, _SLAB_M))
    count = len(corners_m)
    return [(np.array((low[i - 1], low[i], corners_m[i], corners_m[i - 1])), style.RIM) for i in range(count)]


@dataclass(frozen=True, slots=True)
class _Patch:
    """A flat piece of the drone; corners have shape (k, 3), opacity is from 0 to 1."""

    corners_m: Floats
    colour: Bgr
    opacity: float = 1.0


class _DroneShape:
    """The drone as it is drawn: arms, body and turning rotors, `scale` times as large as its airframe."""

    def __init__(self, airframe: Airframe, scale: float) -> None:
        length_m, width_m, height_m = (scale * side for side in airframe.envelope_m)
        self._half_height_m = scale * airframe.envelope_m[2] / 2
        self._rotor_m = scale * airframe.motor.radius_m
        hubs = [rotor.position_frd_m for rotor in airframe.rotors]
        self._hubs_m = scale * np.array([(x, -y, -z + airframe.envelope_m[2] / 2) for x, y, z in hubs])
        self._spins = [rotor.yaw_sign for rotor in airframe.rotors]
        self._body = np.array((0.2 * length_m, 0.13 * width_m, 0.5 * height_m))
        self._arm_m = 0.045 * length_m
        self.radius_m = float(np.hypot(self._hubs_m[:, 0], self._hubs_m[:, 1]).max()) + self._rotor_m

    def patches(self, centre_m: Floats, yaw_rad: float, time_s: float, motors_on: bool) -> list[_Patch]:
        """All pieces, in arena axes, in an order in which they can be painted when seen from above.

        The drone is level; its rotors turn with the time of the film if its motors are on.
        """
        c, s = cos(yaw_rad), sin(yaw_rad)
        axes = np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)))  # forward, left, up
        found = [self._arm(hub) for hub in self._hubs_m] + self._box()
        for hub, spin in zip(self._hubs_m, self._spins, strict=True):
            found += self._rotor(hub, -spin * 2 * pi * _TURNS_PER_S * time_s if motors_on else 0.6, motors_on)
        return [_Patch(centre_m + each.corners_m @ axes, each.colour, each.opacity) for each in found]

    def _arm(self, hub_m: Floats) -> _Patch:
        along = hub_m[:2] / max(1e-6, float(np.hypot(*hub_m[:2])))
        across = self._arm_m / 2 * np.array((-along[1], along[0]))
        corners = [across, hub_m[:2] + across, hub_m[:2] - across, -across]
        return _Patch(np.array([(x, y, 0.3 * self._half_height_m) for x, y in corners]), _ARM)

    def _box(self) -> list[_Patch]:
        x, y, z = self._body
        plan = ((x, y), (x, -y), (-x, -y), (-x, y))
        sides = [
            _Patch(np.array([(*a, -z), (*b, -z), (*b, z), (*a, z)]), _BODY)
            for a, b in zip(plan, (*plan[1:], plan[0]), strict=True)
        ]
        top = _Patch(np.array([(*corner, z) for corner in plan]), _TOP)
        nose = _Patch(np.array([(x, y, z), (x, -y, z), (0.35 * x, 0.0, z)]), _NOSE)
        return [*sides, top, nose]

    def _rotor(self, hub_m: Floats, angle_rad: float, turning: bool) -> list[_Patch]:
        circle = np.stack((np.cos(_CIRCLE_RAD), np.sin(_CIRCLE_RAD), np.zeros_like(_CIRCLE_RAD)), axis=1)
        disc = _Patch(hub_m + self._rotor_m * circle, _DISC, 0.45 if turning else 0.12)
        c, s = np.cos(angle_rad), np.sin(angle_rad)
        along = self._rotor_m * np.array((c, s, 0.0))
        across = 0.14 * self._rotor_m * np.array((-s, c, 0.0))
        tips = (hub_m + along, hub_m - along)
        blade = np.array([tips[0] + across, tips[1] + across, tips[1] - across, tips[0] - across])
        return [disc, _Patch(blade, _BLADE, 0.85)]
