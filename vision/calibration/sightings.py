"""Gates seen from a moving drone: which images are used, and which sightings are of one gate.

A gate does not move, so the sightings of one are those that put it to one place in the world, whatever the
camera's mounting is thought to be: an error of the mounting moves them together as long as the drone stands,
and spreads them when it moves. The mounting with which they are least spread is where the solution starts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, Slerp

from framerunner.geometry.gate_shape import GateShapes
from framerunner.geometry.rotations import mounting_flu, rotation, rotation_rows
from framerunner.geometry.vectors import Quaternion, Vec3
from vision.types import Detections, GateSighting

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

MAX_GAP_S = 0.3
"""Between two reports; what happened in a longer gap is not known."""
END_S = 0.05
"""Motion is known this long before its end, so that delays and rolling shutters stay within it."""


@dataclass(frozen=True, slots=True)
class MotionReport:
    """A state of the drone, upright axes x, y, z (z up) that are fixed to the world.

    Attributes:
        time_us: vehicle time of the attitude.
        position_time_us: vehicle time of position and velocity.
        position_m: of the drone's centre.
        velocity_m_s: of it.
        attitude: body forward, left, up to the world.
    """

    time_us: int
    position_time_us: int
    position_m: Vec3
    velocity_m_s: Vec3
    attitude: Quaternion


class PoseSpline:
    """The drone's poses between reports: positions by cubic Hermite splines, attitudes with a constant rate.

    Args:
        reports: in any order; those of a time that is known already are left out.

    Attributes:
        start_us: the time from which seconds are counted.
        span_s: the first and the last second at which the pose is known; empty if the first is the larger.
    """

    def __init__(self, reports: Sequence[MotionReport]) -> None:
        self.start_us = min((report.position_time_us for report in reports), default=0)
        times_s = self.seconds([report.position_time_us for report in reports])
        self._position_s, first = np.unique(times_s, return_index=True)
        positions = np.array([report.position_m for report in reports]).reshape(-1, 3)[first]
        velocities = np.array([report.velocity_m_s for report in reports]).reshape(-1, 3)[first]
        times_s = self.seconds([report.time_us for report in reports])
        self._attitude_s, first = np.unique(times_s, return_index=True)
        quaternions = np.array([report.attitude for report in reports]).reshape(-1, 4)[first]
        tracks = (self._position_s, self._attitude_s)
        self._place: CubicHermiteSpline[np.float64] | None = None
        self._attitude: Slerp | None = None
        self.span_s = (0.0, -1.0)
        if min(map(len, tracks)) >= 2:
            self._place = CubicHermiteSpline(self._position_s, positions, velocities)
            self._attitude = Slerp(self._attitude_s, Rotation.from_quat(quaternions[:, [1, 2, 3, 0]]))
            start_s, end_s = (
                max(float(track[0]) for track in tracks),
                min(float(track[-1]) for track in tracks),
            )
            self.span_s = (start_s, end_s - END_S)

    def seconds(self, times_us: Sequence[int]) -> Floats:
        """Vehicle times as seconds since the start."""
        return np.array([(time_us - self.start_us) * 1e-6 for time_us in times_us], np.float64)

    def is_known(self, times_s: Floats) -> Bools:
        """Whether times are within the reports, and in none of their gaps."""
        known: Bools = (times_s >= self.span_s[0]) & (times_s <= self.span_s[1])
        if self.span_s[1] < self.span_s[0]:
            return known
        for track in (self._position_s, self._attitude_s):
            after = np.clip(np.searchsorted(track, times_s), 1, len(track) - 1)
            known &= track[after] - track[after - 1] <= MAX_GAP_S
        return known

    def positions(self, times_s: Floats) -> Floats:
        """Where the drone's centre is, shape (n, 3)."""
        if self._place is None:
            return np.empty((0, 3))
        at: Floats = self._place(np.clip(times_s, self._position_s[0], self._position_s[-1]))
        return at

    def rotations(self, times_s: Floats) -> Floats:
        """Matrices from body to world, shape (n, 3, 3)."""
        if self._attitude is None:
            return np.empty((0, 3, 3))
        turned = self._attitude(np.clip(times_s, self._attitude_s[0], self._attitude_s[-1]))
        return np.asarray(turned.as_matrix(), np.float64)


def mounting_matrix(angles_frd_rad: Vec3) -> Floats:
    """The matrix from a camera's axes to the body's, forward, left, up, by its roll, pitch and yaw."""
    return np.array(rotation_rows(rotation(mounting_flu(angles_frd_rad))))


Indices = npt.NDArray[np.intp]

MAX_SIGHTINGS = 700
MIN_OF_A_GATE = 12
"""Sightings; of what is seen less often nothing is learnt."""
_MAX_GATES = 8
_MIN_CORNERS = 3
_SAME_PLACE_M = 0.45
_MOVED_M, _TURNED_COSINE, _LONGEST_S = 0.02, 0.99985, 1.0
_SEARCHED = 250  # sightings of a colour, when a first mounting is looked for
_PITCHES_RAD, _YAWS_RAD = np.radians(np.arange(-40.0, 41.0, 5.0)), np.radians(np.arange(-15.0, 16.0, 7.5))
_ANGLE_COST = 0.05  # of a radian, as a share of the sightings


@dataclass(frozen=True, slots=True)
class Values:
    """What is known of a mounting before; as standard deviations, how exactly it is known after.

    Attributes:
        angles_frd_rad: roll, pitch and yaw on the body.
        position_flu_m: of the camera from the drone's centre.
        delay_s: by which images are older than their times.
    """

    angles_frd_rad: Vec3
    position_flu_m: Vec3
    delay_s: float


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """Gates in images, n of them.

    Attributes:
        colours: of the gates, shape (n,).
        corners_px: right of and below the optical axis, upper left, upper right, lower right, lower left as
            seen; NaN where one is not seen, shape (n, 4, 2).
        std_px: standard deviations, likewise.
        corners_s: when the row of each corner was read, seconds of the motion, shape (n, 4).
        positions_flu_m: of the gates' centres from the camera, forward, left, up, shape (n, 3).
        normals_flu: of the gates, by the better and the other pose; NaN if there is none, shape (n, 2, 3).
        half_m: half the outer widths and heights of the gates, shape (n, 2).
    """

    colours: npt.NDArray[np.str_]
    corners_px: Floats
    std_px: Floats
    corners_s: Floats
    positions_flu_m: Floats
    normals_flu: Floats
    half_m: Floats

    def __len__(self) -> int:
        return len(self.colours)

    @property
    def times_s(self) -> Floats:
        """Of each sighting, its corners' mean."""
        mean: Floats = self.corners_s.mean(axis=1)
        return mean

    def at(self, index: Indices) -> Sightings:
        """Some of them."""
        return Sightings(
            self.colours[index],
            self.corners_px[index],
            self.std_px[index],
            self.corners_s[index],
            self.positions_flu_m[index],
            self.normals_flu[index],
            self.half_m[index],
        )


def sightings_of(
    images: Sequence[Detections],
    motion: PoseSpline,
    half_height_px: float,
    readout_s: float,
    delay_s: float = 0.0,
    *,
    shapes: GateShapes | None = None,
) -> Sightings:
    """The gates in images that differ and at whose times the drone's pose is known.

    Args:
        images: with their vehicle times.
        motion: of the drone.
        half_height_px: from the image's middle to its upper and lower edges.
        readout_s: of a rolling shutter, from the first to the last row; an image's time is the middle.
        delay_s: by which images are about older than their times.
        shapes: of the gates of each colour; None: all have that of the frame challenge.
    """
    known = shapes or GateShapes()
    timed = sorted(
        (image for image in images if image.time_us is not None), key=lambda each: each.time_us or 0
    )
    useful = [(image, gates) for image in timed if (gates := _useful(image))]
    times_s = motion.seconds([image.time_us or 0 for image, _ in useful])
    kept = _differing(times_s, motion, delay_s)
    pairs = [(times_s[place], gate) for place in kept for gate in useful[place][1]]
    if len(pairs) > MAX_SIGHTINGS:
        pairs = [pairs[place] for place in np.linspace(0, len(pairs) - 1, MAX_SIGHTINGS).astype(int)]
    count = len(pairs)
    corners, std = np.full((count, 4, 2), np.nan), np.full((count, 4, 2), np.nan)
    places, normals = np.empty((count, 3)), np.full((count, 2, 3), np.nan)
    for row, (_, gate) in enumerate(pairs):
        for place, corner in enumerate(gate.corners):
            if corner is not None:
                corners[row, place] = corner.right_px, corner.down_px
                std[row, place] = corner.std_right_px, corner.std_down_px
        places[row] = gate.poses[0].position_flu_m
        for place, pose in enumerate(gate.poses[:2]):
            normals[row, place] = pose.normal_flu
    share = np.clip(np.nan_to_num(corners[:, :, 1]) / (2.0 * half_height_px), -0.5, 0.5)
    read_s = np.array([time_s for time_s, _ in pairs]).reshape(-1, 1) + readout_s * share
    colours = np.array([gate.colour for _, gate in pairs], dtype=np.str_)
    half_m = np.array([known.of(gate.colour).half_m for _, gate in pairs]).reshape(-1, 2)
    return Sightings(colours, corners, std, read_s, places, normals, half_m)


def _useful(image: Detections) -> list[GateSighting]:
    return [
        gate
        for gate in image.frames
        if gate.poses and sum(corner is not None for corner in gate.corners) >= _MIN_CORNERS
    ]


def _differing(times_s: Floats, motion: PoseSpline, delay_s: float) -> list[int]:
    """Which images differ from the last one used: the drone has moved or turned, or a second has passed."""
    known = np.flatnonzero(motion.is_known(times_s - delay_s - 0.1) & motion.is_known(times_s))
    at = times_s[known] - delay_s
    positions, rotations = motion.positions(at), motion.rotations(at)
    kept: list[int] = []
    last = -1
    for place in range(len(known)):
        if last >= 0:
            moved_m = float(np.linalg.norm(positions[place] - positions[last]))
            cosine = (float(np.einsum("ij,ij->", rotations[place], rotations[last])) - 1.0) / 2.0
            waited_s = at[place] - at[last]
            if moved_m < _MOVED_M and cosine > _TURNED_COSINE and waited_s < _LONGEST_S:
                continue
        last = place
        kept.append(int(known[place]))
    return kept


def _world_places(seen: Sightings, motion: PoseSpline, by: Values) -> Floats:
    """Where sightings put their gates, by a mounting, shape (n, 3)."""
    times_s = seen.times_s - by.delay_s
    turn = mounting_matrix(by.angles_frd_rad)
    from_centre = np.array(by.position_flu_m) + seen.positions_flu_m @ turn.T
    places: Floats = motion.positions(times_s) + np.einsum(
        "nij,nj->ni", motion.rotations(times_s), from_centre
    )
    return places


def first_mounting(seen: Sightings, motion: PoseSpline, known: Values) -> Values:
    """A mounting, its angles in steps of some degrees, with which gates are spread the least."""
    few = [np.flatnonzero(seen.colours == colour) for colour in np.unique(seen.colours)]
    few = [index[np.linspace(0, len(index) - 1, min(len(index), _SEARCHED)).astype(int)] for index in few]
    best, best_score = known, -np.inf
    for pitch in _PITCHES_RAD.tolist():
        for yaw in _YAWS_RAD.tolist():
            at = replace(known, angles_frd_rad=(0.0, pitch, yaw))
            together = 0.0
            for index in few:
                places = _world_places(seen.at(index), motion, at)
                together += _neighbours(places, _SAME_PLACE_M).max() / len(seen)
            score = together - _ANGLE_COST * float(np.hypot(pitch, yaw))
            if score > best_score:
                best, best_score = at, score
    return best


def gates_among(seen: Sightings, usable: Bools, motion: PoseSpline, by: Values) -> tuple[Indices, list[Vec3]]:
    """Which gate each usable sighting is of.

    Returns:
        The number of its gate for each sighting, -1 if it is of none; where the gates are.
    """
    places = _world_places(seen, motion, by)
    numbers = np.full(len(seen), -1, np.intp)
    found: list[Vec3] = []
    for colour in np.unique(seen.colours):
        free = np.flatnonzero((seen.colours == colour) & usable)
        while len(free) >= MIN_OF_A_GATE and len(found) < _MAX_GATES:
            centre = places[free[_neighbours(places[free], _SAME_PLACE_M).argmax()]]
            for _ in range(3):
                near = np.linalg.norm(places[free] - centre, axis=1) < _SAME_PLACE_M
                if near.any():
                    centre = np.median(places[free[near]], axis=0)
            if np.count_nonzero(near) < MIN_OF_A_GATE:
                break
            numbers[free[near]] = len(found)
            found.append((float(centre[0]), float(centre[1]), float(centre[2])))
            apart = np.linalg.norm(places[free] - centre, axis=1) > 2.0 * _SAME_PLACE_M
            free = free[apart]
    return numbers, found


def _neighbours(places: Floats, within_m: float) -> Indices:
    """How many places are near each."""
    squares = np.einsum("ij,ij->i", places, places)
    away2 = squares[:, None] + squares[None] - 2.0 * places @ places.T
    near: Bools = away2 < within_m**2
    counts: Indices = near.sum(axis=1)
    return counts


def first_yaw(seen: Sightings, motion: PoseSpline, by: Values) -> float:
    """The yaw of a gate's normal, up to half a turn, that most of its sightings allow, radians."""
    turn = mounting_matrix(by.angles_frd_rad)
    body = seen.normals_flu @ turn.T
    normals = np.einsum("nij,nkj->nki", motion.rotations(seen.times_s - by.delay_s), body)
    yaws = np.arctan2(normals[..., 1], normals[..., 0])
    candidates = np.linspace(0.0, np.pi, 45, endpoint=False)
    away = np.abs(np.sin(yaws[None] - candidates[:, None, None]))
    costs = np.minimum(np.nanmin(away, axis=2), 0.3).sum(axis=1)
    return float(candidates[costs.argmin()])
