"""One check of a drone, before arming too: what was found, what is allowed, what to do."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from enum import Enum

from framerunner.errors import SettingError

ALL = "all"
"""Instead of a name: accepts every check that fails."""


class Outcome(Enum):
    """What a check means for arming."""

    PASS = "pass"
    NOTE = "note"  # nothing prevents arming, but the operator must know it
    FAIL = "FAIL"  # prevents arming
    ACCEPTED = "accepted"  # failed, and the operator accepts it by its name


@dataclass(frozen=True, slots=True)
class Check:
    """One check of one thing.

    Attributes:
        name: by which an operator may accept its failure.
        outcome: what it means.
        value: what was found, with its unit.
        limit: what is allowed; empty if there is no number.
        advice: what to do; empty if nothing.
    """

    name: str
    outcome: Outcome
    value: str
    limit: str = ""
    advice: str = ""

    @property
    def line(self) -> str:
        """The check in one line for people."""
        limit = f" (allowed: {self.limit})" if self.limit else ""
        advice = f"; {self.advice}" if self.advice else ""
        return f"{self.outcome.value:8s} {self.name}: {self.value}{limit}{advice}"


Checks = Iterator[Check]


def good(name: str, value: str, advice: str = "") -> Check:
    """Nothing is wrong."""
    return Check(name, Outcome.PASS, value, advice=advice)


def note(name: str, value: str, advice: str = "") -> Check:
    """Worth knowing."""
    return Check(name, Outcome.NOTE, value, advice=advice)


def missing(name: str, value: str, advice: str = "") -> Check:
    """Something that a flight needs is missing."""
    return Check(name, Outcome.FAIL, value, advice=advice)


def passed(name: str, good: bool, value: str, limit: str, advice: str) -> Check:
    """A check that passes or fails; the advice is of one that fails."""
    if good:
        return Check(name, Outcome.PASS, value, limit)
    return Check(name, Outcome.FAIL, value, limit, advice)


def failures(checks: Iterable[Check]) -> list[Check]:
    """Those that prevent arming."""
    return [check for check in checks if check.outcome is Outcome.FAIL]


def check_names(names: Iterable[str], known: Iterable[str]) -> None:
    """Raise SettingError if a name that the operator accepts is no check's, before any check is run.

    Args:
        names: that the operator gave.
        known: of all checks that there are.
    """
    listed = sorted(known, key=str.lower)
    for name in names:
        if name != ALL and name not in listed:
            near = get_close_matches(name, listed, 1)
            hint = f"; use {near[0]}" if near else ""
            raise SettingError(
                f"--accept {name!r}: there is no such check{hint}; the checks are {', '.join(listed)}, "
                f"and {ALL} accepts each"
            )


def accept(checks: Sequence[Check], names: Sequence[str]) -> list[Check]:
    """The checks with those failures accepted that the operator named."""
    return [
        replace(check, outcome=Outcome.ACCEPTED)
        if check.outcome is Outcome.FAIL and (check.name in names or ALL in names)
        else check
        for check in checks
    ]
