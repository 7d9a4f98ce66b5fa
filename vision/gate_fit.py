"""One gate in one image: its corners and poses, from the pixels of one region.

The axes of the bars are fitted, a pose follows, from that where the edges of the bars should be beside their
axes, and with it the axes are fitted again. What cannot be a gate, or a part of one, is refused: along the
bars' axes there must be nothing but pixels of the region and what may hide it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import acos, hypot, inf, sqrt
from typing import NamedTuple

import numpy as np

from framerunner.geometry.gate_shape import GateShape
from vision.bar_edges import BarEdges, Widths, expected_widths, find_edges
from vision.bar_lines import BarLine, BarLines, Meeting, fit_lines, meeting
from vision.calibration.lens import Lens
from vision.gate_model import Floats, GateModel, ModelPose, Point, Sides
from vision.gate_pose import as_seen, find_poses, poses_of_three
from vision.patch import ImagePatch
from vision.types import GateCorner, GatePose

Corners = tuple[GateCorner | None, GateCorner | None, GateCorner | None, GateCorner | None]
_Meetings = list[Meeting | None]

_MAX_EMPTY = 0.15  # share of a bar where neither the bar nor anything that could hide it is seen
_MAX_OWN_UNSEEN = 0.4  # share of a bar that seems to be seen although it was not found
_WHOLE = 0.9  # share of a bar that is seen if nothing hides it; shaded and thin bars may have gaps
_MAX_CORNER_STD_PX = 2.5
_EDGE_ON, _OBLIQUE = 0.13, 0.23  # cosines: the bars of a gate that is seen edge-on hide one another
_THINNEST_PX = 0.15  # a bar that fills less of a pixel has no colour
_NOTHING, _SOMETHING = 0.35, 0.7  # shares of a side; for the second clearest side
_NO_OPENING, _SPOT = 0.6, 0.4  # shares of a region in the middle of its outline
_LEAST_ERROR_PX = 0.4  # may be between the corners of a pose and of the lines, besides two deviations
_TILT_RAD = 0.2  # standard deviation of the camera's tilt, to tell which sides are upright
_ROUGH = 2.5  # before the bars' edges are corrected by a pose, errors may be larger by this factor
_CLEAR_OPEN, _THIN_PX = 0.7, 3.0
_CLEAR_PX = 4.5  # a side that is shorter may be a part of a longer one
_TOO_NARROW = 1.2
_OPEN_SIDE = 0.5  # share of a bar at which its inner edge is seen, too
# Sides of gates, pixels: from here on some of an opening is seen, at two bars at least, and bars' widths.
_OPENING_SEEN_PX, _OPENING_CLEAR_PX, _BARS_SEEN_PX = 4.0, 9.0, 6.0
_TOO_THIN = (0.3, 0.2)  # half a bar's width may be smaller than expected by so much and this share of it
_TOO_WIDE = (1.3, 0.1)  # or larger: gates that are seen past their edges and blurred ones look so
_TURNING_RAD_S, _FLYING_M_S = 0.5, 0.5  # standard deviations of a camera's motion while a frame is read out
_WIDTH_SHARE, _WIDTH_SHARE_STD = 0.75, 0.15  # of half a bar's image that is half of the bar's width


class FittedGate(NamedTuple):
    """What `vision.types.GateSighting` tells, without the colour; and how likely it is.

    The cost is the sum of squares, in standard deviations, of the corners' distances from the better pose's
    and of the camera's tilt if that is the pose.
    """

    corners: Corners
    whole: bool
    poses: tuple[GatePose, ...]
    cost: float


def fit_gate(patch: ImagePatch, sides: Sides, model: GateModel) -> FittedGate | None:
    """Fit a gate to a region; None if the region is no gate and no sure part of one.

    Args:
        patch: the region.
        sides: first estimates of its outer edges, pixels from the optical axis, from pixel centre to centre.
        model: of the gate.
    """
    if not _may_be_gate(patch, sides, model.shape):
        return None
    if patch.has_foreign and _least_length(sides) >= _CLEAR_PX:
        # It may be behind what is beside it, or in front of that: then four whole bars are seen.
        fitted = _fit_any(patch.in_front(), sides, model)
        if fitted is not None and fitted.whole:
            return fitted
    return _fit_any(patch, sides, model)


def gate_of_axes(axes_corners: Sequence[Point], std_px: float, model: GateModel) -> FittedGate | None:
    """A gate that is seen whole, by where the axes of its bars meet; None if no gate looks so.

    Args:
        axes_corners: upper left, upper right, lower right and lower left, pixels from the optical axis.
        std_px: standard deviation of each of their coordinates.
        model: of the gate.
    """
    meetings: _Meetings = [Meeting(x, y, std_px, std_px) for x, y in axes_corners]
    poses = find_poses(axes_corners, model, _max_error_px(meetings))
    corners = _outer_corners(meetings, poses[0], model, True) if poses else None
    return None if corners is None else _fitted(corners, True, poses, meetings)


def _may_be_gate(patch: ImagePatch, sides: Sides, shape: GateShape) -> bool:
    """Whether there is something along two sides and more, and an opening if it is large enough to be seen.

    Photographs have many regions that are refused by this in a tenth of the time of a fit. The limits let
    through all gates of some thousand images, those of `crowded` and of photographs among them.
    """
    starts: list[Point] = []
    ends: list[Point] = []
    for side, (half_start, half_end) in zip(sides, expected_widths(sides, shape), strict=True):
        if side is not None:
            (x0, y0), (x1, y1) = side
            length = max(hypot(x1 - x0, y1 - y0), 1e-9)
            right, down = (y0 - y1) / length, (x1 - x0) / length  # towards the opening
            from_start, from_end = max(half_start - 0.5, 0.0), max(half_end - 0.5, 0.0)
            starts.append((x0 + from_start * right, y0 + from_start * down))
            ends.append((x1 + from_end * right, y1 + from_end * down))
    support = patch.support(starts, ends)
    if sorted(support.empty)[-2] > _NOTHING or sorted(support.own)[-2] < _SOMETHING:
        return False
    corners = [side[0] for side in sides if side is not None]
    if len(corners) < 4:
        return True
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = corners
    area = 0.5 * abs((x2 - x0) * (y3 - y1) - (x3 - x1) * (y2 - y0))
    longest = max(
        hypot(end[0] - start[0], end[1] - start[1]) for start, end in zip(starts, ends, strict=True)
    )
    if area > _BARS_SEEN_PX * longest:
        return patch.own_share(corners) < _NO_OPENING
    # A spot may be a gate far away, but not one of many.
    return not patch.among_others or patch.own_share(corners) < _SPOT


def _least_length(sides: Sides) -> float:
    """Length of the shortest side, pixels; 0 if one is not seen."""
    return min(
        0.0 if side is None else hypot(side[1][0] - side[0][0], side[1][1] - side[0][1]) for side in sides
    )


def _fit_any(patch: ImagePatch, sides: Sides, model: GateModel) -> FittedGate | None:
    lines, meetings, poses = _fit(patch, sides, model)
    known = [(met.x, met.y) for met in meetings if met is not None]
    if len(known) == 4:
        if poses and not _has_bars(lines, known, poses[0], model):
            return None
        support = patch.support(known, known[1:] + known[:1])
        if max(support.empty) <= _MAX_EMPTY:
            if patch.is_filled(known):
                return None
            whole = min(support.own) >= _WHOLE
            corners = _outer_corners(meetings, poses[0], model, whole) if poses else None
            return None if corners is None else _fitted(corners, whole, poses, meetings)
        a, b, c, d = (
            side if empty <= _MAX_EMPTY else None for side, empty in zip(sides, support.empty, strict=True)
        )
        lines, meetings, poses = _fit(patch, (a, b, c, d), model)
    corners = _outer_corners(meetings, poses[0], model, False) if poses else None
    if corners is None:
        if patch.among_others or not patch.may_be_cut:
            return None  # it is one of many, or nothing explains why no more is seen of it
        corners = _corners_without_pose(patch, lines)
    return _fitted(corners, False, poses, meetings) if any(corners) else None


def _has_bars(lines: BarLines, axes_corners: Sequence[Point], pose: ModelPose, model: GateModel) -> bool:
    """Whether there is an opening where it is large enough to be seen, and the bars are as wide as a gate's.

    Posters and drawn rectangles are not. The limits let through all gates of some thousand images, rendered
    with and without noise and blur.
    """
    known = [line for line in lines if line is not None]
    following = (*axes_corners[1:], axes_corners[0])
    size_px = min(hypot(x1 - x0, y1 - y0) for (x0, y0), (x1, y1) in zip(axes_corners, following, strict=True))
    clear = [k for k, line in enumerate(known) if line.open > _OPEN_SIDE]
    if len(known) < 4 or size_px < _OPENING_SEEN_PX:
        return True
    if len(clear) < (1 if size_px < _OPENING_CLEAR_PX else 2):
        return False
    if size_px < _BARS_SEEN_PX:
        return True
    spans = np.array([(line.first, line.last) for line in known])
    inward = np.array([line.inward for line in known])
    offsets = model.bar_offsets(pose, tuple(line.steep for line in known), inward, spans)
    if offsets is None:
        return True
    half_px = 0.5 * (offsets[:, 1] - offsets[:, 0]).mean(axis=1)[clear]
    wider_px = float(np.mean([known[k].half_px for k in clear]) - half_px.mean())
    expected_px = float(half_px.mean())
    most_px, least_px = (limit + share * expected_px for limit, share in (_TOO_WIDE, _TOO_THIN))
    return -least_px <= wider_px <= most_px


def _fitted(corners: Corners, whole: bool, poses: list[ModelPose], meetings: _Meetings) -> FittedGate:
    deviation_px = 0.5 * (_max_error_px(meetings) - _LEAST_ERROR_PX)
    costs = [
        (pose.error_px / max(deviation_px, 0.1)) ** 2 + (acos(min(1.0, pose.rotation[1, 1])) / _TILT_RAD) ** 2
        for pose in poses
    ]
    return FittedGate(corners, whole, tuple(map(as_seen, poses)), min(costs, default=inf))


def _fit(patch: ImagePatch, sides: Sides, model: GateModel) -> tuple[BarLines, _Meetings, list[ModelPose]]:
    """The axes of the sides, where they meet (sides k - 1 and k) and the poses that follow."""
    edges = find_edges(patch, sides, expected_widths(sides, model.shape))
    lines, meetings, poses = _lines_and_poses(patch, edges, None, (), model)
    if all(line is not None and line.open > _CLEAR_OPEN and line.half_px < _THIN_PX for line in lines):
        # So far away that the middle of a bar's image is its axis.
        return lines, meetings, _explaining(poses, meetings)
    for _ in range(2):
        if not poses:
            break
        offsets = model.bar_offsets(poses[0], edges.steep, edges.inward, edges.spans)
        if offsets is None:
            break
        wider = _wider(edges, offsets)
        lines, meetings, poses = _lines_and_poses(patch, edges, offsets, poses, model)
        if wider is None or not poses:
            break
        edges = find_edges(patch, sides, wider)  # a side that is cut looked like one of a smaller gate
    return lines, meetings, _explaining(poses, meetings)


def _explaining(poses: list[ModelPose], meetings: _Meetings) -> list[ModelPose]:
    """The poses that explain four corners as well as these are known; any pose of fewer corners."""
    limit = _max_error_px(meetings)
    return [pose for pose in poses if None in meetings or pose.error_px <= limit]


def _max_error_px(meetings: _Meetings) -> float:
    mean_square = sum(met.std_x**2 + met.std_y**2 for met in meetings if met is not None) / 4.0
    return _LEAST_ERROR_PX + 2.0 * sqrt(mean_square)


def _wider(edges: BarEdges, offsets: Floats) -> Widths | None:
    """Half the widths of the bars by a pose, if bars that were looked for are too narrow; else None."""
    half_px = 0.5 * (offsets[:, 1] - offsets[:, 0])
    used = edges.used.any(axis=1)
    if not (used & (half_px.max(axis=1) > _TOO_NARROW * edges.half_px.max(axis=1) + 0.5)).any():
        return None
    half_px /= np.hypot(1.0, edges.slope)[:, None]
    forward = edges.forward[:, None]
    ends = np.where(forward, half_px, half_px[:, ::-1])
    return [(start, end) for start, end in ends.tolist()]


def _lines_and_poses(
    patch: ImagePatch, edges: BarEdges, offsets: Floats | None, guesses: Sequence[ModelPose], model: GateModel
) -> tuple[BarLines, _Meetings, list[ModelPose]]:
    lines = [line if _is_sure(line) else None for line in fit_lines(edges, model, offsets)]
    meetings = [meeting(lines[k - 1], lines[k]) for k in range(4)]
    if patch.lens is not None and patch.lens.readout_s > 0.0:
        meetings = _sheared(meetings, patch.lens, model.shape)
    return lines, meetings, _poses(patch, lines, meetings, guesses, model)


def _sheared(meetings: _Meetings, lens: Lens, shape: GateShape) -> _Meetings:
    """Where lines meet, with what a rolling shutter may shear from the first to the last row of a gate."""
    known = [met for met in meetings if met is not None]
    if len(known) < 2:
        return meetings
    rights, downs = [met.x for met in known], [met.y for met in known]
    rows = max(downs) - min(downs)
    width_px = max(max(rights) - min(rights), rows * shape.outer_width_m / shape.outer_height_m)
    # Turning moves all of it alike; flying moves what is near, and widens it.
    nearer_px = _FLYING_M_S * width_px * width_px / (2.0 * shape.outer_width_m * lens.focal_px)
    px = lens.readout_s * rows / lens.size_px[1] * (_TURNING_RAD_S * lens.focal_px + nearer_px)
    return [
        None if met is None else met._replace(std_x=hypot(met.std_x, px), std_y=hypot(met.std_y, px))
        for met in meetings
    ]


def _is_sure(line: BarLine | None) -> bool:
    """Whether enough of a side is seen to know where it is."""
    return line is not None and (line.seen > 0.5 or line.points >= 4)


def _poses(
    patch: ImagePatch, lines: BarLines, meetings: _Meetings, guesses: Sequence[ModelPose], model: GateModel
) -> list[ModelPose]:
    """The poses that explain four or three lines."""
    known = [met for met in meetings if met is not None]
    if len(known) == 4:
        limit = _ROUGH * _max_error_px(meetings)
        return find_poses([(met.x, met.y) for met in known], model, limit)
    if len(known) != 2 or sum(line is not None for line in lines) != 3:
        return []
    missing = lines.index(None)
    forms = [None if line is None else line.normal_form() for line in lines]
    corners = [None if met is None else (met.x, met.y) for met in meetings]
    weights = [_weights(lines[k], meetings[k], meetings[(k + 1) % 4]) for k in range(4)]
    poses = poses_of_three(forms, corners, weights, model, guesses)
    return [pose for pose in poses if _explains(patch, pose, missing, model)]


def _weights(line: BarLine | None, start: Meeting | None, end: Meeting | None) -> tuple[float, float]:
    """How exactly a line is known at its ends, 1/px."""
    if line is None:
        return (0.0, 0.0)
    # An end that is not known is about as far from what was measured as the line is long.
    beyond = line.last - line.first
    unknown = line.var_at + line.var_slope * beyond * beyond
    one, other = (unknown if met is None else line.variance(met.x, met.y) for met in (start, end))
    return (1.0 / sqrt(one), 1.0 / sqrt(other))


def _explains(patch: ImagePatch, pose: ModelPose, missing: int, model: GateModel) -> bool:
    """Whether a pose has the bars where they are seen, and the missing one where it cannot be seen."""
    corners = pose.project(model.axes_corners, model.focal_px)
    if corners is None:
        return False
    places: list[Point] = [(x, y) for x, y in corners.tolist()]
    support = patch.support(places, places[1:] + places[:1])
    return max(support.empty) <= _MAX_EMPTY and support.own[missing] <= _MAX_OWN_UNSEEN


def _outer_corners(meetings: _Meetings, pose: ModelPose, model: GateModel, whole: bool) -> Corners | None:
    """The corners of the outline in the gate's middle plane, from those of the bars' axes."""
    if model.focal_px * model.shape.bar_m < _THINNEST_PX * hypot(*pose.shift_m.tolist()):
        return None
    outer, axes = (
        pose.project(model.outer_corners, model.focal_px),
        pose.project(model.axes_corners, model.focal_px),
    )
    if outer is None or axes is None:
        return None
    beyond = (outer - axes).tolist()
    facing = _facing(pose)
    if facing < _EDGE_ON:
        return None
    if facing < _OBLIQUE:
        meetings = [
            m if m is None else m._replace(std_x=2.0 * m.std_x, std_y=2.0 * m.std_y) for m in meetings
        ]
    found = [
        None if met is None else _corner(met, right, down, whole)
        for met, (right, down) in zip(meetings, beyond, strict=True)
    ]
    return _corners(found) if any(found) else None


def _facing(pose: ModelPose) -> float:
    """Cosine of the angle between the line of sight and the gate's normal."""
    return abs(float(pose.rotation[:, 2] @ pose.shift_m)) / hypot(*pose.shift_m.tolist())


def _corners_without_pose(patch: ImagePatch, lines: BarLines) -> Corners:
    """Corners of the outline if too little of a gate is seen for a pose: where two bars are seen to meet.

    They are half a bar outside the axes. A bar's depth is seen beside its width, how much of it depends on
    the unknown pose.
    """
    found: list[GateCorner | None] = [None] * 4
    for k in range(4):
        before, after = lines[k - 1], lines[k]
        met = meeting(before, after)
        if met is None or before is None or after is None:
            continue
        bars = (before, after)
        if min(bar.open for bar in bars) < 0.3 or min(bar.points for bar in bars) < 4:
            continue
        middles = [_point(bar) for bar in bars]
        if min(patch.support([(met.x, met.y)] * 2, middles).own) < _WHOLE:
            continue
        outer = meeting(_moved_outward(before), _moved_outward(after))
        found[k] = None if outer is None else _corner(outer, 0.0, 0.0, False)
    return _corners(found)


def _point(line: BarLine) -> tuple[float, float]:
    """The middle of what was measured of a line."""
    return (line.at, line.along) if line.steep else (line.along, line.at)


def _moved_outward(line: BarLine) -> BarLine:
    """From the axis of a bar to its outer edge in the gate's middle plane."""
    at = line.at - line.inward * _WIDTH_SHARE * line.half_px
    return line._replace(at=at, var_at=line.var_at + (_WIDTH_SHARE_STD * line.half_px) ** 2)


def _corner(met: Meeting, right_px: float, down_px: float, whole: bool) -> GateCorner | None:
    """A corner as others use it, moved; None if it is not sure and the gate is not seen whole."""
    if not whole and max(met.std_x, met.std_y) > _MAX_CORNER_STD_PX:
        return None
    return GateCorner(met.x + right_px, met.y + down_px, met.std_x, met.std_y)


def _corners(found: list[GateCorner | None]) -> Corners:
    return (found[0], found[1], found[2], found[3])
