"""How a team's tries become one number: the combination rule, ours; `docs/competition.md` explains it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from scenarios.models import COLOURS
from scenarios.result import RefereeReport

Counting = Literal["best", "last"]

LONGEST_S = 36_000.0  # no time of a try is taken to be longer
MOST_CONTACTS = 1_000


@dataclass(frozen=True, slots=True)
class Rule:
    """What can be set about the rule.

    Attributes:
        limit_s: what a try that is not completed counts at least, seconds.
        missing_frame_s: what it counts more for each frame not crossed in its turn, seconds.
        scenarios: how many make a round.
        counting: which of a team's tries at one scenario counts.
    """

    limit_s: float = 180.0
    missing_frame_s: float = 60.0
    scenarios: int = 3
    counting: Counting = "best"


@dataclass(frozen=True, slots=True)
class TryScore:
    """What a try was worth, as the referee or a judge says.

    Attributes:
        frames: colours to cross, in order.
        crossed: those of them that were crossed in their turn.
        contacts: with frames.
        penalty_s: added to the try time, seconds.
        try_time_s: motors on to motors off, seconds.
        completed: all frames crossed in order, and landed on the base within the limit.
    """

    frames: tuple[str, ...]
    crossed: tuple[str, ...]
    contacts: int
    penalty_s: float
    try_time_s: float
    completed: bool

    @property
    def missing(self) -> tuple[str, ...]:
        """Frames not crossed in their turn."""
        return tuple(colour for colour in self.frames if colour not in self.crossed)


@dataclass(frozen=True, slots=True)
class Correction:
    """What a judge says of a try; None is "as the referee says". Fields as in `TryScore`."""

    crossed: tuple[str, ...] | None = None
    contacts: int | None = None
    penalty_s: float | None = None
    try_time_s: float | None = None
    completed: bool | None = None


@dataclass(frozen=True, slots=True)
class Attempt:
    """A judged try of a team.

    Attributes:
        team: its id.
        scenario: name of what was flown.
        order: grows with time; unique.
        result: after correction.
    """

    team: int
    scenario: str
    order: int
    result: TryScore


@dataclass(frozen=True, slots=True)
class Cell:
    """What a team has at one scenario.

    Attributes:
        scenario: its name; "" where the round has none yet.
        counted_cs: hundredths of a second that it adds to the total.
        attempt: the try that counts; None if the scenario was not flown.
    """

    scenario: str
    counted_cs: int
    attempt: Attempt | None


@dataclass(frozen=True, slots=True)
class RankedTeam:
    """A row of the ranking.

    Attributes:
        rank: from 1; teams with the same total share it, and the ranks after them are left out.
        team: its id.
        name: its name.
        total_cs: hundredths of a second.
        contacts: of the tries that count.
        cells: one for each scenario of the round.
    """

    rank: int
    team: int
    name: str
    total_cs: int
    contacts: int
    cells: tuple[Cell, ...]


def read_report(report: RefereeReport | None, frames: Sequence[str]) -> TryScore:
    """Take from a referee's report what counts.

    Args:
        report: None if nobody judged the try; then all counts 0.
        frames: colours to cross, in order.

    Returns:
        The result. A frame crossed before its turn is not among those crossed.
    """
    if report is None:
        return TryScore(tuple(frames), (), 0, 0.0, 0.0, completed=False)
    crossed = in_turn(report.frames_crossed, frames)
    return TryScore(
        tuple(frames),
        crossed,
        min(report.contacts, MOST_CONTACTS),
        min(report.penalty_s, LONGEST_S),
        min(report.try_time_s, LONGEST_S),
        report.completed and len(crossed) == len(frames),
    )


def in_turn(crossed: Iterable[str], frames: Sequence[str]) -> tuple[str, ...]:
    """Those of the frames crossed that were crossed when it was their turn."""
    passed: list[str] = []
    for colour in crossed:
        if len(passed) < len(frames) and colour == frames[len(passed)]:
            passed.append(frames[len(passed)])
    return tuple(passed)


def correct(result: TryScore, correction: Correction | None) -> TryScore:
    """Lay a judge's correction over what the referee says.

    A try with a frame missing is never completed, whoever says so.
    """
    if correction is None:
        return result
    crossed = result.crossed if correction.crossed is None else correction.crossed
    corrected = replace(
        result,
        crossed=tuple(colour for colour in result.frames if colour in crossed),
        contacts=result.contacts if correction.contacts is None else correction.contacts,
        penalty_s=result.penalty_s if correction.penalty_s is None else correction.penalty_s,
        try_time_s=result.try_time_s if correction.try_time_s is None else correction.try_time_s,
        completed=result.completed if correction.completed is None else correction.completed,
    )
    return replace(corrected, completed=corrected.completed and not corrected.missing)


def counted_cs(result: TryScore, rule: Rule) -> int:
    """What a try counts, in hundredths of a second.

    Whole hundredths, as they are shown: totals that look the same are the same, in whatever order they are
    added.
    """
    if result.completed:
        return round((result.try_time_s + result.penalty_s) * 100)
    return not_completed_cs(len(result.missing), rule)


def not_completed_cs(missing: int, rule: Rule) -> int:
    """What a try that is not completed counts, in hundredths of a second."""
    return round(rule.limit_s * 100) + missing * round(rule.missing_frame_s * 100)


def choose(attempts: Iterable[Attempt], rule: Rule) -> Attempt | None:
    """The one of a team's tries at one scenario that counts; None if there is none.

    The best has the lowest count, then the fewest contacts, then came first.
    """
    if rule.counting == "last":
        return max(attempts, key=lambda attempt: attempt.order, default=None)
    return min(
        attempts,
        key=lambda attempt: (counted_cs(attempt.result, rule), attempt.result.contacts, attempt.order),
        default=None,
    )


def rank(
    teams: Mapping[int, str],
    scenarios: Sequence[tuple[str, Sequence[str]]],
    attempts: Iterable[Attempt],
    rule: Rule,
) -> list[RankedTeam]:
    """Make the ranking.

    Args:
        teams: name of each, by id.
        scenarios: name and frames of those of the round; those still to be drawn count as not flown, with
            all colours.
        attempts: judged tries; those of other teams or at other scenarios are left out.
        rule: what counts.

    Returns:
        The best first; within a rank by fewer contacts, then by name.
    """
    drawn = list(scenarios)[: rule.scenarios]
    drawn += [("", COLOURS)] * (rule.scenarios - len(drawn))
    tries: dict[tuple[int, str], list[Attempt]] = {}
    for attempt in attempts:
        tries.setdefault((attempt.team, attempt.scenario), []).append(attempt)
    rows = []
    for team, name in teams.items():
        cells = tuple(
            _cell(tries.get((team, scenario), []), scenario, frames, rule) for scenario, frames in drawn
        )
        contacts = sum(cell.attempt.result.contacts for cell in cells if cell.attempt is not None)
        rows.append(RankedTeam(0, team, name, sum(cell.counted_cs for cell in cells), contacts, cells))
    rows.sort(key=lambda row: (row.total_cs, row.contacts, row.name.casefold(), row.name, row.team))
    totals = [row.total_cs for row in rows]
    return [replace(row, rank=totals.index(row.total_cs) + 1) for row in rows]


def _cell(attempts: list[Attempt], scenario: str, frames: Sequence[str], rule: Rule) -> Cell:
    attempt = choose(attempts, rule)
    if attempt is None:
        return Cell(scenario, not_completed_cs(len(frames), rule), None)
    return Cell(scenario, counted_cs(attempt.result, rule), attempt)
