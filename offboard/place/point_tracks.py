"""Followed points in the filter of the place: the drone's motion by what stands still around it.

A multi-state constraint Kalman filter (A. Mourikis, S. Roumeliotis, ICRA 2007): the filter keeps the drone's
place at the last images, and a point that several of them show ties these places to one another. The point
itself is not kept: its place is estimated of the same images, and eliminated (here by the Schur complement,
which is what their projection onto the null space gives). A point that may be on the floor has its height.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from offboard.navigation.camera_model import NEAREST_M
from offboard.place.measurements import Eye
from offboard.place.place_filter import POSE, Floats, PlaceFilter
from vision.types import PointTracks

Bools = npt.NDArray[np.bool_]

LEAST_IMAGES = 3  # that show a point
MOST_IMAGES = 8  # after which a point is used, and begins anew
SPREAD = 3  # numbers of images by which this differs from point to point: not all are used at once
STD_PX = 0.8  # of a point, with what its image's attitude is wrong by
FLOOR_STD_M = 0.02
DEPTH_M, DEPTH_STD_M = 5.0, 5.0  # of a point that may be anywhere
ANYWHERE_STD_M = 30.0  # across that
FARTHEST_M = 14.0  # of a point of the floor
ROUNDS = 4
GATE_SIGMA = 3.0
FLOOR_WORSE = 6.0  # by which a point of the floor may fit worse than one anywhere, squares of deviations


@dataclass(frozen=True, slots=True, eq=False)
class _Image:
    """What an image showed, in the axes of the reported heading.

    Attributes:
        rotation: from the camera's axes forward, left, up, shape (3, 3).
        offset_m: from the drone's centre at the time of the image to the camera then, shape (3,).
        moved_m: by how much the camera is elsewhere when the last row is read, shape (3,).
        seen: by a point's number, pixels as if the camera had not turned while it read the rows, and the
            share of the way to the last row, from the middle one on.
    """

    rotation: Floats
    offset_m: Floats
    moved_m: Floats
    seen: dict[int, tuple[float, float, float]]

    @classmethod
    def of(cls, tracks: PointTracks, first: Eye, middle: Eye, last: Eye) -> _Image:
        """An image, by where the camera's carrier is when some of its rows are read out."""
        rotations, places_m = zip(*(_camera(eye) for eye in (first, middle, last)), strict=True)
        rotation, model = rotations[1], middle.model
        pixels, shares = tracks.pixels, np.clip(tracks.rows_px / model.half_height_px, -1.0, 1.0)
        if model.readout_s > 0.0:
            rays = np.concatenate([np.ones((len(pixels), 1)), -pixels / model.focal_px], axis=1)
            turned = 0.5 * rotation.T @ (rotations[2] - rotations[0])  # by half the rows
            rays += shares[:, None] * (rays @ turned.T)
            pixels = -model.focal_px * rays[:, 1:] / rays[:, :1]
        seen = np.concatenate([pixels, shares[:, None]], axis=1).tolist()
        moved_m = 0.5 * (places_m[2] - places_m[0])
        return cls(
            rotation, places_m[1], moved_m, dict(zip(tracks.numbers.tolist(), map(tuple, seen), strict=True))
        )


def _camera(eye: Eye) -> tuple[Floats, Floats]:
    """Rotation and place of the camera of a carrier."""
    pose = eye.model.pose(eye.offset_m, eye.attitude)
    return np.array(pose.rotation).reshape(3, 3), np.array(pose.position_m)


class PointWindow:
    """The last images, and the points that they show.

    Args:
        focal_px: of the camera.
    """

    def __init__(self, focal_px: float) -> None:
        self._focal_px = focal_px
        self._images: dict[int, _Image] = {}  # by time, oldest first
        self._open: dict[int, list[int]] = {}  # times of the images that show a point and have not been used

    def see(self, place: PlaceFilter, tracks: PointTracks, first: Eye, middle: Eye, last: Eye) -> None:
        """Use an image, to whose time the filter was brought.

        Args:
            place: the filter.
            tracks: the points in it.
            first: carries the camera when the first row is read out.
            middle: likewise, the middle row.
            last: likewise, the last row.
        """
        time_us = place.time_us
        if time_us in self._images:
            return
        image = _Image.of(tracks, first, middle, last)
        due = []
        for number in [each for each in self._open if each not in image.seen]:
            times = self._open.pop(number)
            if len(times) >= LEAST_IMAGES:
                due.append((number, times))
        place.add_clone(time_us)
        self._images[time_us] = image
        for number in image.seen:
            times = self._open.setdefault(number, [])
            times.append(time_us)
            if len(times) >= MOST_IMAGES - number % SPREAD:
                due.append((number, times))
                del self._open[number]
        if due:
            self._use(place, due)
        needed = {each for times in self._open.values() for each in times}
        for old_us in [each for each in self._images if each not in needed]:
            del self._images[old_us]
            place.drop_clone(old_us)

    def forget(self, place: PlaceFilter) -> None:
        """Begin anew: what was seen before a gap is not known to belong together."""
        for old_us in self._images:
            place.drop_clone(old_us)
        self._images.clear()
        self._open.clear()

    def _use(self, place: PlaceFilter, due: list[tuple[int, list[int]]]) -> None:
        """Correct the place by points."""
        times = list(self._images)
        slot = {each: number for number, each in enumerate(times)}
        seen = np.zeros((len(due), len(times), 3))
        shown = np.zeros((len(due), len(times)))
        for row, (number, of_point) in enumerate(due):
            for each in of_point:
                seen[row, slot[each]] = self._images[each].seen[number]
                shown[row, slot[each]] = 1.0
        first = [place.clones[each] for each in times]
        index = (np.array(first)[:, None] + np.arange(POSE)).ravel()
        cameras = _Cameras.of(place.x[index].reshape(-1, POSE), list(self._images.values()), seen[:, :, 2])
        found = _fitted(cameras, seen[:, :, :2], shown / STD_PX**2, self._focal_px)
        covariance = place.p[np.ix_(index, index)]
        fits = found.fit(covariance, 2.0 * shown.sum(axis=1) - 3.0)
        if fits.any():
            place.inform(index, found.information[fits].sum(axis=0), found.vector[fits].sum(axis=0))


class _Cameras(NamedTuple):
    """The cameras of some images, in the arena, when n points are read out.

    Attributes:
        drone_m: the drone's centre at the times of the images, shape (m, 3).
        eye_m: the camera, shape (n, m, 3).
        rotation: from its axes forward, left, up, shape (m, 3, 3).
    """

    drone_m: Floats
    eye_m: Floats
    rotation: Floats

    @classmethod
    def of(cls, states: Floats, images: list[_Image], shares: Floats) -> _Cameras:
        """Where states, shape (m, 4), have them; shares of the way to the last row, shape (n, m)."""
        c, s = np.cos(states[:, 3]), np.sin(states[:, 3])
        turn = np.zeros((len(states), 3, 3))
        turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1], turn[:, 2, 2] = c, -s, s, c, 1.0
        offsets = np.array([image.offset_m for image in images])
        moved = np.array([image.moved_m for image in images])
        away = offsets + shares[:, :, None] * moved
        eyes = states[:, :3] + (turn @ away[:, :, :, None])[:, :, :, 0]
        return cls(states[:, :3], eyes, turn @ np.array([image.rotation for image in images]))


class _Points(NamedTuple):
    """Points, each fitted to the images that show it.

    Attributes:
        cost: what is left of the squares, in deviations, shape (n,).
        information: of the images' places, the point eliminated, shape (n, 4 m, 4 m).
        vector: likewise, of the residuals, shape (n, 4 m).
        usable: before all cameras that see it, shape (n,).
    """

    cost: Floats
    information: Floats
    vector: Floats
    usable: Floats

    def fit(self, covariance: Floats, freedom: Floats) -> Bools:
        """Which of them fit what was known before, shape (n,).

        The Mahalanobis distance follows from the information by the matrix inversion lemma.
        """
        usable = self.usable > 0.0
        information, vector = self.information[usable], self.vector[usable]
        gained = covariance @ vector[:, :, None]
        inner = np.linalg.solve(np.eye(len(covariance)) + covariance @ information, gained)
        distance2 = self.cost[usable] - (vector[:, None, :] @ inner)[:, 0, 0]
        usable[usable] = distance2 <= (freedom + GATE_SIGMA * np.sqrt(2.0 * freedom))[usable]
        return usable


def _fitted(cameras: _Cameras, pixels: Floats, weights: Floats, focal_px: float) -> _Points:
    """Fit points, as points of the floor where that is possible, else as points anywhere.

    Args:
        cameras: of m images.
        pixels: of n points, shape (n, m, 2).
        weights: inverse variances, shape (n, m); 0 where a point is not seen.
        focal_px: of the camera.
    """
    last = weights.shape[1] - 1 - np.argmax(weights[:, ::-1] > 0.0, axis=1)
    each = np.arange(len(pixels))
    rays = np.concatenate([np.ones((len(pixels), 1)), -pixels[each, last] / focal_px], axis=1)
    rays = (cameras.rotation[last] @ rays[:, :, None])[:, :, 0]
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    eyes = cameras.eye_m[each, last]
    down = np.where(rays[:, 2] < -1e-3, rays[:, 2], -1e-3)
    depth_m = -eyes[:, 2] / down
    may_be_floor = (rays[:, 2] < -1e-3) & (depth_m > 0.0) & (depth_m < FARTHEST_M)
    along = rays[:, :, None] * rays[:, None, :] / DEPTH_STD_M**2 + np.eye(3) / ANYWHERE_STD_M**2
    upright = np.diag((ANYWHERE_STD_M, ANYWHERE_STD_M, FLOOR_STD_M)) ** 2
    on_floor = eyes + np.clip(depth_m, NEAREST_M, FARTHEST_M)[:, None] * rays
    floor = _fit(
        cameras,
        pixels,
        weights,
        focal_px,
        start_m=on_floor,
        prior=np.broadcast_to(np.linalg.inv(upright), along.shape),
    )
    free = _fit(cameras, pixels, weights, focal_px, start_m=eyes + DEPTH_M * rays, prior=along)
    is_floor = may_be_floor & (floor.usable > 0.0)
    is_floor &= (free.usable == 0.0) | (floor.cost <= free.cost + FLOOR_WORSE)
    return _Points(
        *(np.where(is_floor.reshape(-1, *[1] * (a.ndim - 1)), a, b) for a, b in zip(floor, free, strict=True))
    )


def _fit(
    cameras: _Cameras, pixels: Floats, weights: Floats, focal_px: float, *, start_m: Floats, prior: Floats
) -> _Points:
    """Fit points by Gauss-Newton.

    Args:
        cameras: of m images.
        pixels: of n points, shape (n, m, 2).
        weights: inverse variances, shape (n, m).
        focal_px: of the camera.
        start_m: where points may be, shape (n, 3).
        prior: information of that, shape (n, 3, 3).
    """
    place = start_m
    to_camera = cameras.rotation.transpose(0, 2, 1)
    for round_ in range(ROUNDS + 1):
        away = place[:, None] - cameras.eye_m
        seen = (to_camera @ away[:, :, :, None])[:, :, :, 0]
        ahead = np.maximum(seen[:, :, 0], NEAREST_M)
        expected = -focal_px * seen[:, :, 1:] / ahead[:, :, None]
        residual = pixels - expected
        by_axes = np.zeros((*weights.shape, 2, 3))
        by_axes[:, :, :, 0] = -expected
        by_axes[:, :, 0, 1] = by_axes[:, :, 1, 2] = -focal_px
        by_point = (by_axes / ahead[:, :, None, None]) @ to_camera
        weighted = by_point * weights[:, :, None, None]
        inner = np.einsum("nmij,nmik->njk", weighted, by_point) + prior
        vector = np.einsum("nmij,nmi->nj", weighted, residual)
        moved = start_m - place
        vector += (prior @ moved[:, :, None])[:, :, 0]
        if round_ < ROUNDS:
            place = place + np.linalg.solve(inner, vector[:, :, None])[:, :, 0]
    cost = (weights[:, :, None] * residual**2).sum(axis=(1, 2))
    cost += (moved[:, None, :] @ prior @ moved[:, :, None])[:, 0, 0]
    usable = ((seen[:, :, 0] > NEAREST_M) | (weights == 0.0)).all(axis=1)
    x, y = place[:, None, 0] - cameras.drone_m[:, 0], place[:, None, 1] - cameras.drone_m[:, 1]
    by_state = np.concatenate(
        [-by_point, (by_point[..., 0] * y[..., None] - by_point[..., 1] * x[..., None])[..., None]], axis=3
    )
    count, images = weights.shape
    weighted_state = by_state * weights[:, :, None, None]
    own = np.einsum("nmij,nmik->nmjk", weighted_state, by_state)
    across = np.einsum("nmij,nmik->nmjk", weighted_state, by_point).reshape(count, -1, 3)
    information = -across @ np.linalg.solve(inner, across.transpose(0, 2, 1))
    blocks = information.reshape(count, images, 4, images, 4)
    slots = np.arange(images)
    blocks[:, slots, :, slots] += own.transpose(1, 0, 2, 3)
    by_residual = np.einsum("nmij,nmi->nmj", weighted_state, residual).reshape(count, -1)
    by_residual -= (across @ np.linalg.solve(inner, vector[:, :, None]))[:, :, 0]
    return _Points(cost, information, by_residual, usable.astype(float))
