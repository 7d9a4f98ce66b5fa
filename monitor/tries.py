"""Tries: when a drone began one, how it goes, how it ended, each told under a key of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True, slots=True)
class TryEvent:
    """A try of a drone began, went on (every second) or ended.

    Attributes:
        kind: what happened. A try may end twice: by the referee, and again, final, by the app's result.
        drone_id: MAVLink system id.
        key: names this try and no other, also after a restart of drone or monitor.
        scenario: its name; "" if unknown.
        report: `RefereeReport.as_dict()`, or the app's `result.json` where `final`.
        source: what the referee saw by: "truth" or "telemetry".
        final: the report is the app's result; nothing else will come for this key.
    """

    kind: Literal["began", "running", "ended"]
    drone_id: int
    key: str
    scenario: str
    report: Mapping[str, Any]
    source: str
    final: bool
