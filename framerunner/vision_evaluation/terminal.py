"""What an evaluation of the detectors shows in the terminal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from framerunner.vision_evaluation.scores import RATED_ANGLE_DEG, RATED_DISTANCE_M, ErrorRow, Scores

_ERRORS = ("distance", "95 %", "bearing", "tilt", "95 %", "first right", "corners / std", "> 4 std")


def print_scores(scores: Scores, title: str) -> None:
    """Print rates and errors of the detectors to standard output."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = max(console.width, 130)  # a pipe has no width; do not cut what is written to a file
    console.print(f"{title}: {scores.images} images", markup=False)
    console.print(
        f"wholly in view, up to {RATED_DISTANCE_M:g} m and {RATED_ANGLE_DEG:g}° off the normal", markup=False
    )
    console.print(_table("detector", [(row.kind, row) for row in scores.in_sum()]))
    for what, unit, rows in (("distance", " m", scores.by_distance()), ("angle", "°", scores.by_angle())):
        named = [(f"{row.kind}  {row.low:g} to {row.high:g}{unit}", row) for row in rows]
        console.print(_table(f"by {what}", named))
    for kind in scores.kinds:
        times_ms = np.percentile(scores.times_ms[kind], (50, 95))
        console.print(
            f"{kind}: {scores.false_alarms[kind]} false alarms, "
            f"{times_ms[0]:.2f} ms an image (95 %: {times_ms[1]:.2f} ms)",
            markup=False,
        )


def _table(title: str, rows: Sequence[tuple[str, ErrorRow]]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column(title, no_wrap=True)
    for column in ("frames", "found", *_ERRORS):
        table.add_column(column, justify="right")
    for name, row in rows:
        if row.frames:
            table.add_row(name, str(row.frames), *_cells(row))
    return table


def _cells(row: ErrorRow) -> list[str]:
    return [
        _cell(row.found, 100.0, ".1f", " %"),
        _cell(row.distance_median, 100.0, ".2f", " %"),
        _cell(row.distance_p95, 100.0, ".1f", " %"),
        _cell(row.bearing_median_deg, 1.0, ".2f", "°"),
        _cell(row.tilt_median_deg, 1.0, ".1f", "°"),
        _cell(row.tilt_p95_deg, 1.0, ".1f", "°"),
        _cell(row.first_is_right, 100.0, ".0f", " %"),
        _cell(row.deviation_rms, 1.0, ".2f", ""),
        _cell(row.outliers, 100.0, ".2f", " %"),
    ]


def _cell(number: float | None, factor: float, form: str, unit: str) -> str:
    return "-" if number is None else f"{factor * number:{form}}{unit}"
