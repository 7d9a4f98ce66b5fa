"""Find the base in an image, near where it is expected: its corners with their covariance."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import Final

import numpy as np

from framerunner.geometry.rotations import rotation
from vision.base.edges import EdgeMeasurements, EdgePlaces, Pixels, measured, noise_of, places_on, steepest
from vision.base.model import (
    BACKGROUND,
    MARK,
    NEAREST_M,
    BaseCamera,
    BaseShape,
    CameraView,
    Flags,
    Floats,
    SeenEdges,
    projected,
    seen_edges,
    turned,
)
from vision.base.search import search
from vision.calibration.lens import Lens
from vision.types import BaseExpectation, BaseSighting, Image

LEAST_SCORE: Final = 0.7
"""A lower share of the outline is no sighting."""
_SURE_SCORE: Final = 0.9  # nothing better is looked for
_AT_ONCE_SCORE: Final = 0.75  # likewise of one that is where a precise expectation has it
_AT_ONCE_PX: Final = 12.0  # standard deviation of a precise expectation
_OTHER_TURNS_RAD: Final = (0.1, -0.1)
_BORDER_PX: Final = 2.0  # of the image, where no edge is measured
_SHORTEST_PX: Final = 4.0
_ROUGHLY_PX: Final = 4  # how far from an edge it is looked for first
_FINELY_PX: Final = (2.5, 1.2, 0.8, 0.8)  # how far off it counts when it is measured then
_SETTLED_PX: Final = 0.25  # a smaller change needs no measuring again
_ROUGH_STD_PX, _FINE_STD_PX = 0.5, 0.2
_FAR_OFF_PX: Final = 2.5  # from where it is expected an edge is not measured
_OFF_PX: Final = 1.0  # from the fitted cube, an edge is another one
_TILT_STD_RAD: Final = 0.01  # of the expected attitude, by gravity
_LEAST_CONTRAST: Final = 8.0  # of 255
_CONTRAST_OF_NOISE: Final = 4.0
_LEAST_OUTLINE_PX: Final = 30.0
_UPRIGHT_PX: Final = 8.0  # a longer upright edge of the outline must be seen
_LEAST_SHARE: Final = 0.5  # of the outline
_LEAST_EDGES: Final = 3
_WEAK_SHARE: Final = 0.6  # by which a place without contrast counts less than one with an edge elsewhere
_AGREED: Final = 0.75  # share of all edges seen that must be where the fitted cube has them
_ALIKE: Final = 0.4  # of the contrast: how much the colours of one face may differ
_FARTHEST: Final = 4.0  # standard deviations from what is expected
_UNKNOWN = np.array([1e3, 1e3, 1e3, 0.03, 0.03, 1e3])
"""Standard deviations of the view before an image: only the tilt is known at all."""
_LINEAR_PX: Final = 0.05  # standard deviation of each corner beside that of the cube's place


@dataclass(frozen=True, slots=True, eq=False)
class _FittedCube:
    """The cube as fitted: how it is seen, and where its edges are beside that."""

    view: CameraView
    change: Floats  # from the expected view, as `CameraView.moved` takes it
    edges: SeenEdges
    measurements: EdgeMeasurements
    good: Flags  # where an edge is measured where the fitted cube has it, shape (k, m)
    step: Floats  # the change of the view that the edges alone ask for, shape (6,)
    covariance: Floats  # of that, shape (6, 6)


class BaseFinder:
    """Finds a base of known size.

    Args:
        shape: of the base.
        focal_px: focal length of the camera; its optical axis is in the middle of the image.
        lens: of a camera that is not ideal; it has the same focal length. What is found is then in pixels of
            an ideal camera.
    """

    def __init__(self, shape: BaseShape, focal_px: float, lens: Lens | None = None) -> None:
        self._camera = BaseCamera(shape, focal_px, lens)

    def find(self, image: Image, expected: BaseExpectation) -> BaseSighting | None:
        """Find the base where it is expected.

        Args:
            image: BGR, shape (height, width, 3), uint8.
            expected: where the camera may be.

        Returns:
            Its corners; None if it is not seen, or not surely the base.

        Raises:
            CalibrationError: the image has another size than those with which the camera was calibrated.
        """
        height, width = image.shape[:2]
        lens = self._camera.lens
        if lens is not None:
            lens.check_size(width, height)
        noise = max(noise_of(image), 1.0)
        least = max(_LEAST_CONTRAST, _CONTRAST_OF_NOISE * noise)
        std = np.array([*expected.eye_std_m, _TILT_STD_RAD, _TILT_STD_RAD, expected.heading_std_rad])
        half_px = (width / 2 - _BORDER_PX, height / 2 - _BORDER_PX)
        attempt = _Attempt(Pixels(image, lens), self._camera, half_px, std=std, noise=noise, least=least)
        away_m = max(hypot(*expected.eye_m), NEAREST_M)
        std_px = self._camera.focal_px * hypot(max(expected.eye_std_m) / away_m, expected.heading_std_rad)
        if std_px < _AT_ONCE_PX:
            turn = np.array(rotation(expected.attitude)).reshape(3, 3)
            fit = attempt.fit(CameraView(np.array(expected.eye_m), turn), np.zeros(6))
            score = 0.0 if fit is None else attempt.score(fit)
            if fit is not None and score >= _AT_ONCE_SCORE:
                return attempt.sighting(fit, score)
        best, best_score = None, LEAST_SCORE
        starts = search(image, self._camera, expected, least)
        while starts and best_score < _SURE_SCORE:
            fit = attempt.fit(*starts.pop(0))
            score = 0.0 if fit is None else attempt.score(fit)
            if fit is not None and score >= best_score:
                if best is None:  # a cube turned otherwise may look nearly the same
                    starts += [_turned_about_base(fit.view, fit.change, turn) for turn in _OTHER_TURNS_RAD]
                best, best_score = fit, score
        return None if best is None else attempt.sighting(best, best_score)


@dataclass(frozen=True, slots=True, eq=False)
class _Attempt:
    """One image, and what is expected of it."""

    pixels: Pixels
    camera: BaseCamera
    half_px: tuple[float, float]
    std: Floats  # of the expected view: position, tilt about x and y, heading
    noise: float
    least: float  # contrast that counts

    def fit(self, view: CameraView, change: Floats) -> _FittedCube | None:
        """Fit the cube to the edges in the image; None if none are to be seen.

        Args:
            view: to begin with.
            change: of this view from the expected one.
        """
        edges = self._edges(view)
        if edges is None:
            return None
        places = places_on(edges, view, self.camera.focal_px)
        off, found = steepest(self.pixels, edges, places, _ROUGHLY_PX, self.least)
        jacobian = _jacobian(edges, places, view, self.camera.focal_px)
        weights = found / _ROUGH_STD_PX**2
        moved = self._step(jacobian, off, weights, cut_px=1.5 * _ROUGHLY_PX, change=change)
        change, view = change + moved, view.moved(moved)
        for cut_px in _FINELY_PX:
            edges = self._edges(view)
            if edges is None or not np.isfinite(view.eye_m).all():
                return None
            places = places_on(edges, view, self.camera.focal_px)
            seen = measured(self.pixels, edges, places, self.noise)
            jacobian = _jacobian(edges, places, view, self.camera.focal_px)
            weights = self._is_seen(seen, seen.off_px, _FAR_OFF_PX) / (_FINE_STD_PX**2 + seen.common_px**2)
            moved = self._step(jacobian, seen.off_px, weights, cut_px=cut_px, change=change)
            across = jacobian @ moved
            change, view = change + moved, view.moved(moved)
            if float(np.abs(across).max()) < _SETTLED_PX:
                break
        assert edges is not None, "it was measured"
        left = seen.off_px - across
        good = self._is_seen(seen, left, _OFF_PX)
        # What is common to an edge does not become less with the number of its places.
        variance = seen.noise_px**2 + good.sum(axis=1, keepdims=True) * seen.common_px**2
        weights = (good / variance * _tukey(left, _OFF_PX)).ravel()
        flat = jacobian.reshape(-1, 6)
        covariance = np.linalg.inv(flat.T * weights @ flat + np.diag(_UNKNOWN**-2.0))
        step = covariance @ (flat.T * weights @ left.ravel())
        return _FittedCube(view, change, edges, seen, good, step, covariance)

    def _step(
        self, jacobian: Floats, off_px: Floats, weights: Floats, *, cut_px: float, change: Floats
    ) -> Floats:
        """The change of the view that brings edges to where they are seen, shape (6,).

        Gauss and Newton's step; what is expected counts as one more measurement, and what is farther off than
        `cut_px` does not count.
        """
        expected = self.std**-2.0
        jacobian, off_px, first = jacobian.reshape(-1, 6), off_px.ravel(), weights.ravel()
        weights = first
        for _ in range(3):
            normal = jacobian.T * weights @ jacobian + np.diag(expected)
            step = np.asarray(np.linalg.solve(normal, jacobian.T * weights @ off_px - expected * change))
            weights = first * _tukey(off_px - jacobian @ step, cut_px)
        return step

    def _edges(self, view: CameraView) -> SeenEdges | None:
        return seen_edges(self.camera.shape, view, self.camera.focal_px, self.half_px, _SHORTEST_PX)

    def _is_seen(self, seen: EdgeMeasurements, off_px: Floats, within_px: float) -> Flags:
        return seen.used & (seen.contrast >= self.least) & (np.abs(off_px) < within_px)

    def score(self, fit: _FittedCube) -> float:
        """The share of the outline that is seen; 0 if what is seen cannot be the base."""
        if (fit.change**2 > _FARTHEST**2 * (self.std**2 + np.diag(fit.covariance))).any():
            return 0.0
        edges, seen = fit.edges, fit.measurements
        outline = edges.outer == BACKGROUND
        weak = seen.clear & (seen.contrast < self.least)  # there base and background look alike
        counts = seen.clear - _WEAK_SHARE * weak
        shares = (fit.good & seen.clear).sum(axis=1) / np.maximum(counts.sum(axis=1), 1e-9)
        clear_px = edges.length_px * counts.mean(axis=1)
        good_px = edges.length_px * fit.good.mean(axis=1)
        found = good_px > 0.5 * edges.length_px
        upright = self.camera.shape.is_upright(edges.number) & outline & (edges.length_px > _UPRIGHT_PX)
        visible = seen.used & seen.clear & (seen.contrast >= self.least)
        agreed = float((visible & fit.good).sum() / max(visible.sum(), 1))
        if (
            good_px[outline].sum() < max(_LEAST_OUTLINE_PX, _LEAST_SHARE * edges.length_px[outline].sum())
            or found.sum() < _LEAST_EDGES
            or (found & outline).sum() < 2
            or (upright & ~found & (weak.sum(axis=1) <= 0.5 * seen.clear.sum(axis=1))).any()
            or (upright.any() and not found[upright].any())
            or agreed < _AGREED
            or not self._is_plain(fit)
        ):
            return 0.0
        surely = outline | (edges.inner == MARK)
        return agreed * float((clear_px * shares)[surely].sum() / max(clear_px[surely].sum(), 1e-9))

    def _is_plain(self, fit: _FittedCube) -> bool:
        """Whether each face has one colour along its edges."""
        seen, edges = fit.measurements, fit.edges
        outline = fit.good & (edges.outer == BACKGROUND)[:, None]
        contrast = float(np.median(seen.contrast[outline]))
        limit = max(_ALIKE * contrast, 3.0 * self.noise, _LEAST_CONTRAST)
        for face in np.unique(edges.inner):
            inner = seen.inner[fit.good & seen.inner_clear & (edges.inner == face)[:, None]]
            outer = seen.outer[fit.good & seen.outer_clear & (edges.outer == face)[:, None]]
            colours = np.concatenate([inner, outer])
            if len(colours) >= 4:
                spread = np.percentile(colours, (20, 80), axis=0)
                if float((spread[1] - spread[0]).max()) > limit:
                    return False
        return True

    def sighting(self, fit: _FittedCube, score: float) -> BaseSighting:
        """The corners of the fitted cube, without what was expected of its place."""
        ends = np.unique(self.camera.shape.edges[fit.edges.number, :2])
        points_m = self.camera.shape.points_m[ends]
        away = points_m - fit.view.eye_m
        in_camera = away @ fit.view.turn
        front = in_camera[:, 0] > 2.0 * NEAREST_M
        points_m, away, in_camera = points_m[front], away[front], in_camera[front]
        axes = (np.array((1.0, 0.0)), np.array((0.0, 1.0)))  # right and down
        focal_px = self.camera.focal_px
        moves = np.stack([_change_across(away, in_camera, a, fit.view, focal_px) for a in axes], axis=1)
        pixels = projected(in_camera, self.camera.focal_px) + moves @ fit.step
        moves = moves.reshape(-1, 6)
        of_corners = moves @ fit.covariance @ moves.T + _LINEAR_PX**2 * np.eye(len(moves))
        return BaseSighting(points_m, pixels, of_corners, score)


def _turned_about_base(view: CameraView, change: Floats, turn_rad: float) -> tuple[CameraView, Floats]:
    """A view of the base when that is turned about its upright axis, and its change from the expected one."""
    turn = turned(np.array([0.0, 0.0, turn_rad]))
    moved = np.array([*(turn @ view.eye_m - view.eye_m), 0.0, 0.0, turn_rad])
    return CameraView(view.eye_m + moved[:3], turn @ view.turn), change + moved


def _tukey(off_px: Floats, cut_px: float) -> Floats:
    """Weights that fall to zero (J. Tukey's biweight)."""
    share = off_px / cut_px
    weights: Floats = np.maximum(1.0 - share * share, 0.0) ** 2
    return weights


def _jacobian(edges: SeenEdges, places: EdgePlaces, view: CameraView, focal_px: float) -> Floats:
    """How places on edges move outwards when the view changes, shape (k, m, 6)."""
    away = places.points_m - view.eye_m
    return _change_across(away, away @ view.turn, edges.normal[:, None], view, focal_px)


def _change_across(
    away_m: Floats, in_camera_m: Floats, axis: Floats, view: CameraView, focal_px: float
) -> Floats:
    """How the images of points move along an axis of the image when the view changes.

    Args:
        away_m: from the camera to the points, in the base's axes, shape (..., 3).
        in_camera_m: the same in the camera's axes.
        axis: unit vectors right and down, shape (..., 2).
        view: of the camera.
        focal_px: its focal length.

    Returns:
        Pixels for each of the numbers of `CameraView.moved`, shape (..., 6).
    """
    ahead, left, up = in_camera_m[..., 0], in_camera_m[..., 1], in_camera_m[..., 2]
    right_axis, down_axis = axis[..., 0], axis[..., 1]
    per_depth = focal_px / ahead
    gradient = np.empty((*ahead.shape, 3))
    gradient[..., 0] = per_depth * (right_axis * left + down_axis * up) / ahead
    gradient[..., 1] = -per_depth * right_axis
    gradient[..., 2] = -per_depth * down_axis
    in_base = gradient @ view.turn.T
    x, y, z = away_m[..., 0], away_m[..., 1], away_m[..., 2]
    gx, gy, gz = in_base[..., 0], in_base[..., 1], in_base[..., 2]
    changes = np.empty((*ahead.shape, 6))
    changes[..., :3] = -in_base
    changes[..., 3] = z * gy - y * gz
    changes[..., 4] = x * gz - z * gx
    changes[..., 5] = y * gx - x * gy
    return changes
