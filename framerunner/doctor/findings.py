"""What the doctor finds."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Level(Enum):
    """How much a finding matters."""

    GOOD = "good"
    NOTE = "note"
    MISSING = "missing"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing about the drone.

    Attributes:
        level: whether the challenge can be flown with it.
        subject: a word or two.
        text: what is the case.
        mend: what to do; empty if nothing.
    """

    level: Level
    subject: str
    text: str
    mend: str = ""


def can_fly(findings: list[Finding]) -> bool:
    """Whether nothing is missing."""
    return all(finding.level is not Level.MISSING for finding in findings)
