"""How a try stands, whoever says so: the figures for the pages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

from scenarios.report import RefereeSnapshot

JsonMessage = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Standing:
    """What a referee says.

    Attributes:
        scenario: its name; "" if unknown.
        source: what the referee sees by: "truth" or "telemetry".
        snapshot: how the try stands.
        report: what it would be worth if it ended now, as in `result.json`.
    """

    scenario: str
    source: str
    snapshot: RefereeSnapshot
    report: Mapping[str, Any]

    @property
    def ended(self) -> bool:
        """Nothing more comes of this try: judged, or the motors off and at rest."""
        now = self.snapshot
        return now.began_us is not None and (now.over or (now.settled and not now.motors_on))


def figures(
    standing: Standing | None, result: Mapping[str, Any] | None, limit_s: float | None
) -> JsonMessage | None:
    """The Game Monitor's figures.

    Args:
        standing: how the try stands; None: nobody says.
        result: the app's `result.json` of this very try; then its numbers count.
        limit_s: longest try; None: not known.

    Returns:
        As `docs/monitor-channels.md` says; None if nothing is known.
    """
    if standing is None and result is None:
        return None
    told = _of_standing(standing) if standing is not None else _NOTHING
    if result is not None:
        told = {**told, **_of_result(result)}
    time_s = told["try_time_s"]
    late = limit_s is not None and isinstance(time_s, int | float) and time_s >= limit_s
    return {**told, "limit_s": limit_s, "time_over": late, "final": result is not None}


_NOTHING: JsonMessage = {
    "try_time_s": None,
    "penalty_s": None,
    "total_time_s": None,
    "crossed": [],
    "crossing_times_s": [],
    "next_colour": None,
    "contacts": None,
    "inside": True,
    "motors_on": False,
    "over": True,
    "verdict": "",
    "reason": "",
    "source": "",
}


def _of_standing(standing: Standing) -> JsonMessage:
    now, report = standing.snapshot, standing.report
    return {
        "try_time_s": now.try_time_s,
        "penalty_s": now.penalty_s,
        "total_time_s": now.try_time_s + now.penalty_s,
        "crossed": list(now.crossed),
        "crossing_times_s": list(report.get("crossing_times_s", ())),
        "next_colour": now.next_colour,
        "contacts": now.contacts,
        "inside": now.inside,
        "motors_on": now.motors_on,
        "over": now.over,
        # While the try is flown a verdict would only say that it is not over.
        "verdict": str(report.get("verdict", "")) if standing.ended else "",
        "reason": str(report.get("reason", "")) if standing.ended else "",
        "source": standing.source,
    }


def _of_result(result: Mapping[str, Any]) -> JsonMessage:
    return {
        "try_time_s": result.get("try_time_s"),
        "penalty_s": result.get("penalty_s"),
        "total_time_s": result.get("total_time_s"),
        "crossed": list(result.get("frames_crossed") or ()),
        "crossing_times_s": list(result.get("crossing_times_s") or ()),
        "contacts": result.get("contacts"),
        "over": True,
        "verdict": str(result.get("verdict", "")),
        "reason": str(result.get("reason", "")),
        "source": str(result.get("judged_by", "")),
    }


def number(content: Mapping[str, Any], field: str) -> float | None:
    """A finite number in a document from outside; None if there is none."""
    value = content.get(field)
    usable = isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
    return float(value) if usable and value is not None else None
