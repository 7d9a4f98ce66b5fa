"""One hypothesis of where a frame is: an extended Kalman filter that measures the corners of its outline."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, log, log1p, pi, tau
from typing import TYPE_CHECKING

import numpy as np

from offboard.navigation.frames.frame_measurement import Floats, Solution, View, noise_of, predicted

if TYPE_CHECKING:
    from filterpy.kalman import ExtendedKalmanFilter

# A frame does not move, but the drone's position may drift against it.
DRIFT_STD_M = 0.004  # after a second
DRIFT_STD_RAD = 0.003

# With each view the earlier ones count less: errors of images are not quite independent, and the first views,
# from far away, were linearised at the worst places (fading memory filter; Simon, "Optimal State Estimation",
# 2006).
FADING = 1.05

_DRIFT = np.diag((DRIFT_STD_M**2, DRIFT_STD_M**2, DRIFT_STD_M**2, DRIFT_STD_RAD**2))
_LINEARISATIONS = 4
_MOVED = np.array((0.02, 0.02, 0.02, 0.03))  # metres and radians: linearise anew if the state moved more


@dataclass(frozen=True, slots=True, eq=False)
class Update:
    """What a view would make of a filter.

    Attributes:
        state: x, y, z (metres), yaw (radians).
        covariance: shape (4, 4).
        distance2: square of the innovation's Mahalanobis distance.
        log_likelihood: of the view, before it was used.
    """

    state: Floats
    covariance: Floats
    distance2: float
    log_likelihood: float


class FrameFilter:
    """An extended Kalman filter of one frame's state.

    The measurement is far from linear while a frame is known badly, so it is linearised where the update
    leads, not where it begins (iterated extended Kalman filter; Bell & Cathey, 1993).

    Attributes:
        log_weight: logarithm of the likelihood of all views so far, for comparison with other hypotheses.
    """

    def __init__(self, solution: Solution) -> None:
        self._ekf = _new_filter()
        self._ekf.x, self._ekf.P = solution.state, solution.covariance
        self.log_weight = solution.log_weight

    @property
    def state(self) -> Floats:
        """x, y, z (metres), yaw (radians, any turn)."""
        state: Floats = self._ekf.x
        return state

    @property
    def covariance(self) -> Floats:
        """Of the state, shape (4, 4)."""
        covariance: Floats = self._ekf.P
        return covariance

    def predict(self, elapsed_s: float) -> None:
        """Let time pass."""
        self._ekf.Q = elapsed_s * _DRIFT
        self._ekf.predict()

    def trial(self, view: View) -> Update | None:
        """What a view would make of the filter, which stays as it is; None if it cannot be seen so."""
        ekf = self._ekf
        before, covariance = ekf.x, ekf.P
        at, update = before, None
        # The linear part of a function of the yaw leaves out the square, as does that of a cosine near zero:
        # a frame seen from before would seem to tell its yaw (second-order filter; Athans et al., 1968).
        unknown = 0.5 * float(covariance[3, 3]) ** 2
        for _ in range(_LINEARISATIONS):
            prediction = predicted(at, view)
            if prediction is None:
                break
            corners, jacobian, curvature = prediction
            expected = corners + jacobian @ (before - at)
            ekf.update(
                view.corners_px,
                lambda _, jacobian=jacobian: jacobian,
                lambda _, expected=expected: expected,
                noise_of(view, jacobian) + unknown * np.outer(curvature, curvature),
            )
            moved, at = ekf.x - at, ekf.x
            distance2 = float(ekf.y @ ekf.SI @ ekf.y)
            spread = log(float(np.linalg.det(tau * ekf.S)))
            update = Update(ekf.x, ekf.P, distance2, -0.5 * (distance2 + spread))
            ekf.x, ekf.P = before, covariance
            if (abs(moved) < _MOVED).all():
                break
        return update

    def absorb(self, other: FrameFilter) -> None:
        """Become one with a hypothesis of nearly the same state: mean and covariance of both."""
        share = 1.0 / (1.0 + exp(min(50.0, self.log_weight - other.log_weight)))
        away = other.state - self.state
        away[3] = half_turn(float(away[3]))
        ekf = self._ekf
        ekf.x = ekf.x + share * away
        ekf.P = (
            (1.0 - share) * ekf.P + share * other.covariance + share * (1.0 - share) * np.outer(away, away)
        )
        self.log_weight += log1p(exp(other.log_weight - self.log_weight))

    def accept(self, update: Update) -> None:
        """Use a view."""
        self._ekf.x, self._ekf.P = update.state, FADING * update.covariance
        self.log_weight += update.log_likelihood


def load_filters() -> None:
    """Import filterpy, which takes half a second: before a flight, and only if it has a map."""
    _new_filter()


def _new_filter() -> ExtendedKalmanFilter:
    from filterpy.kalman import ExtendedKalmanFilter  # noqa: PLC0415 - see `load_filters`

    return ExtendedKalmanFilter(dim_x=4, dim_z=8)


def half_turn(yaw_rad: float) -> float:
    """The heading of a frame's normal in -pi/2..pi/2: half a turn leaves a frame as it is."""
    return (yaw_rad + pi / 2) % pi - pi / 2
