"""One gate in the map: its hypotheses, how much it is believed, and whether the images contradict it.

A hypothesis of where the gate is is an extended Kalman filter that measures the corners of its outline.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, dist, exp, hypot, log, log1p, pi, sin, sqrt, tau
from typing import TYPE_CHECKING

import numpy as np

from framerunner.geometry.gate_shape import GateShape
from framerunner.geometry.vectors import Vec3
from offboard.navigation.camera_model import NEAREST_M
from offboard.navigation.gates.gate_measurement import (
    Floats,
    GateView,
    Prior,
    Solution,
    noise_of,
    predicted,
    solutions,
)
from offboard.navigation.planner.clearance import room_share
from offboard.navigation.view import GateEstimate
from scenarios.models import Arena

if TYPE_CHECKING:
    from filterpy.kalman import ExtendedKalmanFilter

# A gate does not move, but the drone's position may drift against it.
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


class GateFilter:
    """An extended Kalman filter of one gate's state.

    The measurement is far from linear while a gate is known badly, so it is linearised where the update
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

    def trial(self, view: GateView) -> Update | None:
        """What a view would make of the filter, which stays as it is; None if it cannot be seen so."""
        ekf = self._ekf
        before, covariance = ekf.x, ekf.P
        at, update = before, None
        # The linear part of a function of the yaw leaves out the square, as does that of a cosine near zero:
        # a gate seen from before would seem to tell its yaw (second-order filter; Athans et al., 1968).
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

    def absorb(self, other: GateFilter) -> None:
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
    """The heading of a gate's normal in -pi/2..pi/2: half a turn leaves a gate as it is."""
    return (yaw_rad + pi / 2) % pi - pi / 2


# Squares of innovations that one view in a thousand exceeds by chance (chi-squared), by number of corners,
# with half of it added: edges in an image have larger errors now and then.
CHI_SQUARED = (0.0, 20.7, 27.7, 33.7, 39.2)

NOVEL_PX = 0.5  # root mean square of the corners' shift from which on a view has errors of its own
NOVEL_US = 1_000_000  # or this long after the last one
OUTSIDE_M = 0.5  # a gate farther outside the arena is none
BEYOND_M = 0.05  # one that is by this, and by a standard deviation, is somewhere else

# Belief: an image that shows a gate adds this much, one that should and does not takes 1.
SEEN_BELIEF = 2
MOST_BELIEF = 30
TENTATIVE_BELIEF = 6  # a gate that is believed less is forgotten
TENTATIVE_US = 3_000_000  # if it is not seen for so long
DOUBTED_MISSES = 3  # in a row; then another gate of the colour is preferred

PREDICTED_S = 0.3  # a gate does not move, and drifts slowly

# After so many views in a row that contradict all hypotheses none is certain; after so many, and one more for
# so much belief, they are made anew.
MISFITS = 3
MISFITS_PER_BELIEF = 6
MISFITS_USED = 4

# Views that fit, but worse than those of a gate do (99 % of the means of three: 0.36 at most), are of a thing
# that is larger or smaller and elsewhere.
STRAINED = 0.5  # mean square of the last views' deviations, as a share of the largest that fits
STRAIN_WEIGHT = 1.0 / 3.0  # of the last view in that mean

# A larger or smaller thing elsewhere looks like a gate from one place: it takes a way of so large a share of
# the distance to see that it is none.
LEAST_PARALLAX = 0.15

PRUNED = 9.0  # natural logarithm of a ratio of likelihoods at which a hypothesis is dropped
AMBIGUOUS = 4.6  # at which it no longer counts
SAME_YAW_RAD = 0.06  # hypotheses nearer than this, or than half their standard deviation, are one
SAME_M = 0.1

# Certain: 95 % of the errors to the side and in height within 1.5 cm, of the yaw within 2 degrees. Along the
# normal, where a drone flies through anyway, twice as much is allowed; in a narrower opening less.
CERTAIN_M = 0.015 / 1.96
CERTAIN_RAD = 0.035 / 1.96
CERTAIN_VIEWS = 3


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """How a view fits a track.

    Attributes:
        updates: what the view would make of each hypothesis; None if it cannot be seen so.
        distance2: square of the smallest Mahalanobis distance.
        gate: the largest that belongs to the gate.
    """

    updates: tuple[Update | None, ...]
    distance2: float
    gate: float

    @property
    def inside(self) -> bool:
        """Whether the view can be of this gate."""
        return self.distance2 <= self.gate


class GateTrack:
    """A gate that has been seen.

    Attributes:
        colour: of the gate.
        shape: its sizes.
        belief: twice the images that showed it, minus those that should have; negative: there is none.
        missed: images in a row that should have shown it.
        time_us: vehicle time of the last prediction.
        seen_us: of the last image that showed it.
        views: how many were used.
    """

    def __init__(self, found: list[Solution], view: GateView) -> None:
        self.colour, self.shape = view.colour, view.shape
        self.belief, self.missed, self.views = SEEN_BELIEF, 0, 1
        self.time_us = self.seen_us = view.time_us
        self._hypotheses = [GateFilter(solution) for solution in found]
        self._used = view
        self._misfits: list[GateView] = []
        self._strain = found[0].cost / CHI_SQUARED[sum(view.seen)]
        self._first_eye_m, self._parallax = view.camera.position_m, 0.0
        self._prune()

    @property
    def state(self) -> Floats:
        """x, y, z (metres), yaw (radians) of the likeliest hypothesis."""
        return self._hypotheses[0].state

    @property
    def covariance(self) -> Floats:
        """Its covariance."""
        return self._hypotheses[0].covariance

    @property
    def is_doubted(self) -> bool:
        """Several images in a row should have shown it."""
        return self.missed >= DOUBTED_MISSES

    @property
    def rank(self) -> tuple[bool, bool, int, float]:
        """The larger, the better is it known: to choose among gates of a colour."""
        variance_m2 = float(np.trace(self.covariance[:3, :3]))
        return (not self.is_doubted, self.estimate().certain, self.belief, -variance_m2)

    def predict(self, time_us: int) -> None:
        """Let time pass; little of it is left for later."""
        elapsed_s = (time_us - self.time_us) * 1e-6
        if elapsed_s < PREDICTED_S:
            return
        self.time_us = time_us
        for hypothesis in self._hypotheses:
            hypothesis.predict(elapsed_s)

    def fit(self, view: GateView) -> Fit:
        """How a view fits."""
        updates = tuple(hypothesis.trial(view) for hypothesis in self._hypotheses)
        distance2 = min((update.distance2 for update in updates if update is not None), default=np.inf)
        return Fit(updates, distance2, CHI_SQUARED[sum(view.seen)])

    def accept(self, view: GateView, fit: Fit) -> None:
        """Use a view that fits; one from nearly the same place as the last adds nothing but belief."""
        self._saw(view)
        self._misfits.clear()
        self._strain += STRAIN_WEIGHT * (fit.distance2 / fit.gate - self._strain)
        self._move_eye(view.camera.position_m)
        if not is_moved(view, self._used) and view.time_us - self._used.time_us < NOVEL_US:
            return
        self._used = view
        self.views += 1
        for hypothesis, update in zip(self._hypotheses, fit.updates, strict=True):
            if update is not None and update.distance2 <= 2.0 * fit.gate:
                hypothesis.accept(update)
            else:
                hypothesis.log_weight -= fit.gate
        self._prune()

    def contradict(self, view: GateView, prior: Prior) -> None:
        """A whole view of this gate that fits none of its hypotheses; after several, they are made anew.

        What hides a gate shifts its outline, and from another place shifts it otherwise. So the views must
        be from several places and agree, more of them for a gate that is well known.
        """
        misfits = self._misfits
        if predicted(self.state, view) is None or (misfits and not is_moved(view, misfits[-1])):
            return
        misfits.append(view)
        if len(misfits) < MISFITS + self.belief // MISFITS_PER_BELIEF:
            return
        some = misfits[:: -(-len(misfits) // MISFITS_USED)]
        found = solutions(some, prior)
        largest = sum(CHI_SQUARED[sum(view.seen)] for view in some)
        if not found or found[0].cost > largest:
            del misfits[: len(misfits) // 2]
            return
        self._hypotheses = [GateFilter(solution) for solution in found]
        self._strain = found[0].cost / largest
        self._prune()
        self._first_eye_m, self._parallax = some[0].camera.position_m, 0.0
        self._move_eye(view.camera.position_m)
        self.belief, self.missed, self.views = SEEN_BELIEF * len(misfits), 0, len(some)
        self.seen_us, self._used = view.time_us, view
        misfits.clear()

    def is_believed(self, time_us: int) -> bool:
        """Whether there is such a gate."""
        return self.belief >= (TENTATIVE_BELIEF if time_us - self.seen_us > TENTATIVE_US else 0)

    def miss(self) -> None:
        """An image should have shown it and did not."""
        self.belief -= 1
        self.missed += 1

    def keep_inside(self, arena: Arena) -> bool:
        """Drop hypotheses outside the arena; false if none is left."""
        limits = (arena.length_x_m / 2, arena.width_y_m / 2)
        self._hypotheses = [
            hypothesis
            for hypothesis in self._hypotheses
            if abs(hypothesis.state[0]) <= limits[0] + OUTSIDE_M
            and abs(hypothesis.state[1]) <= limits[1] + OUTSIDE_M
            and -OUTSIDE_M <= hypothesis.state[2] <= arena.height_m + OUTSIDE_M
        ]
        return bool(self._hypotheses)

    def is_inside(self, arena: Arena) -> bool:
        """Whether the gate is in the arena by its estimate: one that is surely outside was seen badly."""
        x, y, z, _ = self.state.tolist()
        vx, vy, vz, _ = self.covariance.diagonal().tolist()
        beyond_m = (
            (abs(x) - arena.length_x_m / 2, vx),
            (abs(y) - arena.width_y_m / 2, vy),
            (max(z - arena.height_m, -z), vz),
        )
        return all(away_m < BEYOND_M + sqrt(variance_m2) for away_m, variance_m2 in beyond_m)

    def estimate(self) -> GateEstimate:
        """What is known of the gate."""
        x, y, z, yaw = self.state.tolist()
        vx, vy, vz, v_yaw = self.covariance.diagonal().tolist()
        weights = [hypothesis.log_weight for hypothesis in self._hypotheses]
        ambiguous = any(weight > weights[0] - AMBIGUOUS for weight in weights[1:])
        return GateEstimate(
            colour=self.colour,
            position_m=(x, y, z),
            yaw_rad=half_turn(yaw),
            position_std_m=(sqrt(vx), sqrt(vy), sqrt(vz)),
            yaw_std_rad=sqrt(v_yaw),
            ambiguous=ambiguous,
            certain=not ambiguous
            and self._is_consistent
            and is_certain(yaw, self.covariance, self.shape, self.views),
            views=self.views,
            seen_us=self.seen_us,
            shape=self.shape,
        )

    @property
    def _is_consistent(self) -> bool:
        """Views from several places are of one thing, of the size of a gate."""
        return self._parallax >= LEAST_PARALLAX and self._strain <= STRAINED and len(self._misfits) < MISFITS

    def _move_eye(self, eye_m: Vec3) -> None:
        x, y, z, _ = self.state.tolist()
        away_m = max(dist(eye_m, (x, y, z)), NEAREST_M)
        self._parallax = max(self._parallax, dist(eye_m, self._first_eye_m) / away_m)

    def _saw(self, view: GateView) -> None:
        self.seen_us = view.time_us
        self.missed = 0
        self.belief = min(self.belief + SEEN_BELIEF, MOST_BELIEF)

    def _prune(self) -> None:
        """Likeliest first; drop those that are far less likely, or became the same as a likelier one."""
        kept: list[GateFilter] = []
        for hypothesis in sorted(self._hypotheses, key=lambda hypothesis: -hypothesis.log_weight):
            far_less = bool(kept) and hypothesis.log_weight < kept[0].log_weight - PRUNED
            same = next((other for other in kept if _same(hypothesis, other)), None)
            if same is not None:
                same.absorb(hypothesis)
            elif not far_less:
                kept.append(hypothesis)
        self._hypotheses = kept


def is_certain(yaw_rad: float, covariance: Floats, shape: GateShape, views: int, factor: float = 1.0) -> bool:
    """Whether a gate is known well enough to fly through.

    Args:
        yaw_rad: of its normal.
        covariance: of x, y, z and yaw, shape (4, 4).
        shape: the smaller its opening, the better it must be known.
        views: how many were used.
        factor: by which standard deviations may be larger than usual.
    """
    vx, vy, vz, v_yaw = covariance.diagonal().tolist()
    nx, ny = cos(yaw_rad), sin(yaw_rad)
    shared = 2.0 * nx * ny * float(covariance[0, 1])
    along, aside = nx * nx * vx + ny * ny * vy + shared, ny * ny * vx + nx * nx * vy - shared
    square = factor * factor
    certain_m = CERTAIN_M * room_share(shape)
    exact = max(along / 4.0, aside, vz) <= square * certain_m**2 and v_yaw <= square * CERTAIN_RAD**2
    return exact and views >= CERTAIN_VIEWS


def _same(a: GateFilter, b: GateFilter) -> bool:
    away = (a.state - b.state).tolist()
    vx, vy, vz, v_yaw = (a.covariance + b.covariance).diagonal().tolist()
    return abs(half_turn(away[3])) < max(SAME_YAW_RAD, 0.5 * sqrt(v_yaw)) and hypot(*away[:3]) < max(
        SAME_M, 0.5 * sqrt(vx + vy + vz)
    )


def is_moved(view: GateView, last: GateView) -> bool:
    """Whether a view's errors differ from those of an earlier one: edges fall on other parts of pixels."""
    if view.seen != last.seen:
        return True
    shift = view.corners_px - last.corners_px
    return bool(shift @ shift >= NOVEL_PX**2 * sum(view.seen))
