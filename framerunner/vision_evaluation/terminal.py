"""What an evaluation of the detectors shows in the terminal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from framerunner.vision_evaluation.scores import (
    ANGLES_DEG,
    DISTANCES_M,
    RATED_ANGLE_DEG,
    RATED_DISTANCE_M,
    ErrorRow,
    Scores,
    rated,
    row_of,
    rows_by,
)

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
    samples = rated(scores.samples)
    total = [row_of(kind, 0.0, 0.0, [s for s in samples if s.kind == kind]) for kind in scores.kinds]
    console.print(_table("detector", [(row.kind, row) for row in total]))
    near = [s for s in scores.samples if s.angle_deg < RATED_ANGLE_DEG]
    rows = rows_by(scores.kinds, near, lambda sample: sample.distance_m, DISTANCES_M)
    console.print(
        _table("by distance", [(f"{row.kind}  {row.low:g} to {row.high:g} m", row) for row in rows])
    )
    rows = rows_by(scores.kinds, samples, lambda sample: sample.angle_deg, ANGLES_DEG)
    console.print(_table("by angle", [(f"{row.kind}  {row.low:g} to {row.high:g}°", row) for row in rows]))
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
