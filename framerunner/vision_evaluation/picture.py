"""The picture of an evaluation of the detectors: rates and errors, and images with what was found in them.

Import this late: matplotlib takes a second.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from framerunner.runs.plots import save_figure
from framerunner.vision_evaluation.scores import ErrorRow, Example, Scores

_STYLES = {"boxes": ("#ee7733", "--", "boxes (the paper's)"), "frames": ("#332288", "-", "frames")}
_CURVES: tuple[tuple[str, Callable[[ErrorRow], float | None]], ...] = (
    ("found (%)", lambda row: _percent(row.found)),
    ("distance error (%), median", lambda row: _percent(row.distance_median)),
    ("tilt error (°), median", lambda row: row.tilt_median_deg),
)
_EXAMPLES = 3


def save_picture(scores: Scores, examples: Sequence[Example], title: str, path: Path) -> None:
    """Draw it to a file.

    Raises:
        PlotError: the file cannot be written.
    """
    figure = Figure(figsize=(12, 9.5), layout="constrained")
    figure.suptitle(f"{title}: {scores.images} images", fontsize=13)
    axes = figure.subplots(3, 3)
    ranges = ((scores.by_distance(), "distance (m)"), (scores.by_angle(), "angle off the normal (°)"))
    for row, (rows, label) in zip(axes, ranges, strict=False):
        for axis, (what, value) in zip(row, _CURVES, strict=True):
            _draw(axis, rows, what, value)
            axis.set_xlabel(label)
            axis.set_ylim(bottom=0)
        row[0].set_ylim(top=105)
    axes[0][0].legend(frameon=False, loc="lower left")
    for axis, example in zip(axes[2], _telling(examples), strict=False):
        _draw_image(axis, example)
    save_figure(figure, path)


def _draw(axes: Axes, rows: Sequence[ErrorRow], what: str, value: Callable[[ErrorRow], float | None]) -> None:
    for kind in dict.fromkeys(row.kind for row in rows):
        colour, dash, name = _STYLES.get(kind, ("#009988", ":" if kind.endswith("boxes") else "-.", kind))
        points = [
            ((row.low + row.high) / 2.0, number)
            for row in rows
            if row.kind == kind and (number := value(row)) is not None
        ]
        axes.plot(
            *zip(*points, strict=True) if points else ([], []), dash, color=colour, marker="o", label=name
        )
    axes.set_title(what, fontsize=10)
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)


def _percent(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def _telling(examples: Sequence[Example]) -> list[Example]:
    """Of some scenes: one with the most gates found, then one missed and one false alarm if there are."""
    clean = [one for one in examples if not (one.missed or one.false)]
    chosen: dict[str, Example] = {}
    for ranked in (
        sorted((one for one in examples if one.missed), key=_nearest_missed_m),
        sorted((one for one in examples if one.false), key=lambda one: -len(one.false)),
        sorted(clean, key=_content, reverse=True),
    ):
        wanted = _EXAMPLES if ranked and not (ranked[0].missed or ranked[0].false) else len(chosen) + 1
        for one in ranked:
            if len(chosen) < wanted:
                chosen.setdefault(one.labelled.scenario, one)
    return list(chosen.values())[::-1]


def _nearest_missed_m(example: Example) -> float:
    return min(label.distance_m for label in example.missed)


def _content(example: Example) -> float:
    return sum(1.0 + 1.0 / label.distance_m for label in example.labelled.gates if label.whole)


def _draw_image(axes: Axes, example: Example) -> None:
    """An image, the corners found with three standard deviations, and the poses' centres.

    The outline of a gate that was missed is dashed, the corners of a false alarm are crosses.
    """
    labelled, found = example.labelled, example.found
    height, width = labelled.image.shape[:2]
    reach = (-width / 2, width / 2, height / 2, -height / 2)
    axes.imshow(cv2.cvtColor(labelled.image, cv2.COLOR_BGR2RGB), extent=reach, interpolation="nearest")
    for label in example.missed:
        outline = Polygon(label.corners_px, fill=False, linestyle="--", edgecolor="white", linewidth=1.0)
        axes.add_patch(outline)
    for sighting in example.false:
        places = [(corner.right_px, corner.down_px) for corner in sighting.corners if corner is not None]
        axes.plot(*zip(*places, strict=True), "x", color="yellow", markersize=9, markeredgewidth=2.0)
    for sighting in found.frames:
        for corner in sighting.corners:
            if corner is not None:
                spread = (3.0 * corner.std_right_px, 3.0 * corner.std_down_px)
                axes.errorbar(
                    corner.right_px, corner.down_px, spread[1], spread[0], color="black", linewidth=1.0
                )
                axes.plot(corner.right_px, corner.down_px, "o", color="white", markersize=6, fillstyle="none")
        if sighting.poses:
            ahead, left, up = sighting.poses[0].position_flu_m
            above = min(corner.down_px for corner in sighting.corners if corner is not None) - 5.0
            distance_m = float(np.hypot(np.hypot(ahead, left), up))
            right = -labelled.focal_px * left / ahead
            axes.text(right, above, f"{distance_m:.2f} m", fontsize=8, ha="center", va="bottom")
    for edge in found.obstacle_edges:
        if not edge.cut:
            axes.plot(edge.right_px, edge.down_px, ".", color="white", markersize=4)
    axes.set_xlim(reach[:2])
    axes.set_ylim(reach[2:])
    axes.set_xticks([])
    axes.set_yticks([])
    words = [labelled.scenario]
    words += [f"{len(example.missed)} missed"] if example.missed else []
    words += [f"{len(example.false)} false"] if example.false else []
    axes.set_title(", ".join(words), fontsize=10)
