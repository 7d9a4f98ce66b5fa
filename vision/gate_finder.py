"""Find gates by their shape: corners and poses of every gate in an image, and the feet of obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import acos, copysign, degrees, hypot

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.geometry.gate_shape import GateShapes
from vision.calibration.lens import Lens, straight_box
from vision.colour_regions import OBSTACLE, PRIMARIES, SECONDARIES, ColourMask, find_colours
from vision.detector import measure
from vision.fill_shares import brightness_of_gates, fill_around, has_coloured_lines
from vision.gate_fit import FittedGate, fit_gate, gate_of_axes
from vision.gate_model import GateModel, Point, Sides
from vision.learned.judge import LEAST_CHANCE, Floats, Outline, Outlines, find_outlines, judge
from vision.outer_sides import named_sides, outer_sides, sides_by_opening
from vision.patch import ImagePatch, cut_patch
from vision.thin_gates import MOST_PX, Ring, fit_ring
from vision.types import (
    NOT_SEEN,
    Detection,
    Detections,
    GatePose,
    GateSighting,
    Image,
    ObstacleEdge,
)

_Plane = npt.NDArray[np.uint8]
_Contour = npt.NDArray[np.int32]
_Box = tuple[int, int, int, int]
_Found = tuple[_Box, GateSighting]

_OBSTACLE_STEP = 8
_MIN_RUN_PX = 3
_STEEP = 2  # rows a column: steeper edges are the sides of obstacles, which are upright
_MIN_FRAGMENT_PX = 3
_MAX_FRAGMENTS = 12
_SHEET_PX, _SHEET_SHARE, _BARS_SHARE = 5.0, 0.9, 0.6
_CLUTTER = 4  # regions; of more, only those are fitted that networks see a gate in
_MOST_APART = 4  # fragments that are also looked at alone
_LARGE_PX = 40
_THIN_BAR_SHARE = (
    1 / 128
)  # of the image's width; wider bars have pixels of their own colour, which tell their width
_SURE = 0.6  # chance from which on a gate is found by networks alone
_CERTAIN = 0.97  # and one with wide bars
_NARROW, _WIDE, _BLUR_PX = 0.6, 1.5, 1.5  # limits of widths of bars by what follows from the pose
_CORNERS_OF_BOX = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
_OPENING_PX = 12  # a region smaller than this is not looked at for an opening


@dataclass(frozen=True, slots=True, eq=False)
class _Region:
    """Pixels of a pure colour that may be parts of one gate."""

    mask: ColourMask  # of that colour
    others: tuple[ColourMask, ...]  # of all other colours
    fragments: list[_Contour]  # their outlines
    box: _Box


class GateFinder:
    """Finds gates of known sizes by colour and shape.

    Args:
        focal_px: focal length of the camera; its optical axis is in the middle of the image.
        lens: of a camera that is not ideal; it has the same focal length. What is found is then in pixels of
            an ideal camera.
        shapes: of the gates of each colour; None: all have that of the frame challenge.
    """

    def __init__(
        self,
        focal_px: float,
        lens: Lens | None = None,
        shapes: GateShapes | None = None,
    ) -> None:
        self._focal_px = focal_px
        known = shapes or GateShapes()
        self._models = {colour: GateModel(known.of(colour), focal_px) for colour in PRIMARIES + SECONDARIES}
        self._lens = lens

    def find(self, image: Image, time_us: int | None = None) -> Detections:
        """Find all gates and obstacles.

        Args:
            image: BGR, shape (height, width, 3), uint8.
            time_us: vehicle time of the image, passed on.

        Returns:
            The gates by shape, the obstacles' lower ends, and for the largest region of red, green and blue
            the paper's six numbers with the signed angle.

        Raises:
            ValueError: the image is not of that shape and type.
            CalibrationError: it has another size than those with which the camera was calibrated.
        """
        if self._lens is not None:
            self._lens.check_size(image.shape[1], image.shape[0])
        masks = find_colours(image)
        regions = _regions(masks)
        seen: tuple[Floats, Outlines] | None = None
        if len(regions) > _CLUTTER or has_coloured_lines(image, [region.box for region in regions]):
            seen = find_outlines(image)
            regions = _worth_fitting(image, regions, seen[1])
        found = [one for region in regions for one in self._of_region(region)]
        known = [box for box, _ in found]
        if seen is None and len(found) < len(regions) and has_coloured_lines(image, known):
            seen = find_outlines(image)
        if seen is not None:
            chances, outlines = seen
            found = _likely(image, found, outlines)
            known = [box for box, sighting in found if sighting.poses]
            whole = self._of_outlines(image, known, chances, outlines)
            found = [one for one in found if one[1].poses or not _is_part(one, whole)] + whole
        edges = self._obstacle_edges(masks)
        height, width = image.shape[:2]
        by_colour = {c: [one for one in found if one[1].colour == c] for c in PRIMARIES}
        numbers = {c: self._numbers(c, ones, width, height) for c, ones in by_colour.items() if ones}
        return Detections(
            red=numbers.get("red", NOT_SEEN),
            green=numbers.get("green", NOT_SEEN),
            blue=numbers.get("blue", NOT_SEEN),
            time_us=time_us,
            frames=tuple(sighting for _, sighting in found),
            obstacle_edges=edges,
        )

    def _obstacle_edges(self, masks: Sequence[ColourMask]) -> tuple[ObstacleEdge, ...]:
        """The lower ends of obstacles."""
        for mask in masks:
            if mask.colour == OBSTACLE:
                edges = _obstacle_edges(mask, [other for other in masks if other is not mask])
                return edges if self._lens is None else _straight_edges(edges, self._lens)
        return ()

    def _of_region(self, region: _Region) -> list[_Found]:
        """The gates that pixels of a pure colour are."""
        sighting = self._sighting(region, np.concatenate(region.fragments))
        if (sighting is None or not sighting[1].whole) and 1 < len(region.fragments) <= _MOST_APART:
            # What is joined may be two things: a gate, and mixed colours at an obstacle's edge.
            each = [self._sighting(region, fragment) for fragment in region.fragments]
            alone = [one for one in each if one is not None and (sighting is None or one[1].whole)]
            if alone:
                return alone
        return [] if sighting is None else [sighting]

    def _of_outlines(
        self, image: Image, known: Sequence[_Box], chances: Floats, outlines: Outlines
    ) -> list[_Found]:
        """The gates that networks see outside boxes."""
        found: list[_Found] = []
        bright = 0.0
        for chance, outline in zip(chances.tolist(), outlines, strict=True):
            if chance <= _SURE or any(_is_inside(outline, box) for box in known):
                continue
            bright = bright or brightness_of_gates(image)
            ring = fit_ring(fill_around(image, outline, MOST_PX, bright), outline)
            sighting = None if ring is None else self._ring_sighting(ring, image, chance)
            if sighting is not None:
                found.append(sighting)
        return found

    def _ring_sighting(self, ring: Ring, image: Image, chance: float) -> _Found | None:
        """The gate that a ring of lines is, if it is one; wide lines must be one by a greater chance."""
        height, width = image.shape[:2]
        middle = np.array([(width - 1) / 2, (height - 1) / 2])
        places = ring.corners - middle
        if self._lens is not None:
            places = self._lens.ideal(places)
        corners: list[Point] = [(x, y) for x, y in places.tolist()]
        segments = list(zip(corners, corners[1:] + corners[:1], strict=True))
        model = self._models[ring.colour]
        best: FittedGate | None = None
        for sides in named_sides(segments):
            axes = [side[0] for side in sides if side is not None]
            fitted = gate_of_axes(axes, ring.std_px, model)
            if fitted is not None and (best is None or fitted.cost < best.cost):
                best = fitted
        if best is None:
            return None
        distance_m = hypot(*best.poses[0].position_flu_m)
        bar_px = self._focal_px * model.shape.bar_m / distance_m
        if bar_px > _THIN_BAR_SHARE * width and not (chance > _CERTAIN and _is_as_wide(ring.bar_px, bar_px)):
            return None
        box = _bounding_box(np.rint(ring.corners).astype(np.int32))
        return box, GateSighting(ring.colour, best.corners, best.whole, best.poses)

    def _numbers(self, colour: str, found: Sequence[_Found], width: int, height: int) -> Detection:
        """The paper's numbers of the largest of some gates."""
        box, largest = max(found, key=lambda one: one[0][2] * one[0][3])
        numbers = measure(
            box[1] + 1, box[1] + box[3], box[0] + 1, box[0] + box[2],
            width_px=width, height_px=height, focal_px=self._focal_px, shape=self._models[colour].shape,
        )  # fmt: skip
        if self._lens is not None:
            numbers = straight_box(numbers, self._lens)
        if largest.poses:
            numbers = replace(numbers, signed_a=_signed_angle(largest.poses[0]))
        return numbers

    def _sighting(self, region: _Region, points: _Contour) -> _Found | None:
        """The gate that some of the fragments of a region show, if it is one."""
        mask, others = region.mask, region.others
        height, width = mask.mask.shape
        box = _bounding_box(points)
        if _is_filled(mask, points, box):
            return None
        candidates = outer_sides(points, width, height, self._lens)
        if not candidates:
            return None
        patch, model = cut_patch(mask, others, box, self._lens), self._models[mask.colour]
        best = self._best_fit(patch, candidates, model)
        if best is None and min(box[2:]) >= _OPENING_PX:
            # Something of its colour behind it may spoil its outline, but not that of its opening.
            openings = sides_by_opening(mask.mask, box, model.shape, self._lens)
            best = self._best_fit(patch, openings, model)
        return (
            None if best is None else (box, GateSighting(mask.colour, best.corners, best.whole, best.poses))
        )

    def _best_fit(
        self, patch: ImagePatch, candidates: Sequence[Sides], model: GateModel
    ) -> FittedGate | None:
        """The likeliest gate of several first estimates."""
        best: FittedGate | None = None
        for sides in candidates:
            fitted = fit_gate(patch, sides, model)
            if fitted is not None and (
                best is None or (fitted.whole, -fitted.cost) > (best.whole, -best.cost)
            ):
                best = fitted
        return best


def _is_as_wide(seen_px: float, bar_px: float) -> bool:
    """Whether the upper and lower bars of a gate whose bars have a width may look so wide."""
    return _NARROW * bar_px < seen_px < _WIDE * bar_px + _BLUR_PX


def _is_inside(outline: Outline, box: _Box) -> bool:
    """Whether the middle of an outline is in a box."""
    column, row, columns, rows = box
    x, y = outline.mean(axis=0).tolist()
    return bool(column <= x < column + columns and row <= y < row + rows)


def _is_part(one: _Found, gates: Sequence[_Found]) -> bool:
    """Whether what is seen of a gate is in the box of one of some gates of its colour."""
    column, row, columns, rows = one[0]
    return any(
        gate.colour == one[1].colour
        and left <= column + 0.5 * columns < left + width
        and top <= row + 0.5 * rows < top + height
        for (left, top, width, height), gate in gates
    )


def _worth_fitting(image: Image, regions: Sequence[_Region], outlines: Outlines) -> list[_Region]:
    """Those of some regions that may be gates by the networks, of which the first one proposes not all."""
    asked = [region for region in regions if not _may_be_gate(region, outlines)]
    boxes = np.array([region.box for region in asked], np.float64).reshape(-1, 1, 4)
    chances, _ = judge(image, boxes[..., :2] + _CORNERS_OF_BOX * (boxes[..., 2:] - 1.0))
    denied = [region for region, chance in zip(asked, chances.tolist(), strict=True) if chance < _SURE]
    return [region for region in regions if region not in denied]


def _may_be_gate(region: _Region, outlines: Outlines) -> bool:
    """Whether networks see a gate in a region, or it may be a part of one, which they do not know."""
    if any(_is_inside(outline, region.box) for outline in outlines):
        return True
    column, row, columns, rows = region.box
    height, width = region.mask.mask.shape
    cut = column == 0 or row == 0 or column + columns == width or row + rows == height
    if cut and max(columns, rows) >= _LARGE_PX:
        return True
    around = (slice(max(row - 2, 0), row + rows + 2), slice(max(column - 2, 0), column + columns + 2))
    return any(other.colour == OBSTACLE and other.mask[around].any() for other in region.others)


def _likely(image: Image, found: Sequence[_Found], outlines: Outlines) -> list[_Found]:
    """Those of some gates that networks do not deny; of what is seen in part they are not asked."""
    height, width = image.shape[:2]
    asked = [
        one
        for one in found
        if one[1].whole and one[1].poses and not any(_is_inside(each, one[0]) for each in outlines)
    ]
    corners = [[(corner.right_px, corner.down_px) for corner in one[1].corners if corner] for one in asked]
    places = np.array(corners).reshape(-1, 4, 2) + np.array([(width - 1) / 2, (height - 1) / 2])
    chances, _ = judge(image, places)
    denied = [one for one, chance in zip(asked, chances.tolist(), strict=True) if chance < LEAST_CHANCE]
    return [one for one in found if one not in denied]


def _is_filled(mask: ColourMask, points: _Contour, box: _Box) -> bool:
    """Whether a region wholly inside the image is a sheet, so large that a gate's opening would show."""
    column, row, columns, rows = box
    height, width = mask.mask.shape
    if (
        min(columns, rows) < _SHEET_PX
        or column == 0
        or row == 0
        or column + columns == width
        or row + rows == height
    ):
        return False
    hull = cv2.convexHull(points)
    area, around = cv2.contourArea(hull), cv2.arcLength(hull, True)
    if area < _SHEET_PX * 0.5 * around:  # mean width of a long rectangle
        return False
    pixels = cv2.countNonZero(mask.mask[row : row + rows, column : column + columns])
    # By Pick's theorem; or the bars of a gate, however it is turned, with a pixel beside them.
    return pixels > min(_SHEET_SHARE * (area + 0.5 * around + 1.0), _BARS_SHARE * area + around)


def _bounding_box(points: _Contour) -> _Box:
    column, row, columns, rows = cv2.boundingRect(points)
    return (column, row, columns, rows)


def _regions(masks: Sequence[ColourMask]) -> list[_Region]:
    """What may be gates by colour."""
    regions = []
    for mask in masks:
        if mask.colour != OBSTACLE:
            others = tuple(other for other in masks if other is not mask)
            for fragments in _groups(mask, others):
                box = _bounding_box(np.concatenate(fragments))
                regions.append(_Region(mask, others, fragments, box))
    return regions


def _groups(mask: ColourMask, others: Sequence[ColourMask]) -> list[list[_Contour]]:
    """The outlines of a colour's fragments; those that may be parts of one gate together."""
    column, row, columns, rows = mask.box
    crop = mask.mask[row : row + rows, column : column + columns]
    contours, hierarchy = cv2.findContours(
        crop, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE, offset=(column, row)
    )
    outer = [c for c, links in zip(contours, hierarchy[0], strict=True) if links[3] < 0]
    if len(outer) > 1:
        outer = sorted(outer, key=len, reverse=True)[: 2 * _MAX_FRAGMENTS]  # noise has thousands
        sizes = [max(_bounding_box(c)[2:]) for c in outer]
        large = [(size, c) for size, c in zip(sizes, outer, strict=True) if size >= _MIN_FRAGMENT_PX]
        outer = [c for _, c in sorted(large, key=lambda one: -one[0])[:_MAX_FRAGMENTS]]
    if len(outer) < 2:
        return [[c] for c in outer]
    # Parts of one gate are joined by what hides the rest of it, or are so near that noise parted them.
    joined = cv2.dilate(crop, np.ones((3, 3), np.uint8))
    for other in others:
        cv2.bitwise_or(joined, other.mask[row : row + rows, column : column + columns], dst=joined)
    _, labels = cv2.connectedComponents(joined)
    groups: dict[int, list[_Contour]] = {}
    for contour in outer:
        x, y = contour[0, 0]
        groups.setdefault(int(labels[y - row, x - column]), []).append(contour)
    return list(groups.values())


def _signed_angle(pose: GatePose) -> float:
    """Angle of the line of sight to the normal, degrees, positive if flying left makes it smaller."""
    ahead, left, up = pose.position_flu_m
    along = -(ahead * pose.normal_flu[0] + left * pose.normal_flu[1] + up * pose.normal_flu[2])
    angle = degrees(acos(max(-1.0, min(1.0, along / hypot(ahead, left, up)))))
    return copysign(angle, left + along * pose.normal_flu[1])


def _obstacle_edges(mask: ColourMask, others: Sequence[ColourMask]) -> tuple[ObstacleEdge, ...]:
    """Where the obstacles end below, in every eighth column."""
    height, width = mask.mask.shape
    column, row, columns, rows = mask.box
    left, right = max(column - 2, 0), min(column + columns + 2, width)
    crop = mask.mask[row : row + rows, left:right] != 0
    lowest = np.where(crop.any(axis=0), row + rows - 1 - crop[::-1].argmax(axis=0), -1)
    # At the slanted side of an obstacle the next column ends much lower.
    beside = np.full_like(lowest, -1)
    for away in (1, 2):
        reach = lowest - _STEEP * away
        beside[away:] = np.maximum(beside[away:], reach[:-away])
        beside[:-away] = np.maximum(beside[:-away], reach[away:])
    first = -(-column // _OBSTACLE_STEP) * _OBSTACLE_STEP
    looked_at = slice(first - left, column + columns - left, _OBSTACLE_STEP)
    found = (values[looked_at].tolist() for values in (crop.sum(axis=0), lowest, beside))
    edges = []
    for index, (count, last, ends_beside) in enumerate(zip(*found, strict=True)):
        if count < _MIN_RUN_PX:  # noise
            continue
        x = first + index * _OBSTACLE_STEP
        cut = (
            last >= height - 1
            or ends_beside > last
            or any(other.mask[last + 1 : last + 3, x].any() for other in others)
        )
        edges.append(ObstacleEdge(x - (width - 1) / 2, last + 0.5 - (height - 1) / 2, cut))
    return tuple(edges)


def _straight_edges(edges: Sequence[ObstacleEdge], lens: Lens) -> tuple[ObstacleEdge, ...]:
    """Obstacle edges as an ideal camera would see them."""
    places = lens.ideal(np.array([(edge.right_px, edge.down_px) for edge in edges]).reshape(-1, 2))
    return tuple(
        replace(edge, right_px=right, down_px=down)
        for edge, (right, down) in zip(edges, places.tolist(), strict=True)
    )
