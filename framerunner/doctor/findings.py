"""A finding about a drone: what is the case, how much it matters, and what to do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum


class Level(Enum):
    """How much a finding matters."""

    GOOD = "good"
    NOTE = "note"
    MISSING = "missing"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing about the drone: a subject, what is the case, and what to do, which is empty if nothing."""

    level: Level
    subject: str
    text: str
    advice: str = ""


Findings = Iterator[Finding]
