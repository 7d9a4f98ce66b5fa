"""The combination rule: how a team's tries become one number. `docs/competition.md` explains it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace

from framerunner.monitor.competition.views import CellView, Counting, RowView
from scenarios.models import COLOURS
from scenarios.result import RefereeReport

MAX_S = 36_000.0  # longer times are cut to this
MAX_CONTACTS = 1_000


@dataclass(frozen=True, slots=True)
class Rule:
    """What can be set about the rule; fields as in `RuleView`."""

    limit_s: float = 180.0
    missing_frame_s: float = 60.0
    scenarios: int = 3
    counting: Counting = "best"


@dataclass(frozen=True, slots=True)
class TryScore:
    """What a try was worth, as the referee or a judge says."""

    frames: tuple[str, ...]  # colours to cross, in order
    crossed: tuple[str, ...]  # those of them that were crossed in the right order
    contacts: int
    penalty_s: float
    try_time_s: float  # motors on to motors off
    completed: bool  # all gates crossed in order, and landed on the base within the limit

    @property
    def missing(self) -> tuple[str, ...]:
        """Gates not crossed in the right order."""
        return tuple(colour for colour in self.frames if colour not in self.crossed)


@dataclass(frozen=True, slots=True)
class Correction:
    """A judge's correction of a try; None is "as the referee says". Fields as in `TryScore`."""

    crossed: tuple[str, ...] | None = None
    contacts: int | None = None
    penalty_s: float | None = None
    try_time_s: float | None = None
    completed: bool | None = None


@dataclass(frozen=True, slots=True)
class Attempt:
    """A judged try of a team."""

    team: int
    scenario: str
    id: int  # of the try; later tries have higher ones
    result: TryScore  # after correction


def read_report(report: RefereeReport | None, frames: Sequence[str]) -> TryScore:
    """Take from a referee's report what counts: all 0 without a report. `frames`: to cross, in order."""
    if report is None:
        return TryScore(tuple(frames), (), 0, 0.0, 0.0, completed=False)
    crossed = crossed_in_order(report.frames_crossed, frames)
    return TryScore(
        tuple(frames),
        crossed,
        min(report.contacts, MAX_CONTACTS),
        min(report.penalty_s, MAX_S),
        min(report.try_time_s, MAX_S),
        report.completed and len(crossed) == len(frames),
    )


def crossed_in_order(crossed: Iterable[str], frames: Sequence[str]) -> tuple[str, ...]:
    """Those of the gates that were crossed after all those before them."""
    passed: list[str] = []
    for colour in crossed:
        if len(passed) < len(frames) and colour == frames[len(passed)]:
            passed.append(colour)
    return tuple(passed)


def correct(result: TryScore, correction: Correction | None) -> TryScore:
    """Apply a judge's correction to the referee's result. A try with a gate missing is never completed."""
    if correction is None:
        return result
    given = {name: value for name, value in asdict(correction).items() if value is not None}
    corrected = replace(result, **given)
    crossed = tuple(colour for colour in result.frames if colour in corrected.crossed)
    return replace(corrected, crossed=crossed, completed=corrected.completed and not corrected.missing)


def counted_cs(result: TryScore, rule: Rule) -> int:
    """What a try counts, in hundredths of a second.

    Whole hundredths, as they are shown: totals that look the same are the same, in whatever order they are
    added.
    """
    if result.completed:
        return round((result.try_time_s + result.penalty_s) * 100)
    return _not_completed_cs(len(result.missing), rule)


def _not_completed_cs(missing: int, rule: Rule) -> int:
    return round(rule.limit_s * 100) + missing * round(rule.missing_frame_s * 100)


def choose(attempts: Iterable[Attempt], rule: Rule) -> Attempt | None:
    """The one of a team's tries at one scenario that counts; None if there is none.

    The best has the lowest count, then the fewest contacts, then the lowest id.
    """
    if rule.counting == "last":
        return max(attempts, key=lambda attempt: attempt.id, default=None)
    return min(
        attempts,
        key=lambda attempt: (counted_cs(attempt.result, rule), attempt.result.contacts, attempt.id),
        default=None,
    )


def rank(
    teams: Mapping[int, str],
    scenarios: Sequence[tuple[str, Sequence[str]]],
    attempts: Iterable[Attempt],
    rule: Rule,
) -> tuple[RowView, ...]:
    """Make the ranking of a round.

    Args:
        teams: name of each, by id.
        scenarios: name and gates of those of the round; those still to be drawn count as not flown, with
            all colours.
        attempts: judged tries; those of other teams or at other scenarios are left out.
        rule: what counts.

    Returns:
        The best first; within a rank by fewer contacts, then by name. Teams with the same total share a
        rank, and the ranks after them are left out. Teams that have not flown have no rank and come last.
    """
    drawn = list(scenarios)[: rule.scenarios]
    drawn += [("", COLOURS)] * (rule.scenarios - len(drawn))
    tries: defaultdict[tuple[int, str], list[Attempt]] = defaultdict(list)
    for attempt in attempts:
        tries[attempt.team, attempt.scenario].append(attempt)
    rows = []
    for team, name in teams.items():
        cells, contacts = [], 0
        for scenario, frames in drawn:
            flown = tries[team, scenario]
            chosen = choose(flown, rule)
            cells.append(_cell(scenario, frames, chosen, len(flown), rule))
            contacts += chosen.result.contacts if chosen is not None else 0
        rows.append(
            RowView(
                rank=None,
                team=team,
                name=name,
                total_s=sum(round(cell.counted_s * 100) for cell in cells) / 100,
                contacts=contacts,
                flown=sum(1 for cell in cells if cell.attempt is not None),
                cells=tuple(cells),
            )
        )
    rows.sort(
        key=lambda row: (not row.flown, row.total_s, row.contacts, row.name.casefold(), row.name, row.team)
    )
    totals = [row.total_s for row in rows if row.flown]
    return tuple(
        row.model_copy(update={"rank": totals.index(row.total_s) + 1}) if row.flown else row for row in rows
    )


def _cell(scenario: str, frames: Sequence[str], attempt: Attempt | None, tries: int, rule: Rule) -> CellView:
    if attempt is None:
        counted_s = _not_completed_cs(len(frames), rule) / 100
        return CellView(
            scenario=scenario, counted_s=counted_s, state="not flown", attempt=None, missing=0, tries=tries
        )
    result = attempt.result
    return CellView(
        scenario=scenario,
        counted_s=counted_cs(result, rule) / 100,
        state="completed" if result.completed else "not completed",
        attempt=attempt.id,
        missing=len(result.missing),
        tries=tries,
    )
