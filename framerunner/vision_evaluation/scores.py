"""What the detectors made of labelled images, frame by frame and in sum."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import acos, asin, degrees, hypot, inf, isfinite, sqrt

import numpy as np

from framerunner.geometry.gate_shape import GateShapes
from framerunner.geometry.vectors import Vec3
from framerunner.vision_evaluation.labelled_images import GateLabel, LabelledImage
from framerunner.vision_evaluation.openings import opening_of
from vision.calibration.model import Calibration
from vision.detectors import Detector, DetectorMaker, detector_name, new_detector, others_detector
from vision.types import Detection, Detections, GateCorner, GateSighting, Image, Vision

KINDS: tuple[Vision, ...] = ("boxes", "frames")
DISTANCES_M = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)
ANGLES_DEG = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)
RATED_DISTANCE_M, RATED_ANGLE_DEG = 6.0, 75.0
"""The detection rate counts gates wholly in view up to here; farther ones are shown apart."""

_SAME_PX = 8.0  # a sighting whose corners are within this of a gate's is of that gate
_OUTLIER = 4.0  # standard deviations
_KEPT = 60  # images that are given back


@dataclass(frozen=True, slots=True)
class DetectionSample:
    """One gate wholly in view, and what one detector said of it; errors are None if it said nothing."""

    kind: str  # see `Scores`
    distance_m: float
    angle_deg: float
    found: bool
    distance_error: float | None = None  # relative, signed
    bearing_error_deg: float | None = None  # between the lines of sight
    tilt_error_deg: float | None = None  # between the normals; of the better of two poses
    first_is_right: bool | None = None  # whether that was the first
    deviations: tuple[float, ...] = ()  # errors of the corners by their standard deviations


@dataclass(frozen=True, slots=True, eq=False)
class Example:
    """An image, and what our detector by shape made of it."""

    labelled: LabelledImage
    found: Detections
    missed: tuple[GateLabel, ...]  # wholly in view and rated
    false: tuple[GateSighting, ...]


@dataclass(slots=True)
class Scores:
    """Everything that was counted, by kind: ours are `KINDS`; what others' gave is rated as both of them."""

    images: int = 0
    samples: list[DetectionSample] = field(default_factory=list)
    false_alarms: dict[str, int] = field(default_factory=lambda: dict.fromkeys(KINDS, 0))
    times_ms: dict[str, list[float]] = field(default_factory=lambda: {kind: [] for kind in KINDS})

    @property
    def kinds(self) -> tuple[str, ...]:
        """In the order in which they are shown."""
        return tuple(self.times_ms)

    def add(self, labelled: LabelledImage, found: dict[str, tuple[Detections, float]]) -> None:
        """Count one image: what each detector found in it, and how long it took, milliseconds."""
        self.images += 1
        for name, (detections, time_ms) in found.items():
            for vision in (name,) if name in KINDS else KINDS:
                samples, false_alarms = (_boxes if vision == "boxes" else _gates)(labelled, detections)
                kind = name if name == vision else f"{name} {vision}"
                self.samples += [
                    sample if sample.kind == kind else replace(sample, kind=kind) for sample in samples
                ]
                self.false_alarms[kind] = self.false_alarms.get(kind, 0) + false_alarms
                self.times_ms.setdefault(kind, []).append(time_ms)

    def in_sum(self) -> list[ErrorRow]:
        """A row of each kind over all samples that are rated."""
        samples = rated(self.samples)
        return [row_of(kind, 0.0, 0.0, [s for s in samples if s.kind == kind]) for kind in self.kinds]

    def by_distance(self) -> list[ErrorRow]:
        """The samples of each kind by ranges of the distance."""
        near = [s for s in self.samples if s.angle_deg < RATED_ANGLE_DEG]
        return rows_by(self.kinds, near, lambda sample: sample.distance_m, DISTANCES_M)

    def by_angle(self) -> list[ErrorRow]:
        """Those that are rated by ranges of the angle."""
        return rows_by(self.kinds, rated(self.samples), lambda sample: sample.angle_deg, ANGLES_DEG)

    def leave_out_unused(self) -> None:
        """Forget of a detector of others what it never gives, boxes or gates, unless it gives neither."""
        used = {*KINDS, *(s.kind for s in self.samples if s.found)}
        used |= {kind for kind, count in self.false_alarms.items() if count}
        others = [kind for kind in self.kinds if kind not in KINDS]
        if any(kind in used for kind in others):
            for kind in others:
                if kind not in used:
                    del self.times_ms[kind], self.false_alarms[kind]
            self.samples = [sample for sample in self.samples if sample.kind in used]


@dataclass(frozen=True, slots=True)
class ErrorRow:
    """The errors over a part of the samples; None where there is no number."""

    kind: str
    low: float
    high: float
    frames: int
    found: float | None  # share
    distance_median: float | None  # relative
    distance_p95: float | None
    bearing_median_deg: float | None
    tilt_median_deg: float | None
    tilt_p95_deg: float | None
    first_is_right: float | None  # share of the sightings with two poses
    deviation_rms: float | None  # of corners, in their standard deviations
    outliers: float | None  # share of corners farther off than four standard deviations


def detect_all(
    labelled: Iterable[LabelledImage], others: str | DetectorMaker | None = None
) -> tuple[Scores, list[Example]]:
    """Run our detectors over images, and one of others if it is given; also give back some images.

    Raises:
        DetectorError, ExtensionError: the others' detector cannot be made, or fails.
    """
    scores = Scores()
    examples: list[Example] = []
    detectors: dict[str, Detector] = {}
    camera: tuple[Calibration, GateShapes] | None = None
    for one in labelled:
        calibration = one.calibration
        if camera != (calibration, one.shapes):
            camera = (calibration, one.shapes)
            detectors = {k: new_detector(k, calibration=calibration, shapes=one.shapes) for k in KINDS}
            if others is not None:
                detectors[detector_name(others)] = others_detector(others, calibration, one.shapes)
            for detector in detectors.values():
                detector(one.image, None)  # the first call loads code
        found = {kind: _timed(detector, one.image) for kind, detector in detectors.items()}
        scores.add(one, found)
        example = _example(one, found["frames"][0])
        if len(examples) < _KEPT or (len(examples) < 2 * _KEPT and (example.missed or example.false)):
            examples.append(example)
    scores.leave_out_unused()
    return scores, examples


def _example(labelled: LabelledImage, detections: Detections) -> Example:
    missed = [
        label
        for label in labelled.gates
        if label.whole
        and is_rated(label.distance_m, label.angle_deg)
        and _sighting_of(label, detections.frames, labelled.shapes) is None
    ]
    return Example(labelled, detections, tuple(missed), tuple(_false_alarms(labelled, detections)))


def rows_by(
    kinds: Sequence[str],
    samples: Sequence[DetectionSample],
    key: Callable[[DetectionSample], float],
    edges: Sequence[float],
) -> list[ErrorRow]:
    """The samples of each kind by ranges of a number."""
    return [
        row_of(kind, low, high, [s for s in samples if s.kind == kind and low <= key(s) < high])
        for kind in kinds
        for low, high in pairwise(edges)
    ]


def row_of(kind: str, low: float, high: float, samples: Sequence[DetectionSample]) -> ErrorRow:
    """Sum up samples."""
    distances = [abs(s.distance_error) for s in samples if s.distance_error is not None]
    bearings = [s.bearing_error_deg for s in samples if s.bearing_error_deg is not None]
    tilts = [s.tilt_error_deg for s in samples if s.tilt_error_deg is not None]
    right = [float(s.first_is_right) for s in samples if s.first_is_right is not None]
    deviations = [number for s in samples for number in s.deviations]
    return ErrorRow(
        kind,
        low,
        high,
        len(samples),
        _mean([float(s.found) for s in samples]),
        _share(distances, 50),
        _share(distances, 95),
        _share(bearings, 50),
        _share(tilts, 50),
        _share(tilts, 95),
        _mean(right),
        sqrt(sum(n * n for n in deviations) / len(deviations)) if deviations else None,
        _mean([float(abs(n) > _OUTLIER) for n in deviations]),
    )


def rated(samples: Sequence[DetectionSample]) -> list[DetectionSample]:
    """Those that count for the detection rate."""
    return [s for s in samples if is_rated(s.distance_m, s.angle_deg)]


def is_rated(distance_m: float, angle_deg: float) -> bool:
    """Whether a gate wholly in view counts for the detection rate."""
    return distance_m <= RATED_DISTANCE_M and angle_deg < RATED_ANGLE_DEG


def _mean(numbers: Sequence[float]) -> float | None:
    return sum(numbers) / len(numbers) if numbers else None


def _share(numbers: Sequence[float], percent: float) -> float | None:
    return float(np.percentile(numbers, percent)) if numbers else None


def _timed(detector: Detector, image: Image) -> tuple[Detections, float]:
    begun_s = time.thread_time()
    detections = detector(image, None)
    return detections, 1e3 * (time.thread_time() - begun_s)


def _gates(labelled: LabelledImage, detections: Detections) -> tuple[list[DetectionSample], int]:
    """Samples and false alarms of the gate finder."""
    samples = []
    for label in labelled.gates:
        if label.whole:
            sighting = _sighting_of(label, detections.frames, labelled.shapes)
            samples.append(_sample_of_sighting(label, sighting, labelled.shapes))
    return samples, len(_false_alarms(labelled, detections))


def _false_alarms(labelled: LabelledImage, detections: Detections) -> list[GateSighting]:
    return [
        sighting
        for sighting in detections.frames
        if not any(_is_near(sighting, label) for label in labelled.gates)
    ]


def _is_near(sighting: GateSighting, label: GateLabel) -> bool:
    """Whether a sighting is of a gate, however inexact, rather than of nothing."""
    if not label.seen or sighting.colour != label.colour:
        return False
    if not label.corners_px:  # the gate reaches beside the camera
        return True
    right, down = zip(*label.corners_px, strict=True)
    return any(
        min(right) - _SAME_PX <= corner.right_px <= max(right) + _SAME_PX
        and min(down) - _SAME_PX <= corner.down_px <= max(down) + _SAME_PX
        for corner in sighting.corners
        if corner is not None
    )


def _sighting_of(
    label: GateLabel, sightings: Sequence[GateSighting], shapes: GateShapes
) -> GateSighting | None:
    """The sighting nearest to a gate, if it is of it."""
    best, best_px = None, _SAME_PX
    if label.corners_px:
        for sighting in sightings:
            if sighting.colour == label.colour:
                pairs = _compared(label, sighting, shapes)
                off_px = max(
                    (hypot(seen.right_px - x, seen.down_px - y) for seen, (x, y) in pairs), default=inf
                )
                if off_px < best_px:
                    best, best_px = sighting, off_px
    return best


def _compared(
    label: GateLabel, sighting: GateSighting, shapes: GateShapes
) -> list[tuple[GateCorner, tuple[float, float]]]:
    """The corners of a sighting with those of a label: of the opening, if that is what is labelled."""
    seen = [corner for corner in sighting.corners if corner is not None]
    if label.opening_px and len(seen) == len(sighting.corners):
        return list(zip(opening_of(seen, shapes.of(label.colour)), label.opening_px, strict=True))
    return [
        (corner, place)
        for corner, place in zip(sighting.corners, label.corners_px, strict=True)
        if corner is not None
    ]


def _sample_of_sighting(
    label: GateLabel, sighting: GateSighting | None, shapes: GateShapes
) -> DetectionSample:
    if sighting is None or not sighting.poses:
        return DetectionSample("frames", label.distance_m, label.angle_deg, False)
    tilts = [_angle_deg(pose.normal_flu, label.normal_flu) for pose in sighting.poses]
    best = tilts.index(min(tilts))
    pose = sighting.poses[best]
    deviations: list[float] = []
    for corner, (right, down) in _compared(label, sighting, shapes):
        deviations.append((corner.right_px - right) / corner.std_right_px)
        deviations.append((corner.down_px - down) / corner.std_down_px)
    return DetectionSample(
        "frames",
        label.distance_m,
        label.angle_deg,
        True,
        hypot(*pose.position_flu_m) / label.distance_m - 1.0,
        _angle_deg(pose.position_flu_m, label.position_flu_m),
        tilts[best],
        best == 0 if len(tilts) > 1 else None,
        tuple(deviations),
    )


def _boxes(labelled: LabelledImage, detections: Detections) -> tuple[list[DetectionSample], int]:
    """Samples and false alarms of the paper's detector, which sees one box of each colour."""
    samples, false_alarms = [], 0
    for colour in ("red", "green", "blue"):
        box: Detection = getattr(detections, colour)
        labels = [label for label in labelled.gates if label.colour == colour]
        if box.seen and not any(label.seen for label in labels):
            false_alarms += 1
        samples += [_sample_of_box(label, box, labelled.focal_px) for label in labels if label.whole]
    return samples, false_alarms


def _sample_of_box(label: GateLabel, box: Detection, focal_px: float) -> DetectionSample:
    if box.d == inf:
        return DetectionSample("boxes", label.distance_m, label.angle_deg, False)
    # Its rows and columns count from the image's middle, up and right.
    sight = (focal_px, -(box.e + box.w) / 2.0, (box.n + box.s) / 2.0)
    return DetectionSample(
        "boxes",
        label.distance_m,
        label.angle_deg,
        True,
        box.d / label.distance_m - 1.0,
        _angle_deg(sight, label.position_flu_m),
        abs(box.a - label.angle_deg) if isfinite(box.a) else None,
    )


def _angle_deg(one: Vec3, other: Vec3) -> float:
    """Angle between two vectors."""
    scale = hypot(*one) * hypot(*other)
    cosine = sum(a * b for a, b in zip(one, other, strict=True)) / scale
    if cosine < 0.99:
        return degrees(acos(max(-1.0, cosine)))
    chord = hypot(*(a / hypot(*one) - b / hypot(*other) for a, b in zip(one, other, strict=True)))
    return degrees(2.0 * asin(min(1.0, chord / 2.0)))
