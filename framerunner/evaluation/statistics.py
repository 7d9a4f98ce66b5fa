"""Counts, rates and spreads of an evaluation's flights."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean, quantiles

from framerunner.evaluation.rows import EvaluationRow
from scenarios.models import COLOURS
from scenarios.verdict import Verdict

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Rate:
    """`count` of `total` flights, with the 95 % confidence interval of the true rate, 0 to 1."""

    count: int
    total: int
    low: float
    high: float

    @property
    def share(self) -> float:
        """From 0 to 1; 0 if the total is 0."""
        return self.count / self.total if self.total else 0.0

    def __str__(self) -> str:
        """Such as "78.0 % (71.8 to 83.2)"."""
        return f"{100 * self.share:.1f} % ({100 * self.low:.1f} to {100 * self.high:.1f})"


@dataclass(frozen=True, slots=True)
class Spread:
    """The distribution of some numbers: mean and the 10th, 50th and 90th percentile."""

    count: int
    mean: float
    p10: float
    median: float
    p90: float


@dataclass(frozen=True, slots=True)
class FailureCause:
    """Flights that were not clean, with the verdict and the `EvaluationRow.ended_in` in common."""

    verdict: str
    ended_in: str
    rows: tuple[EvaluationRow, ...]


@dataclass(frozen=True, slots=True)
class Summary:
    """What an evaluation found.

    Attributes:
        flights: how many.
        landed: clean or completed: the whole task within the time limit.
        verdicts: by verdict, best first; only those that occurred.
        try_time_s: of flights that landed; None if none did.
        times_bound: the same, each as a multiple of its bound; None if no bound is known.
        offset_m: of crossings, by the gate's colour; only those that were crossed.
        landing_error_m: of flights that landed; None if none did.
        penalised: flights that were outside the arena.
        seconds_in_state: mean over all flights without an error, by kind of state, longest first.
        causes: of flights that were not clean, failures first, then most frequent first.
        faults_as_expected: of flights with a fault that the fault table has, those that ended as it says;
            None if there were none.
        with_false_gates: of flights with a map, those on whose map a certain gate was none; None if no
            flight had a map.
    """

    flights: int
    landed: Rate
    verdicts: dict[str, Rate]
    try_time_s: Spread | None
    times_bound: Spread | None
    offset_m: dict[str, Spread]
    landing_error_m: Spread | None
    penalised: Rate
    seconds_in_state: dict[str, float]
    causes: tuple[FailureCause, ...]
    faults_as_expected: Rate | None = None
    with_false_gates: Rate | None = None


def wilson(count: int, total: int) -> Rate:
    """A rate with its interval by Wilson's score, which is valid for few flights and rates near 0 and 1.

    Source: E. B. Wilson, Probable inference, the law of succession, and statistical inference (1927).
    """
    from scipy.stats import binomtest

    if total == 0:
        return Rate(0, 0, 0.0, 1.0)
    interval = binomtest(count, total).proportion_ci(CONFIDENCE, method="wilson")
    return Rate(count, total, float(interval.low), float(interval.high))


def spread(numbers: Sequence[float]) -> Spread | None:
    """The distribution of some numbers; None if there are none."""
    if not numbers:
        return None
    if len(numbers) == 1:
        return Spread(1, *(float(numbers[0]),) * 4)
    tenths = quantiles(numbers, n=10, method="inclusive")
    return Spread(len(numbers), fmean(numbers), tenths[0], tenths[4], tenths[8])


def summarise(rows: Sequence[EvaluationRow]) -> Summary:
    """Count an evaluation's flights."""
    counts = Counter(row.verdict for row in rows)
    landed = [row for row in rows if row.completed]
    flown = [row for row in rows if row.verdict is not Verdict.ERROR]
    offsets = {colour: spread(crossing_offsets_m(flown, colour)) for colour in COLOURS}
    return Summary(
        flights=len(rows),
        landed=wilson(len(landed), len(rows)),
        verdicts={verdict: wilson(counts[verdict], len(rows)) for verdict in Verdict if counts[verdict] > 0},
        try_time_s=spread([row.try_time_s for row in landed]),
        times_bound=spread([row.times_bound for row in landed if row.times_bound is not None]),
        offset_m={colour: found for colour, found in offsets.items() if found is not None},
        landing_error_m=spread([row.landing_error_m for row in landed if row.landing_error_m is not None]),
        penalised=wilson(sum(row.outside_s > 0.0 for row in flown), len(flown)),
        seconds_in_state=mean_seconds_in_state(flown),
        causes=causes(rows),
        faults_as_expected=_faults_as_expected(flown),
        with_false_gates=_with_false_gates(flown),
    )


def _with_false_gates(rows: Sequence[EvaluationRow]) -> Rate | None:
    """Of the flights with a map, those with a false gate on it; None if there were none."""
    counts = [row.false_gates for row in rows if row.false_gates is not None]
    return wilson(sum(count > 0 for count in counts), len(counts)) if counts else None


def _faults_as_expected(rows: Sequence[EvaluationRow]) -> Rate | None:
    judged = [row.fault_outcome == "as expected" for row in rows if row.fault_outcome]
    return wilson(sum(judged), len(judged)) if judged else None


def crossing_offsets_m(rows: Iterable[EvaluationRow], colour: str) -> list[float]:
    """How far from the centre of the gate of a colour it was crossed, in all flights that crossed it."""
    return [
        offset_m
        for row in rows
        for crossed, offset_m in zip(row.frames_crossed, row.crossing_offsets_m, strict=True)
        if crossed == colour
    ]


def mean_seconds_in_state(rows: Sequence[EvaluationRow]) -> dict[str, float]:
    """Mean time in each kind of state, longest first, over all flights, also those that never entered it."""
    sums: Counter[str] = Counter()
    for row in rows:
        sums.update(row.seconds_in_state)
    return {state: seconds / len(rows) for state, seconds in sums.most_common()}


def causes(rows: Iterable[EvaluationRow]) -> tuple[FailureCause, ...]:
    """Flights that were not clean by verdict and end, failures first, then most frequent first."""
    groups: dict[tuple[str, str], list[EvaluationRow]] = {}
    for row in rows:
        if row.verdict is not Verdict.CLEAN:
            groups.setdefault((row.verdict, row.ended_in), []).append(row)
    found = [FailureCause(verdict, ended_in, tuple(group)) for (verdict, ended_in), group in groups.items()]
    return tuple(sorted(found, key=_order))


def _order(cause: FailureCause) -> tuple[bool, int, str, str]:
    return cause.rows[0].completed, -len(cause.rows), cause.verdict, cause.ended_in
