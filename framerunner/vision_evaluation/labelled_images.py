"""Images of known scenes, drawn by level and seed, with what is to be seen in them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import atan2, cos, degrees, pi, radians, sin

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.flying.detector import true_calibration
from framerunner.geometry.gate_shape import GateShapes
from framerunner.geometry.rotations import (
    RotationRows,
    mounting_flu,
    multiply,
    quaternion_from_euler,
    rotated_by_rate,
    rotation,
    rotation_rows,
)
from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import Quaternion, Vec3
from framerunner.vision_evaluation.backgrounds import Backgrounds
from framerunner.vision_evaluation.camera_chain import (
    CLIP_IMAGES,
    CLIP_RATE_HZ,
    CameraChain,
)
from scenarios.models import Scenario, UprightGate
from scenarios.random_scenarios import Level, random_scenario
from sitl.camera import STILL, ExposureMotion, SimulatedCamera
from sitl.optics.backdrop import Backdrop
from vision.calibration.lens import Lens
from vision.calibration.model import Calibration
from vision.types import Image

Floats = npt.NDArray[np.float64]

IMAGES_OF_A_SCENE = 5
_NEAREST_M, _FARTHEST_M = 0.4, 7.0  # of the gate that the camera is turned to
_MAX_ANGLE_DEG, _MAX_ASIDE_DEG, _MAX_TILT_DEG = 80.0, 38.0, 15.0
_ANYWHERE = 0.25  # share of the images that are turned anywhere
_CLEAR_M = 0.35  # of the drone from everything
_BESIDE_PX = 2.0  # what is nearer to a gate's outline than this may hide a part of it
_DEPTH_M = 0.05  # nearer than this a gate is not labelled with pixels
_DRAWS = 1000
_LAST_S = 120.0  # of the flight
_MAX_SPEED_M_S = 0.8
_RATES_RAD_S = (0.2, 0.2, 0.4)  # standard deviations of roll, pitch and yaw


@dataclass(frozen=True, slots=True)
class GateLabel:
    """What is true of one gate in one image; camera axes forward, left, up."""

    colour: str
    distance_m: float  # from the camera to the opening's centre
    angle_deg: float  # between the line of sight and the gate's normal, 0..90
    position_flu_m: Vec3
    normal_flu: Vec3  # on the side from which it is seen
    corners_px: tuple[tuple[float, float], ...]
    """Of the middle plane, from the optical axis, as an ideal camera sees them; none if behind."""
    seen: bool  # a part of it may be in the image
    whole: bool  # all of it is in the image, and nothing is before it
    opening_px: tuple[tuple[float, float], ...] = ()
    """Corners of the opening, if it is by them that a detector is rated, in the same order and axes."""


@dataclass(frozen=True, slots=True, eq=False)
class LabelledImage:
    """An image and what is in it."""

    image: Image
    scenario: str
    position_arena_m: Vec3
    attitude_arena: Quaternion
    calibration: Calibration
    gates: tuple[GateLabel, ...]
    shapes: GateShapes = field(default_factory=GateShapes)  # that a drone is told

    @property
    def focal_px(self) -> float:
        """Focal length of the camera."""
        return self.calibration.fx_px


def labelled_images(
    level: Level, count: int, seed: int, chain: CameraChain, backgrounds: Backgrounds | None = None
) -> Iterator[LabelledImage]:
    """Paint images from random poses in random scenarios of a level.

    Three of four are turned to one of the gates, from all distances and angles; the others anywhere. The
    same arguments give the same images. With a level's camera effects, the drone flies and turns.

    Args:
        level: of which scenarios are drawn.
        count: of images.
        seed: of the first scenario, and of all that is drawn.
        chain: what the camera does, beside the level's effects.
        backgrounds: photographs behind gates, base and obstacles; None: the level's floor, hall and sky.
    """
    streams = _Streams.of_seed(seed)
    scene: _LabelledScene | None = None
    for number in range(count):
        if scene is None or number % IMAGES_OF_A_SCENE == 0:
            drawn = seed + number // IMAGES_OF_A_SCENE
            scenario = chain.applied_to(random_scenario(level, drawn), streams.chain)
            scene = _LabelledScene(scenario, drawn)
        position, attitude = scene.draw_pose(streams.poses)
        motion = scene.draw_motion(streams.motions, moves=chain.h264_mbit_s is not None)
        backdrop = None
        if backgrounds is not None:
            rows = scene.camera_rows(attitude)
            backdrop = backgrounds.draw(scene.scenario.camera, rows, streams.backgrounds)
        image = scene.image(position, attitude, motion, chain, backdrop)
        labels = scene.labels(position, attitude)
        yield LabelledImage(
            image, scene.scenario.name, position, attitude, scene.calibration, labels, scene.shapes
        )


@dataclass(frozen=True, slots=True)
class _Streams:
    """Random numbers by what they are for."""

    poses: np.random.Generator
    motions: np.random.Generator
    chain: np.random.Generator
    backgrounds: np.random.Generator

    @classmethod
    def of_seed(cls, seed: int) -> _Streams:
        return cls(*(np.random.Generator(np.random.PCG64([seed, use])) for use in (0, 2, 3, 4)))


class _LabelledScene:
    """A scenario and its camera."""

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self.scenario = scenario
        self.shapes = GateShapes(scenario.gate_shapes)
        self.camera = SimulatedCamera(scenario, seed)
        self.calibration = true_calibration(scenario.camera)
        self._lens = None if self.calibration.is_ideal else Lens(self.calibration)
        others = [scenario.base.solid, *scenario.prisms]
        self._solids = [*(gate.hull for gate in scenario.all_gates), *others]

    def draw_pose(self, stream: np.random.Generator) -> tuple[Vec3, Quaternion]:
        """A pose of the drone inside the arena, clear of everything."""
        for _ in range(_DRAWS):
            position, yaw = self._turned_to_a_gate(stream)
            if stream.random() < _ANYWHERE:
                yaw = stream.uniform(-pi, pi)
            if self._is_free(position):
                break
        roll, pitch = (radians(stream.uniform(-_MAX_TILT_DEG, _MAX_TILT_DEG)) for _ in range(2))
        return position, quaternion_from_euler(roll, pitch, yaw)

    def draw_motion(self, stream: np.random.Generator, *, moves: bool) -> ExposureMotion:
        """When the image is taken, and how the drone moves then: as in a contest flight."""
        if self.scenario.camera.effects is None and not moves:
            return STILL
        time_us = int(stream.uniform(0.0, _LAST_S) * 1e6)
        vx, vy, vz = (float(value) for value in stream.uniform(-_MAX_SPEED_M_S, _MAX_SPEED_M_S, 3))
        roll, pitch, yaw = (float(value) for value in stream.normal(0.0, 1.0, 3) * np.array(_RATES_RAD_S))
        return ExposureMotion(time_us, (vx, vy, vz), (roll, pitch, yaw))

    def camera_rows(self, attitude: Quaternion) -> RotationRows:
        """Rows of the matrix from the camera's forward, left, up to arena axes."""
        mounting = mounting_flu(self.scenario.camera.mounting_frd_rad)
        return rotation_rows(rotation(multiply(attitude, mounting)))

    def image(
        self,
        position_arena_m: Vec3,
        attitude: Quaternion,
        motion: ExposureMotion,
        chain: CameraChain,
        backdrop: Backdrop | None,
    ) -> Image:
        """What a detector gets of a pose: the last image of a clip if it is of an H.264 stream."""
        count = 1 if chain.h264_mbit_s is None else CLIP_IMAGES
        clip = []
        vx, vy, vz = motion.velocity_arena_m_s
        roll, pitch, yaw = motion.rate_frd_rad_s
        for before in range(1 - count, 1):
            after_s = before / CLIP_RATE_HZ
            x, y, z = position_arena_m
            clip.append(
                self.camera.render(
                    (x + vx * after_s, y + vy * after_s, z + vz * after_s),
                    rotated_by_rate(attitude, (roll, -pitch, -yaw), after_s),
                    motion=replace(motion, time_us=motion.time_us + round(1e6 * after_s)),
                    backdrop=backdrop,
                )
            )
        return chain.compressed(clip)

    def labels(self, position_arena_m: Vec3, attitude: Quaternion) -> tuple[GateLabel, ...]:
        """What is true of every gate."""
        camera = self.scenario.camera
        body = np.array(rotation_rows(rotation(attitude)))
        eye = np.array(position_arena_m) + body @ np.array(camera.position_flu_m)
        rows = np.array(self.camera_rows(attitude))
        outlines = [self._outline(solid, eye, rows) for solid in self._solids]
        return tuple(
            self._label(gate, eye, rows, outlines, k) for k, gate in enumerate(self.scenario.all_gates)
        )

    def _turned_to_a_gate(self, stream: np.random.Generator) -> tuple[Vec3, float]:
        gates = self.scenario.all_gates
        gate = gates[int(stream.random() * len(gates))]
        distance_m = stream.uniform(_NEAREST_M, _FARTHEST_M)
        around = gate.yaw_rad + radians(stream.uniform(-_MAX_ANGLE_DEG, _MAX_ANGLE_DEG))
        around += pi * (stream.random() < 0.5)
        x, y = gate.x_m + distance_m * cos(around), gate.y_m + distance_m * sin(around)
        z = gate.z_m + distance_m * sin(radians(stream.uniform(-30.0, 30.0)))
        aside = radians(stream.uniform(-_MAX_ASIDE_DEG, _MAX_ASIDE_DEG))
        return (x, y, z), atan2(gate.y_m - y, gate.x_m - x) + aside

    def _is_free(self, position: Vec3) -> bool:
        arena = self.scenario.arena
        x, y, z = position
        inside = abs(x) < arena.length_x_m / 2 and abs(y) < arena.width_y_m / 2
        above = _CLEAR_M < z < arena.height_m - _CLEAR_M
        return inside and above and not any(solid.is_within(_CLEAR_M, position) for solid in self._solids)

    def _outline(self, solid: Solid, eye: Floats, rows: Floats) -> tuple[Floats | None, float, float]:
        """Convex outline in pixels (None if it reaches beside the camera), nearest and farthest depth."""
        points = (np.array(solid.corners()) - eye) @ rows
        nearest, farthest = float(points[:, 0].min()), float(points[:, 0].max())
        if nearest < _DEPTH_M:
            return None, nearest, farthest
        flat = -self.camera.focal_px * points[:, 1:] / points[:, :1]
        hull = cv2.convexHull(flat.astype(np.float32)).reshape(-1, 2).astype(np.float64)
        return hull, nearest, farthest

    def _label(
        self,
        gate: UprightGate,
        eye: Floats,
        rows: Floats,
        outlines: Sequence[tuple[Floats | None, float, float]],
        own: int,
    ) -> GateLabel:
        centre = np.array(gate.position_arena_m)
        normal = np.array([cos(gate.yaw_rad), sin(gate.yaw_rad), 0.0])
        sight = centre - eye
        if normal @ sight > 0.0:
            normal = -normal
        distance_m = float(np.linalg.norm(sight))
        angle = degrees(np.arccos(min(1.0, float(-normal @ sight) / distance_m)))
        hull, _, farthest = outlines[own]
        seen, whole = farthest > 0.0, False
        corners: tuple[tuple[float, float], ...] = ()
        if hull is not None:
            half = np.array([self.scenario.camera.width_px, self.scenario.camera.height_px]) / 2.0
            places = hull
            if self._lens is not None:
                places = np.array([self._lens.seen(x, y) for x, y in hull.tolist()])
            seen = bool((places.max(axis=0) > -half).all() and (places.min(axis=0) < half).all())
            inside = bool((np.abs(places) < half - _BESIDE_PX).all())
            whole = inside and not any(
                _covers(outline, hull)
                for k, outline in enumerate(outlines)
                if k != own and outline[1] < farthest
            )
            corners = self._corners(gate, normal, eye, rows)
        return GateLabel(
            gate.colour,
            distance_m,
            angle,
            _vector(rows.T @ sight),
            _vector(rows.T @ normal),
            corners,
            seen,
            whole,
        )

    def _corners(
        self, gate: UprightGate, normal: Floats, eye: Floats, rows: Floats
    ) -> tuple[tuple[float, float], ...]:
        """Upper left, upper right, lower right and lower left as seen, in the middle plane."""
        left = np.cross(np.array([0.0, 0.0, 1.0]), -normal) * gate.outer_width_m / 2
        up = np.array([0.0, 0.0, gate.outer_height_m / 2])
        centre = np.array(gate.position_arena_m) - eye
        points = (
            np.array([centre + left + up, centre - left + up, centre - left - up, centre + left - up]) @ rows
        )
        flat = -self.camera.focal_px * points[:, 1:] / points[:, :1]
        return tuple((right, down) for right, down in flat.tolist())


def _covers(other: tuple[Floats | None, float, float], hull: Floats) -> bool:
    """Whether something may be before a part of a gate."""
    outline, _, farthest = other
    if outline is None:
        return farthest > 0.0  # beside the camera
    middle = hull.mean(axis=0)
    reach = hull - middle
    grown = middle + reach * (1.0 + _BESIDE_PX / np.maximum(np.abs(reach).max(axis=0), 1.0))
    shared, _ = cv2.intersectConvexConvex(outline.astype(np.float32), grown.astype(np.float32))
    return bool(shared > 0.0)


def _vector(values: Floats) -> Vec3:
    x, y, z = values.tolist()
    return (x, y, z)
