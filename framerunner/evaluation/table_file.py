"""`results.csv`: a row a flight, the same to the last byte whenever the same is flown."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from io import StringIO

from framerunner.evaluation.rows import COLUMNS, ERROR, Row
from scenarios.spreadsheet import cell

_OF_ERRORS = ("scenario", "mission", "seed", "verdict", "reason", "version")


def csv_text(rows: Iterable[Row]) -> str:
    """The rows as comma-separated values with a header line.

    Lists are joined by ";", times in states are written "turning=2.5;crossing=4", what is not known is empty.

    Args:
        rows: in the order in which they are to stand.
    """
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows:
        writer.writerow([_cell(row, name) for name in COLUMNS])
    return text.getvalue()


def _cell(row: Row, name: str) -> str:
    if row.verdict == ERROR and name not in _OF_ERRORS:
        return ""  # it was not flown to its end: its numbers would be no results
    value = getattr(row, name)
    if isinstance(value, Mapping):
        return ";".join(f"{cell(key)}={number}" for key, number in value.items())
    if isinstance(value, tuple):
        return ";".join(cell(part) if isinstance(part, str) else str(part) for part in value)
    if isinstance(value, str):
        return cell(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else str(value)
