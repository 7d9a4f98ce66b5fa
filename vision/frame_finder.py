"""Find frames by their shape: corners and poses of every frame in an image, and the feet of obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import acos, copysign, degrees, hypot

import cv2
import numpy as np
import numpy.typing as npt

from vision.bar_edges import FOREIGN, BarEdges, find_edges
from vision.bar_lines import BarLines, Meeting, fit_lines, meeting
from vision.colour_regions import OBSTACLE, PRIMARIES, ColourMask, find_colours
from vision.detector import measure
from vision.frame_model import AXES_CORNERS, OUTER_CORNERS, Floats, ModelPose, Point, Sides, bar_offsets
from vision.frame_pose import as_seen, find_poses
from vision.outer_sides import outer_sides
from vision.types import (
    NOT_SEEN,
    Detection,
    Detections,
    FrameCorner,
    FramePose,
    FrameSighting,
    Image,
    ObstacleEdge,
)

_Plane = npt.NDArray[np.uint8]
_Contour = npt.NDArray[np.int32]
_Box = tuple[int, int, int, int]

PAINTED_SPREAD_PX = 0.5
"""How much larger than true the simulator paints on each side: a border is on the nearest pixels."""

_OBSTACLE_STEP = 8
_MIN_FRAGMENT_PX = 3
_MAX_FRAGMENTS = 12
_MAX_CORNER_STD_PX = 1.5


class FrameFinder:
    """Finds frames of known size by colour and shape.

    Args:
        focal_px: focal length of the camera; its optical axis is in the middle of the image.
        spread_px: how much larger than true a region looks on each side: `PAINTED_SPREAD_PX` for images of
            the simulator, 0 for those of a real camera.
    """

    def __init__(self, focal_px: float, spread_px: float = 0.0) -> None:
        self._focal_px = focal_px
        self._spread_px = spread_px

    def find(self, image: Image, time_us: int | None = None) -> Detections:
        """Find all frames and obstacles.

        Args:
            image: BGR, shape (height, width, 3), uint8.
            time_us: vehicle time of the image, passed on.

        Returns:
            The frames by shape, the obstacles' lower ends, and for the largest region of red, green and blue
            the paper's six numbers with the signed angle.

        Raises:
            ValueError: the image is not of that shape and type.
        """
        masks = find_colours(image)
        if not masks:
            return Detections(time_us=time_us)
        sightings: list[FrameSighting] = []
        boxes: dict[str, Detection] = {}
        edges: tuple[ObstacleEdge, ...] = ()
        for mask in masks:
            others = [other for other in masks if other is not mask]
            if mask.colour == OBSTACLE:
                edges = _obstacle_edges(mask, others)
                continue
            found, box = self._find_colour(mask, others)
            sightings += found
            if mask.colour in PRIMARIES:
                boxes[mask.colour] = box
        return Detections(
            red=boxes.get("red", NOT_SEEN),
            green=boxes.get("green", NOT_SEEN),
            blue=boxes.get("blue", NOT_SEEN),
            time_us=time_us,
            frames=tuple(sightings),
            obstacle_edges=edges,
        )

    def _find_colour(
        self, mask: ColourMask, others: Sequence[ColourMask]
    ) -> tuple[list[FrameSighting], Detection]:
        """The frames of one colour, and the paper's numbers of the largest one."""
        found: list[tuple[_Box, FrameSighting]] = []
        for group in _groups(mask, others):
            sighting = self._sighting(mask, others, np.concatenate(group))
            if sighting is not None:
                found.append(sighting)
            elif len(group) > 1:
                alone = (self._sighting(mask, others, fragment) for fragment in group)
                found += [one for one in alone if one is not None]
        if not found:
            return [], NOT_SEEN
        height, width = mask.mask.shape
        box, largest = max(found, key=lambda one: one[0][2] * one[0][3])
        numbers = measure(
            box[1] + 1, box[1] + box[3], box[0] + 1, box[0] + box[2],
            width_px=width, height_px=height, focal_px=self._focal_px,
        )  # fmt: skip
        if largest.poses:
            numbers = replace(numbers, signed_a=_signed_angle(largest.poses[0]))
        return [sighting for _, sighting in found], numbers

    def _sighting(
        self, mask: ColourMask, others: Sequence[ColourMask], points: _Contour
    ) -> tuple[_Box, FrameSighting] | None:
        """The frame that a group of fragments shows, if it is one."""
        height, width = mask.mask.shape
        sides = outer_sides(points, width, height)
        if sides is None:
            return None
        box = _bounding_box(points)
        margin = 6 + max(box[2:]) // 4
        left, top = box[0] - margin, box[1] - margin
        edges = find_edges(_labels(mask, others, box, margin), _shifted(sides, -left, -top), self._spread_px)
        origin = ((width - 1) / 2 - left, (height - 1) / 2 - top)
        lines, meetings, poses = self._fit(edges, origin, max(box[2:]))
        if not poses:
            return None
        corners = _outer_corners(meetings, poses[0], origin, self._focal_px)
        if not any(corners):
            return None
        whole = _is_whole(lines, box, width, height)
        return box, FrameSighting(mask.colour, corners, whole, tuple(map(as_seen, poses)))

    def _fit(
        self, edges: BarEdges, origin: Point, size_px: int
    ) -> tuple[BarLines, list[Meeting | None], list[ModelPose]]:
        """The axes of the bars, where they meet (of sides k - 1 and k) and the poses that follow.

        The optical axis is at `origin` of the labelled image.
        """
        offsets: Floats | None = None
        poses: list[ModelPose] = []
        for _ in range(2):
            lines = fit_lines(edges, self._focal_px, offsets)
            meetings = [meeting(lines[k - 1], lines[k]) for k in range(4)]
            known = [(m.x - origin[0], m.y - origin[1]) for m in meetings if m is not None]
            if len(known) < 4:
                break
            poses = find_poses(known, self._focal_px, 0.6 + 0.02 * size_px)
            if not poses:
                break
            offsets = self._offsets(edges, poses[0], origin)
            if offsets is None:
                break
        return lines, meetings, poses

    def _offsets(self, edges: BarEdges, pose: ModelPose, origin: Point) -> Floats | None:
        """Where the edges of the bars should be beside their axes, as painted."""
        spans = edges.spans - np.array([[origin[steep]] for steep in edges.steep])
        offsets = bar_offsets(pose, edges.steep, edges.inward, spans, self._focal_px)
        if offsets is None:
            return None
        offsets[:, 0] -= self._spread_px
        offsets[:, 1] += self._spread_px
        return offsets


def _bounding_box(points: _Contour) -> _Box:
    column, row, columns, rows = cv2.boundingRect(points)
    return (column, row, columns, rows)


def _groups(mask: ColourMask, others: Sequence[ColourMask]) -> list[list[_Contour]]:
    """The outlines of a colour's fragments; those that may be parts of one frame together."""
    column, row, columns, rows = mask.box
    crop = mask.mask[row : row + rows, column : column + columns]
    contours, hierarchy = cv2.findContours(
        crop, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE, offset=(column, row)
    )
    outer = [c for c, links in zip(contours, hierarchy[0], strict=True) if links[3] < 0]
    if len(outer) > 1:
        outer = [c for c in outer if max(_bounding_box(c)[2:]) >= _MIN_FRAGMENT_PX]
        outer = sorted(outer, key=lambda c: -max(_bounding_box(c)[2:]))[:_MAX_FRAGMENTS]
    if len(outer) < 2:
        return [[c] for c in outer]
    # Parts of one frame are joined by what hides the rest of it, or are so near that noise parted them.
    joined = cv2.dilate(crop, np.ones((3, 3), np.uint8))
    for other in others:
        cv2.bitwise_or(joined, other.mask[row : row + rows, column : column + columns], dst=joined)
    _, labels = cv2.connectedComponents(joined)
    groups: dict[int, list[_Contour]] = {}
    for contour in outer:
        x, y = contour[0, 0]
        groups.setdefault(int(labels[y - row, x - column]), []).append(contour)
    return list(groups.values())


def _labels(mask: ColourMask, others: Sequence[ColourMask], box: _Box, margin: int) -> _Plane:
    """The pixels around a box: of the colour, foreign (also what is outside the image), or background."""
    height, width = mask.mask.shape
    column, row, columns, rows = box
    labels = np.full((rows + 2 * margin, columns + 2 * margin), FOREIGN, np.uint8)
    x0, y0 = max(column - margin, 0), max(row - margin, 0)
    x1, y1 = min(column + columns + margin, width), min(row + rows + margin, height)
    inside = labels[y0 - row + margin : y1 - row + margin, x0 - column + margin : x1 - column + margin]
    np.bitwise_and(mask.mask[y0:y1, x0:x1], 1, out=inside)
    for other in others:
        left, top, wide, high = other.box
        if left < x1 and top < y1 and left + wide > x0 and top + high > y0:
            inside |= other.mask[y0:y1, x0:x1] & FOREIGN
    return labels


def _shifted(sides: Sides, dx: float, dy: float) -> Sides:
    moved = [
        None if side is None else ((side[0][0] + dx, side[0][1] + dy), (side[1][0] + dx, side[1][1] + dy))
        for side in sides
    ]
    return (moved[0], moved[1], moved[2], moved[3])


def _outer_corners(
    meetings: list[Meeting | None], pose: ModelPose, origin: Point, focal_px: float
) -> tuple[FrameCorner | None, FrameCorner | None, FrameCorner | None, FrameCorner | None]:
    """The corners of the outline in the frame's middle plane, from those of the bars' axes."""
    outer, axes = pose.project(OUTER_CORNERS, focal_px), pose.project(AXES_CORNERS, focal_px)
    corners: list[FrameCorner | None] = [None] * 4
    if outer is not None and axes is not None:
        for k, ((right, down), met) in enumerate(zip((outer - axes).tolist(), meetings, strict=True)):
            if met is not None:
                x, y = met.x - origin[0] + right, met.y - origin[1] + down
                corners[k] = FrameCorner(x, y, met.std_x, met.std_y)
    return (corners[0], corners[1], corners[2], corners[3])


def _is_whole(lines: BarLines, box: _Box, width: int, height: int) -> bool:
    column, row, columns, rows = box
    inside = column > 0 and row > 0 and column + columns < width and row + rows < height
    return inside and all(line is not None and line.seen > 0.99 for line in lines)


def _signed_angle(pose: FramePose) -> float:
    """Angle of the line of sight to the normal, degrees, positive if flying left makes it smaller."""
    ahead, left, up = pose.position_flu_m
    along = -(ahead * pose.normal_flu[0] + left * pose.normal_flu[1] + up * pose.normal_flu[2])
    angle = degrees(acos(max(-1.0, min(1.0, along / hypot(ahead, left, up)))))
    return copysign(angle, left + along * pose.normal_flu[1])


def _obstacle_edges(mask: ColourMask, others: Sequence[ColourMask]) -> tuple[ObstacleEdge, ...]:
    """Where the obstacles end below, in every eighth column."""
    height, width = mask.mask.shape
    column, row, columns, rows = mask.box
    first = -(-column // _OBSTACLE_STEP) * _OBSTACLE_STEP
    crop = mask.mask[row : row + rows, first : column + columns : _OBSTACLE_STEP] != 0
    edges = []
    lowest = row + rows - 1 - crop[::-1].argmax(axis=0)
    counts = crop.sum(axis=0)
    for i, (last, count) in enumerate(zip(lowest.tolist(), counts.tolist(), strict=True)):
        if count < 3:  # noise
            continue
        x = first + i * _OBSTACLE_STEP
        hidden = any(other.mask[last + 1 : last + 3, x].any() for other in others)
        edges.append(
            ObstacleEdge(x - (width - 1) / 2, last + 0.5 - (height - 1) / 2, last >= height - 1 or hidden)
        )
    return tuple(edges)
