"""The mounting of a camera on a drone, from gates seen while it moves: bundle adjustment.

Also known as extrinsic calibration of camera and body, hand-eye calibration, or boresight alignment.

Unknown are roll, pitch and yaw of the camera on the body, its place, the delay of its images, and the pose of
every gate; known are the gates' size, where their corners are in the images, and the drone's poses by its
telemetry but for an error of its position that wanders. All are found by robust least squares of the corners'
errors (B. Triggs et al., "Bundle adjustment - a modern synthesis", 2000). Gates hang nearly upright, so
their tilt is unknown within a degree only.

The standard deviations are the larger of two: those of the least squares, and those of the jackknife, which
leaves out one tenth of the flight after the other. The second knows that errors of the drone's estimator go
on for seconds.

How the drone moved while its camera saw gates tells what is still missing for the mounting to be known.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import degrees, pi
from typing import Literal

import numpy as np

from framerunner.geometry.vectors import Vec3
from vision.calibration.sightings import (
    MIN_OF_A_GATE,
    Bools,
    Floats,
    Indices,
    PoseSpline,
    Sightings,
    Values,
    first_mounting,
    first_yaw,
    gates_among,
    mounting_matrix,
)

_PLACE_STD_M = 0.02
"""Of the camera's place on the drone, measured with a ruler."""
_DELAY_STD_S = 0.1
_WANDER_STD_M = 0.01
"""Of the errors of the drone's position, which go on for seconds: by motion capture or visual odometry."""
_GATE_TILT_STD_RAD = 0.0175
_SIZE_STD = 0.005
"""Of a gate, as a share of it; of what may be none, `_UNKNOWN_SIZE_STD`."""
_UNKNOWN_SIZE_STD = 0.5
_ANGLE_STD_RAD = 0.6
_MAX_SIZE_ERROR = 0.06  # a rectangle that differs more from a gate's size is none
_SURE = 3.0  # standard deviations
_MAX_STEPS = 40
_PIXEL_STD_PX = 0.1  # added to what the finder of gates states: its edges' errors are not all independent
_ATTITUDE_STD_RAD = 0.0025  # of the drone's estimator
_OUTLIER = 4.0  # standard deviations of a corner, after the robust solution
_MAX_GATE_ERROR = 3.0  # median of a gate's corners' errors, standard deviations; more: it is no gate
_NEAREST_M = 0.05
_BLOCKS = 10
_MIN_ROUNDS, _MAX_ROUNDS = 2, 6
_OF_MOUNTING = 7  # numbers before those of the gates: three angles, three of the place, the delay
_OF_A_GATE = 7  # x, y, z, yaw, two small angles of its tilt, logarithm of its size
_OF_A_KNOT = 3  # of how far the drone is from where its estimator has it: x, y, z
_KNOT_S = 3.0  # between two of them; in between it is interpolated
_STEP = 1e-4  # of numerical differences, rad and s

_SIDEWAYS = np.array([-1.0, 1.0, 1.0, -1.0])
_UPWARDS = np.array([1.0, 1.0, -1.0, -1.0])


@dataclass(frozen=True, slots=True, eq=False)
class MountingFit:
    """A mounting that explains what was seen.

    Attributes:
        values: of the mounting.
        std: their standard deviations.
        sightings: those used.
        numbers: of the gate that each is of.
        gates_m: where the gates are, shape (gates, 3).
        rms_px: of the corners' errors.
    """

    values: Values
    std: Values
    sightings: Sightings
    numbers: Indices
    gates_m: Floats
    rms_px: float


def fit_mounting(seen: Sightings, motion: PoseSpline, focal_px: float, known: Values) -> MountingFit | None:
    """Find the mounting.

    Args:
        seen: gates in images.
        motion: of the drone.
        focal_px: focal length of the camera.
        known: what is known before: the place and the delay; of the angles nothing is known.

    Returns:
        None if no gate was seen often enough. How exactly the values are known is told by their standard
        deviations alone.
    """
    if len(seen) < MIN_OF_A_GATE:
        return None
    start = first_mounting(seen, motion, known)
    free = np.ones(len(seen), np.bool_)  # sightings that may be of a gate
    for number in range(_MAX_ROUNDS):
        numbers, places = gates_among(seen, free, motion, start)
        used = np.flatnonzero(numbers >= 0)
        if not len(used):
            return None
        fitted = _BundleAdjustment(seen.at(used), numbers[used], motion, focal_px, known)
        fitted.solve(start, places)
        start = fitted.values
        wrong = fitted.are_wrong()
        free[used[wrong[numbers[used]]]] = False  # such as a poster: drawn borders look like gates
        if number >= _MIN_ROUNDS - 1 and not wrong.any():
            break
    else:
        return None
    fitted.refine()
    return fitted.result()


class _BundleAdjustment:
    """The least squares of some sightings, each of a numbered gate.

    Args:
        seen: the sightings.
        numbers: of the gate that each is of; each gate has sightings.
        motion: of the drone.
        focal_px: focal length of the camera.
        known: the place and the delay, known before.

    Attributes:
        solution: the mounting's numbers, then those of every gate, then those of every knot.
    """

    def __init__(
        self, seen: Sightings, numbers: Indices, motion: PoseSpline, focal_px: float, known: Values
    ) -> None:
        self._seen, self._numbers, self._motion, self._focal_px = seen, numbers, motion, focal_px
        self._count = int(numbers.max()) + 1  # of gates
        self._first_knot = _OF_MOUNTING + self._count * _OF_A_GATE
        self._knots = _knots_of(seen.times_s)
        self._mean, self._std = _prior(known, self._count, self._knots.shape[1])
        self.solution = self._mean
        variances = seen.std_px**2 + _PIXEL_STD_PX**2 + (_ATTITUDE_STD_RAD * focal_px) ** 2
        self._weights = np.nan_to_num(1.0 / np.sqrt(variances))  # shape (n, 4, 2); 0: not used
        self._sides = np.ones(len(seen))  # 1: seen from the side of the normal, else -1
        self._poses: tuple[float, Floats, Floats] | None = None  # of the drone at the corners, with a delay

    @property
    def values(self) -> Values:
        """Of the mounting."""
        return _values(self.solution[:_OF_MOUNTING])

    def solve(self, start: Values, places: Sequence[Vec3]) -> None:
        """Find the solution nearest to a start, whatever single corners are.

        Args:
            start: a mounting.
            places: of the gates.
        """
        self.solution = np.zeros(len(self._mean))
        self.solution[:_OF_MOUNTING] = *start.angles_frd_rad, *start.position_flu_m, start.delay_s
        for number, (gate, place) in enumerate(zip(self._gates(self.solution), places, strict=True)):
            mine = self._seen.at(np.flatnonzero(self._numbers == number))
            gate[:4] = *place, first_yaw(mine, self._motion, start)
        for _ in range(2):
            self._sides = self._seen_from()
            self.solution = _minimized(self._residuals, self.solution, self._jacobian, "soft_l1")

    def refine(self) -> None:
        """Go on from the solution: gates have their size, and corners that are far off are not used."""
        self._gates(self._std)[:, 6] = _SIZE_STD
        self.solution = _minimized(self._residuals, self.solution, self._jacobian, "soft_l1")
        errors = np.abs(self._errors(self.solution)).max(axis=2)
        self._weights[errors > _OUTLIER] = 0.0
        self.solution = _minimized(self._residuals, self.solution, self._jacobian, "linear")

    def are_wrong(self) -> Bools:
        """Which gates are none: their corners are not those of a rectangle, or their size is another."""
        sizes = self._gates(self.solution)[:, 6]
        jacobian = self._jacobian(self.solution)
        variances = np.diag(np.linalg.pinv(jacobian.T @ jacobian, hermitian=True))
        sizes_std = np.sqrt(self._gates(variances)[:, 6])
        wrong_size = np.abs(sizes) > np.maximum(_MAX_SIZE_ERROR, _SURE * sizes_std)
        return (self._gate_errors() > _MAX_GATE_ERROR) | wrong_size

    def _gate_errors(self) -> Floats:
        """The median of each gate's corners' errors, standard deviations; infinite without corners."""
        errors = np.linalg.norm(self._errors(self.solution), axis=2)
        used = self._weights[:, :, 0] > 0.0
        found = []
        for number in range(self._count):
            mine = errors[self._numbers == number][used[self._numbers == number]]
            found.append(float(np.median(mine)) if len(mine) else np.inf)
        return np.array(found)

    def result(self) -> MountingFit:
        """What was found, with its standard deviations."""
        std = _values(self._deviations())
        errors_px = np.linalg.norm(self._offsets(self.solution), axis=2)[self._weights[:, :, 0] > 0.0]
        rms_px = float(np.sqrt(np.mean(errors_px**2))) if len(errors_px) else np.inf
        gates_m = self._gates(self.solution)[:, :3]
        return MountingFit(self.values, std, self._seen, self._numbers, gates_m, rms_px)

    def _gates(self, at: Floats) -> Floats:
        """A view of the gates' numbers, shape (gates, 7)."""
        return at[_OF_MOUNTING : self._first_knot].reshape(-1, _OF_A_GATE)

    def _drone(self, delay_s: float) -> tuple[Floats, Floats]:
        """Positions and rotations of the drone when corners were exposed, shape (n, 4, 3), (n, 4, 3, 3)."""
        if self._poses is None or self._poses[0] != delay_s:
            times_s = (self._seen.corners_s - delay_s).ravel()
            count = len(self._seen)
            positions = self._motion.positions(times_s).reshape(count, 4, 3)
            self._poses = (delay_s, positions, self._motion.rotations(times_s).reshape(count, 4, 3, 3))
        return self._poses[1:]

    def _seen_from(self) -> Floats:
        """From which side of its gate each sighting is."""
        positions, _ = self._drone(self.solution[6])
        gates = self._gates(self.solution)[self._numbers]
        away = positions[:, 0] - gates[:, :3]
        facing = away[:, 0] * np.cos(gates[:, 3]) + away[:, 1] * np.sin(gates[:, 3])
        return np.where(facing >= 0.0, 1.0, -1.0)

    def _corners(self, at: Floats) -> tuple[Floats, Floats]:
        """Where the corners are in the world, shape (n, 4, 3), and how they move with their gate's numbers.

        The second has shape (n, 4, 3, 7).
        """
        gates = self._gates(at)[self._numbers]
        half_width_m, half_height_m = self._seen.half_m.T[..., None]
        across, up = self._sides[:, None] * (_SIDEWAYS * half_width_m), _UPWARDS * half_height_m
        c, s = np.cos(gates[:, 3:4]), np.sin(gates[:, 3:4])
        roll, lean, size = gates[:, 4:5], gates[:, 5:6], np.exp(gates[:, 6:7])
        along, ahead, above = size * (across - roll * up), size * lean * up, size * (up + roll * across)
        arms = np.stack([c * ahead - s * along, s * ahead + c * along, above], axis=-1)
        slopes = np.zeros((*arms.shape, _OF_A_GATE))
        slopes[..., :3] = np.eye(3)
        slopes[..., 0, 3], slopes[..., 1, 3] = -arms[..., 1], arms[..., 0]
        slopes[..., 0, 4], slopes[..., 1, 4], slopes[..., 2, 4] = s * size * up, -c * size * up, size * across
        slopes[..., 0, 5], slopes[..., 1, 5] = c * size * up, s * size * up
        slopes[..., 6] = arms
        return gates[:, None, :3] + arms, slopes

    def _in_camera(self, at: Floats, corners: Floats) -> tuple[Floats, Floats]:
        """Corners of the world from the camera, forward, left, up, and from the drone's centre, likewise."""
        positions, rotations = self._drone(float(at[6]))
        wander = self._knots @ at[self._first_knot :].reshape(-1, _OF_A_KNOT)
        body = np.einsum("nkji,nkj->nki", rotations, corners - positions - wander[:, None])
        return (body - at[3:6]) @ _turn(at[:3]), body

    def _offsets(self, at: Floats) -> Floats:
        """Of the corners from where the solution has them, pixels, shape (n, 4, 2)."""
        camera, _ = self._in_camera(at, self._corners(at)[0])
        pixels = -self._focal_px * camera[..., 1:] / np.maximum(camera[..., :1], _NEAREST_M)
        offsets: Floats = pixels - np.nan_to_num(self._seen.corners_px)
        return offsets

    def _errors(self, at: Floats) -> Floats:
        """The offsets in standard deviations."""
        errors: Floats = self._offsets(at) * self._weights
        return errors

    def _residuals(self, at: Floats) -> Floats:
        """Errors of all corners, then what is known before."""
        residuals: Floats = np.concatenate([self._errors(at).ravel(), (at - self._mean) / self._std])
        return residuals

    def _deviations(self) -> Floats:
        """Standard deviations of the mounting's numbers."""
        residuals, jacobian = self._residuals(self.solution), self._jacobian(self.solution)
        normal = jacobian.T @ jacobian
        inverse = np.linalg.pinv(normal, hermitian=True)
        count = int(np.count_nonzero(self._weights))
        excess = max(1.0, float(residuals @ residuals) / max(1, count - len(self.solution)))
        formal = np.sqrt(np.diag(inverse)[:_OF_MOUNTING] * excess)
        order = np.argsort(self._seen.times_s, kind="stable")
        rows = np.arange(8 * len(self._seen)).reshape(-1, 8)
        shifts = []
        for block in np.array_split(order, _BLOCKS):
            mine = rows[block].ravel()
            left_out = jacobian[mine]
            rest = normal - left_out.T @ left_out + 1e-9 * np.diag(np.diag(normal))
            shifts.append(np.linalg.lstsq(rest, left_out.T @ residuals[mine], rcond=None)[0][:_OF_MOUNTING])
        spread = np.array(shifts) - np.mean(shifts, axis=0)
        jackknife = np.sqrt((_BLOCKS - 1) / _BLOCKS * (spread**2).sum(axis=0))
        larger: Floats = np.maximum(formal, jackknife)
        return larger

    def _jacobian(self, at: Floats) -> Floats:
        """How the residuals change with the solution's numbers, shape (residuals, numbers)."""
        corners, slopes = self._corners(at)
        camera, body = self._in_camera(at, corners)
        depth = np.maximum(camera[..., :1], _NEAREST_M)
        # Of both pixels with the place in the camera's axes: forward, left, up.
        by_place = np.zeros((*camera.shape[:2], 2, 3))
        by_place[..., 0] = self._focal_px * camera[..., 1:] / depth**2
        by_place[..., 0, 1] = by_place[..., 1, 2] = -self._focal_px / depth[..., 0]
        by_place *= self._weights[..., None]
        turn = _turn(at[:3])
        mounting = np.empty((*camera.shape, _OF_MOUNTING))
        for number in range(3):
            step = np.zeros(3)
            step[number] = _STEP
            change = (_turn(at[:3] + step) - _turn(at[:3] - step)) / (2.0 * _STEP)
            mounting[..., number] = (body - at[3:6]) @ change
        mounting[..., 3:6] = -turn.T
        ends = [self._in_camera(_later(at, step), corners)[0] for step in (-_STEP, _STEP)]
        mounting[..., 6] = (ends[1] - ends[0]) / (2.0 * _STEP)
        _, rotations = self._drone(float(at[6]))
        gates = np.einsum("im,nkji,nkjp->nkmp", turn, rotations, slopes, optimize=True)
        dense = np.zeros((*camera.shape[:2], 2, len(at)))
        dense[..., :_OF_MOUNTING] = by_place @ mounting
        of_gates = by_place @ gates
        for number in range(self._count):
            first = _OF_MOUNTING + number * _OF_A_GATE
            mine = self._numbers == number
            dense[mine, :, :, first : first + _OF_A_GATE] = of_gates[mine]
        wandering = of_gates[:, :, :, None, :_OF_A_KNOT] * -self._knots[:, None, None, :, None]
        dense[..., self._first_knot :] = wandering.reshape(*dense.shape[:3], -1)
        before = np.diag(1.0 / self._std)
        jacobian: Floats = np.concatenate([dense.reshape(-1, len(at)), before])
        return jacobian


def _prior(known: Values, gates: int, knots: int) -> tuple[Floats, Floats]:
    """What is known of each number before, and its standard deviation; infinite: nothing."""
    others = gates * _OF_A_GATE + knots * _OF_A_KNOT
    mean = [0.0] * 3 + [*known.position_flu_m, known.delay_s] + [0.0] * others
    std = [_ANGLE_STD_RAD] * 3 + [_PLACE_STD_M] * 3 + [_DELAY_STD_S]
    std += ([np.inf] * 4 + [_GATE_TILT_STD_RAD] * 2 + [_UNKNOWN_SIZE_STD]) * gates
    std += [_WANDER_STD_M] * _OF_A_KNOT * knots
    return np.array(mean), np.array(std)


def _minimized(
    residuals: Callable[[Floats], Floats],
    start: Floats,
    jacobian: Callable[[Floats], Floats],
    loss: Literal["linear", "soft_l1"],
) -> Floats:
    """The numbers of the least squares near a start."""
    from scipy.optimize import least_squares  # noqa: PLC0415 - it takes 0.2 s

    found = least_squares(residuals, start, jacobian, loss=loss, x_scale="jac", max_nfev=_MAX_STEPS)
    solution: Floats = found.x
    return solution


def _knots_of(times_s: Floats) -> Floats:
    """How much each knot of the wandering error counts at times, shape (n, knots)."""
    places = (times_s - times_s.min()) / _KNOT_S
    knots = np.arange(int(places.max()) + 2)
    weights: Floats = np.maximum(0.0, 1.0 - np.abs(places[:, None] - knots))
    return weights


def _later(at: Floats, step_s: float) -> Floats:
    """A solution with another delay."""
    later = at.copy()
    later[6] += step_s
    return later


def _turn(angles_frd_rad: Floats) -> Floats:
    """The matrix from the camera's axes to the body's, forward, left, up."""
    roll, pitch, yaw = (float(angle) for angle in angles_frd_rad)
    return mounting_matrix((roll, pitch, yaw))


def _values(numbers: Floats) -> Values:
    roll, pitch, yaw, x, y, z, delay_s = (float(number) for number in numbers)
    return Values((roll, pitch, yaw), (x, y, z), delay_s)


MIN_SIGHTINGS = 60
MIN_TURN_DEG = 20.0
MIN_APPROACH_M = 0.6
MAX_ANGLE_STD_DEG = 0.3
MAX_DELAY_STD_S = 0.008
MAX_POSITION_STD_M = 0.01
"""A coordinate of the camera's place is found if it is known better than this."""


@dataclass(frozen=True, slots=True)
class Movement:
    """What the drone did while gates were seen.

    Attributes:
        sightings: of gates, in images that differ.
        gates: how many gates were seen.
        turn_deg: the arc of its headings.
        approach_m: by how much its distance to some gate changed.
    """

    sightings: int
    gates: int
    turn_deg: float
    approach_m: float


def movement_of(seen: Sightings, motion: PoseSpline, fit: MountingFit | None) -> Movement:
    """The movement at the times of the sightings that were used."""
    if fit is None:
        return Movement(len(seen), 0, 0.0 if not len(seen) else _turn_deg(seen, motion), 0.0)
    used = fit.sightings
    places = motion.positions(used.times_s)
    away = np.linalg.norm(places - fit.gates_m[fit.numbers], axis=1)
    spans = [np.ptp(away[fit.numbers == number]) for number in range(len(fit.gates_m))]
    return Movement(len(used), len(fit.gates_m), _turn_deg(used, motion), float(max(spans)))


def _turn_deg(seen: Sightings, motion: PoseSpline) -> float:
    """The smallest arc that has all headings."""
    rotations = motion.rotations(seen.times_s)
    headings: Floats = np.sort(np.arctan2(rotations[:, 1, 0], rotations[:, 0, 0]))
    gaps = np.diff(np.append(headings, headings[0] + 2.0 * pi))
    return degrees(2.0 * pi - float(gaps.max()))


def missing_for(movement: Movement, fit: MountingFit | None) -> tuple[str, ...]:
    """What must still be done, in words; empty if the angles are known."""
    words = []
    if movement.sightings < MIN_SIGHTINGS:
        words.append(
            f"let the camera see frames, wholly in view and 1 to 5 m away: {movement.sightings} different "
            f"views so far, {MIN_SIGHTINGS} are needed"
        )
    if movement.turn_deg < MIN_TURN_DEG:
        words.append(
            f"yaw the drone by {MIN_TURN_DEG:.0f} degrees at least, so that a frame moves from one side of "
            f"the image to the other ({movement.turn_deg:.0f} so far)"
        )
    if movement.approach_m < MIN_APPROACH_M:
        words.append(
            f"fly towards a frame and away from it, by {MIN_APPROACH_M:g} m at least "
            f"({movement.approach_m:.1f} m so far)"
        )
    if words:
        return tuple(words)
    if fit is None:
        return ("let the camera see frames: nothing that was seen stays at one place and has a frame's size",)
    roll, pitch, yaw = (degrees(each) for each in fit.std.angles_frd_rad)
    if roll > MAX_ANGLE_STD_DEG:
        words.append(f"yaw the drone further with frames in view: roll is uncertain by {roll:.2f} degrees")
    uncertain = {"pitch": pitch, "yaw": yaw}
    for name, deg in uncertain.items():
        if deg > MAX_ANGLE_STD_DEG:
            words.append(
                f"fly towards frames and away from them, and past them to the side, by a metre: {name} is "
                f"uncertain by {deg:.2f} degrees"
            )
    return tuple(words)
