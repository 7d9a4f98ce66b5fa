"""Where in an image the base may be: views of the camera that agree with the image's gradients, roughly.

The image's gradients are sorted by direction and spread over the pixels around them, so that an outline a few
pixels beside the right one still lies on them, and one look-up says so (S. Hinterstoisser and others,
"Gradient response maps for real-time detection of textureless objects", IEEE PAMI 34, 2012). Colours count:
the gradient is that of all three channels (S. Di Zenzo, "A note on the gradient of a multi-image", 1986).
"""

from __future__ import annotations

from math import atan2, ceil, hypot, pi
from typing import Final

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.geometry.rotations import rotation
from vision.base.model import MARK, NEAREST_M, BaseCamera, CameraView, Floats, projected
from vision.types import BaseExpectation, Image

STEPS_PX: Final = (9.0, 4.0)
"""How far apart the outlines are that are tried, first everywhere, then around the best."""
KEPT: Final = 3
"""How many views are given back."""
_KEPT_BETWEEN: Final = 4
_DEVIATIONS: Final = 3.0
_BINS: Final = 8
_WEAK_SHARE: Final = 0.1  # of the strongest gradient: weaker ones do not count
_SCALE: Final = 0.5  # of the image in which gradients are looked up
_OTHERWISE_RAD: Final = 0.04
_SHARES = (np.arange(3) + 0.5) / 3
_BY_CHANCE: Final = 0.35
_MOST_VIEWS: Final = 4000
_NEAREST_AWAY_M: Final = 0.5


def search(
    image: Image, camera: BaseCamera, expected: BaseExpectation, least: float
) -> list[tuple[CameraView, Floats]]:
    """The likeliest views, best first, each with its change from the expected one.

    Args:
        image: BGR, shape (height, width, 3), uint8.
        camera: and the base.
        expected: about where the camera is.
        least: change of colour between neighbours but one that counts, of 255.

    Returns:
        Views, and their changes as `CameraView.moved` takes them.
    """
    steps = _Steps(camera, expected)
    changes = np.zeros((1, 4))
    planes = None
    for level, step_px in enumerate(STEPS_PX):
        changes = steps.all_around(changes, step_px, whole=level == 0)
        if len(changes) == 1:
            continue
        if planes is None:
            small = cv2.resize(image, None, fx=_SCALE, fy=_SCALE, interpolation=cv2.INTER_AREA)
            planes = _directions(np.asarray(small, np.uint8), least)
        spread = _spread(planes, step_px)
        scores = _scores(spread, camera, *steps.views(changes))
        changes = changes[np.argsort(-scores, kind="stable")]
        changes = changes[:_KEPT_BETWEEN] if level == 0 else _turned_otherwise(changes)
    eyes, turns, moves = *steps.views(changes), steps.moves(changes)
    return [(CameraView(e, t), m) for e, t, m in zip(eyes, turns, moves, strict=True)]


def _turned_otherwise(changes: Floats) -> Floats:
    """The first of some changes, and the first ones that differ from it and each other in heading."""
    kept: list[Floats] = []
    for change in changes:
        if all(abs(change[2] - other[2]) > _OTHERWISE_RAD for other in kept):
            kept.append(change)
            if len(kept) == KEPT:
                break
    return np.array(kept)


class _Steps:
    """Changes of a view: of bearing (rad), logarithm of distance, heading (rad) and height (m)."""

    def __init__(self, camera: BaseCamera, expected: BaseExpectation) -> None:
        focal_px, half_m = camera.focal_px, camera.shape.edge_m / 2
        self.eye = np.array(expected.eye_m)
        self.turn = np.array(rotation(expected.attitude)).reshape(3, 3)
        x, y, z = expected.eye_m
        self._bearing, self._away = atan2(-y, -x), hypot(x, y)
        away = max(self._away, _NEAREST_AWAY_M)
        height = max(abs(z - camera.shape.top_m / 2), half_m)
        self._per_px = np.array([1.0, away / height, away / half_m, away]) / focal_px
        std_x, std_y, std_z = expected.eye_std_m
        std_m = max(std_x, std_y)
        std = expected.heading_std_rad
        self._reach = _DEVIATIONS * np.array([hypot(std, std_m / away), std_m / away, std, std_z])
        self._reach[2] = min(self._reach[2], pi / 4)
        self._between = np.zeros(4)
        self._stds = np.array([std_x, std_y, std_z, std])

    def all_around(self, changes: Floats, step_px: float, *, whole: bool) -> Floats:
        """Changes on a grid around others: over all that is possible, or within half a coarser step."""
        step = self._per_px * step_px
        step[1:3] = np.minimum(step[1:3], (0.25, 0.35))
        reach = self._reach if whole else np.minimum(self._reach, self._between)
        for _ in range(8):
            counts = 1.0 + 2.0 * np.maximum(np.ceil(reach / step - 0.5), 0.0)
            if len(changes) * float(np.prod(counts)) <= _MOST_VIEWS:
                break
            step = step * 1.2
        if whole:
            self._between = 0.5 * step
        axes = []
        for each, far in zip(step, reach, strict=True):
            count = ceil(far / each - 0.5) if far > 0.5 * each else 0
            axes.append(each * np.arange(-count, count + 1))
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 4)
        tried = (changes[:, None] + grid).reshape(-1, 4)
        moves = self.moves(tried)
        off = moves[:, [0, 1, 2, 5]] / self._stds
        near = (off * off).sum(axis=1) <= (_DEVIATIONS + 0.5) ** 2
        near[len(tried) // 2] = True
        kept: Floats = tried[near]
        return kept

    def moves(self, changes: Floats) -> Floats:
        """The same as changes of the view, shape (n, 6)."""
        eyes, _ = self.views(changes)
        nothing = np.zeros(len(changes))
        return np.column_stack([eyes - self.eye, nothing, nothing, changes[:, 2]])

    def views(self, changes: Floats) -> tuple[Floats, Floats]:
        """Positions and turns of the camera, shapes (n, 3) and (n, 3, 3)."""
        bearing, nearer, heading, up = changes.T
        away = self._away * np.exp(nearer)
        towards = self._bearing + bearing + heading
        eyes = np.stack([-away * np.cos(towards), -away * np.sin(towards), self.eye[2] + up], axis=-1)
        c, s = np.cos(heading), np.sin(heading)
        zero, one = np.zeros_like(c), np.ones_like(c)
        turns = np.stack([c, -s, zero, s, c, zero, zero, zero, one], axis=-1).reshape(-1, 3, 3)
        return eyes, turns @ self.turn


Planes = npt.NDArray[np.uint8]


def _directions(image: Image, least: float) -> Planes:
    """For each pixel 1 at the direction of its gradient and the two beside it, shape (height, width, 8)."""
    dx, dy = cv2.Sobel(image, cv2.CV_32F, 1, 0), cv2.Sobel(image, cv2.CV_32F, 0, 1)
    of_channels = np.ones((1, 3), np.float32)
    xx, yy, xy = (cv2.transform(cv2.multiply(a, b), of_channels) for a, b in ((dx, dx), (dy, dy), (dx, dy)))
    square = xx + yy
    # Sobel's filter weighs four pixels on either side. Beside strong edges, weak ones are a compression's.
    strong = np.flatnonzero(square > max((4.0 * least) ** 2, _WEAK_SHARE**2 * float(square.max())))
    angle = np.arctan2(2.0 * xy.ravel()[strong], (xx - yy).ravel()[strong])  # twice that of the gradient
    bins = np.floor(angle * (_BINS / (2.0 * pi))).astype(np.intp)
    planes = np.zeros((*image.shape[:2], _BINS), np.uint8)
    flat = planes.reshape(-1)
    for beside in (-1, 0, 1):
        flat[strong * _BINS + (bins + beside) % _BINS] = 1
    return planes


def _spread(planes: Planes, step_px: float) -> Planes:
    """The same for all pixels around."""
    size = 2 * ceil(_SCALE * step_px / 2) + 1
    wide: Planes = cv2.dilate(planes, np.ones((size, size), np.uint8))
    return wide


def _scores(planes: Planes, camera: BaseCamera, eyes: Floats, turns: Floats) -> Floats:
    """How well the outlines seen from each view agree with the gradients, shape (n,)."""
    height, width = planes.shape[:2]
    shape = camera.shape
    in_camera = (shape.points_m - eyes[:, None]) @ turns
    front = in_camera[..., 0] > NEAREST_M
    in_camera[..., 0] = np.maximum(in_camera[..., 0], NEAREST_M)
    corners = projected(in_camera, camera.focal_px)
    faces = shape.faces_seen(eyes)
    one, other = shape.edges[:, 2], shape.edges[:, 3]
    seen = (faces[:, one] != faces[:, other]) | (faces[:, one] & (one == MARK))
    start, end = corners[:, shape.edges[:, 0]], corners[:, shape.edges[:, 1]]
    seen &= front[:, shape.edges[:, 0]] & front[:, shape.edges[:, 1]]
    along = end - start
    length = np.hypot(along[..., 0], along[..., 1])
    # Directions count as `_directions` counts them: twice the angle of the edge's normal.
    angle = 2.0 * np.arctan2(along[..., 0], -along[..., 1])
    bins = np.floor(angle * (_BINS / (2.0 * pi))).astype(np.intp) % _BINS
    at = start[..., None, :] + along[..., None, :] * _SHARES[:, None]
    if camera.lens is not None:
        at = camera.lens.all_seen(at)
    column = np.rint(_SCALE * at[..., 0] + (width - 1) / 2)
    row = np.rint(_SCALE * at[..., 1] + (height - 1) / 2)
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height) & seen[..., None]
    index = np.where(inside, (row * width + column) * _BINS + bins[..., None], 0).astype(np.intp)
    hit = planes.reshape(-1).take(index)
    weight = np.minimum(length, 40.0)[..., None] * inside
    total = weight.sum(axis=(1, 2))
    share = (weight * hit).sum(axis=(1, 2)) / np.maximum(total, 1e-9)
    scores: Floats = (share - _BY_CHANCE) * np.sqrt(total)
    return np.where(total > 20.0, scores, -1.0)
