"""What is kept of a flight: a row of `flights.jsonl` and of `results.csv`."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

from pydantic import Field

from framerunner.files import spreadsheet
from framerunner.runs.track import Track
from scenarios.result import FlightResult
from scenarios.verdict import Verdict

_REAL_TIME_ONLY = ("lift_m", "timing", "wall_time_s", "real_time_factor", "started")
COLUMNS = tuple(name for name in FlightResult.model_fields if name not in _REAL_TIME_ONLY)
_COLUMNS_OF_ERRORS = (
    "scenario",
    "mission",
    "seed",
    "mission_class",
    "verdict",
    "reason",
    "response",
    "version",
)


class EvaluationRow(FlightResult):
    """The result of a flight of an evaluation; the verdict is `error` if a fault of the program ended it.

    Attributes:
        track: reduced to fewer samples; only of flights that failed, and not in the files of rows.
        traceback: of the fault that ended the flight; empty if there was none, not in the files of rows.
        transitions: how often each was taken, by id; only if asked for, and not in the files of rows.
    """

    track: Track | None = Field(None, exclude=True, repr=False)
    traceback: str = Field("", exclude=True, repr=False)
    transitions: Mapping[str, int] = Field({}, exclude=True, repr=False)

    @property
    def ended_in(self) -> str:
        """Where a flight ended: the mission's state, or the kind of fault."""
        return self.reason.partition(":")[0] if self.verdict is Verdict.ERROR else self.mission_state

    def to_json(self) -> str:
        """The columns as one line, which `model_validate_json` reads."""
        return json.dumps(self.model_dump(mode="json", include=set(COLUMNS)), allow_nan=False)


def csv_text(rows: Iterable[EvaluationRow]) -> str:
    """The rows as comma-separated values with a header line; the same for the same flights.

    Lists are joined by ";", times in states are written "turning=2.5;crossing=4", unknown values are empty.
    """
    return spreadsheet.csv_text(
        COLUMNS, ([_value(row, name) for name in COLUMNS] for row in rows), line_end="\n"
    )


def _value(row: EvaluationRow, name: str) -> object:
    """A value of a row; None if a fault of the program ended the flight: its numbers are no results."""
    is_known = row.verdict is not Verdict.ERROR or name in _COLUMNS_OF_ERRORS
    return getattr(row, name) if is_known else None
