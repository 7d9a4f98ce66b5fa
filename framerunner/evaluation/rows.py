"""What is kept of a flight: one row, with the columns of `result.json`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Self

from framerunner.runs.pictures import Track
from scenarios.verdict import Verdict

ERROR = "error"
"""Instead of a verdict: the flight was broken off by a fault of the program, not of the drone."""
LANDED = (Verdict.CLEAN.value, Verdict.COMPLETED.value)
"""Verdicts of flights that did the whole task within the limit."""
VERDICTS = (*(verdict.value for verdict in Verdict), ERROR)
"""All that stands in the column `verdict`, best first."""
_NOT_COLUMNS = ("track", "traceback")
_ADDED_LATER = ("kept_in_box_s",)  # columns that older evaluations do not have


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A flight that is over. Columns have the names and units of `result.json`.

    Attributes:
        track: where the drone was, thinned out; only of flights that failed, and not in the files of rows.
        traceback: of the fault that broke the flight off; empty if there was none, not in the files of rows.
    """

    scenario: str
    mission: str
    seed: int
    verdict: str
    reason: str
    frames_crossed: tuple[str, ...] = ()
    crossing_times_s: tuple[float, ...] = ()
    crossing_offsets_m: tuple[float, ...] = ()
    crossing_sides: tuple[str, ...] = ()
    contacts: int = 0
    contact_frames: tuple[str, ...] = ()
    outside_s: float = 0.0
    try_time_s: float = 0.0
    penalty_s: float = 0.0
    total_time_s: float = 0.0
    landed_on_base: bool = False
    landing_error_m: float | None = None
    path_length_m: float = 0.0
    ignored_states: int = 0
    longest_gap_s: float = 0.0
    mission_state: str = ""
    ended: str = ERROR
    seconds_in_state: Mapping[str, float] = field(default_factory=dict)
    kept_in_box_s: float = 0.0
    judged_by: str = ""
    state_sha256: str = ""
    version: str = ""
    track: Track | None = field(default=None, compare=False, repr=False)
    traceback: str = field(default="", compare=False, repr=False)

    @property
    def landed(self) -> bool:
        """All frames crossed in order and landed on the base in time."""
        return self.verdict in LANDED

    @property
    def cause(self) -> str:
        """Where or by what a flight came to its end: the mission's state, or the kind of fault."""
        return self.reason.partition(":")[0] if self.verdict == ERROR else self.mission_state

    @classmethod
    def from_result(cls, result: Mapping[str, Any], track: Track | None = None) -> Self:
        """Read it from the content of `result.json`; what has no column is left out.

        Args:
            result: plain data.
            track: see the attribute.

        Raises:
            KeyError: a column is missing.
        """
        values = {name: result[name] for name in COLUMNS if name in result or name not in _ADDED_LATER}
        plain: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value for name, value in values.items()
        }
        return cls(**plain, track=track)

    def as_dict(self) -> dict[str, Any]:
        """The columns, in order."""
        return {name: getattr(self, name) for name in COLUMNS}

    def to_json(self) -> str:
        """The columns as one line.

        Raises:
            ValueError: a number is not finite.
        """
        return json.dumps(self.as_dict(), allow_nan=False)

    @classmethod
    def from_json(cls, line: str) -> Self:
        """Read what `to_json` wrote.

        Raises:
            ValueError: it is not such a line.
        """
        try:
            return cls.from_result(json.loads(line))
        except (KeyError, TypeError) as error:
            raise ValueError(f"not a flight's row: {error}") from None


COLUMNS = tuple(part.name for part in fields(Row) if part.name not in _NOT_COLUMNS)
