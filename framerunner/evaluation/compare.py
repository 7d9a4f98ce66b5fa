"""Two evaluations side by side, flight by flight on the same scenarios."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from statistics import fmean, stdev

from framerunner.errors import SettingError
from framerunner.evaluation.plan import Identity
from framerunner.evaluation.rows import EvaluationRow
from framerunner.evaluation.statistics import CONFIDENCE, Rate, wilson
from framerunner.evaluation.store import EvaluationFolder
from scenarios.verdict import Verdict

_RANK = {Verdict.CLEAN: 2, Verdict.COMPLETED: 1}


@dataclass(frozen=True, slots=True)
class Pair:
    """The flights of one scenario in both evaluations."""

    before: EvaluationRow
    after: EvaluationRow

    @property
    def change(self) -> int:
        """1 better, -1 worse, 0 equal: clean is better than completed, and that than all others."""
        before, after = _RANK.get(self.before.verdict, 0), _RANK.get(self.after.verdict, 0)
        return (after > before) - (after < before)


@dataclass(frozen=True, slots=True)
class MeanDifference:
    """Mean of paired differences with its 95 % confidence interval (Student's t), None with a single pair."""

    count: int
    mean: float
    low: float | None
    high: float | None

    def __str__(self) -> str:
        """Such as "-1.20 s (-2.00 to -0.40)"."""
        between = "" if self.low is None else f" ({self.low:+.2f} to {self.high:+.2f})"
        return f"{self.mean:+.2f} s{between}"


@dataclass(frozen=True, slots=True)
class Comparison:
    """An evaluation compared with an earlier one.

    Attributes:
        path: folder of the earlier one.
        mission: of the earlier one.
        pairs: scenarios flown in both, in order.
        only_after: number of scenarios flown in this one only, or with another content.
        only_before: number of scenarios flown in the earlier one only.
        landed_before: of the pairs.
        landed_after: of the pairs.
        won: number of pairs that landed only in this one.
        lost: number of pairs that landed only in the earlier one.
        p_value: see `mcnemar`.
        try_time_s: of pairs that landed both times, after minus before; None if there are none.
    """

    path: Path
    mission: str
    pairs: tuple[Pair, ...]
    only_after: int
    only_before: int
    landed_before: Rate
    landed_after: Rate
    won: int
    lost: int
    p_value: float
    try_time_s: MeanDifference | None

    @property
    def better(self) -> tuple[Pair, ...]:
        """Pairs with a better verdict now."""
        return tuple(pair for pair in self.pairs if pair.change > 0)

    @property
    def worse(self) -> tuple[Pair, ...]:
        """Pairs with a worse verdict now."""
        return tuple(pair for pair in self.pairs if pair.change < 0)

    @property
    def identical(self) -> int:
        """Number of pairs whose two flights are equal to the last bit."""
        return sum(pair.before.state_sha256 == pair.after.state_sha256 != "" for pair in self.pairs)


def _common_scenarios(before: Identity, after: Identity) -> list[str]:
    """Names of scenarios that both have, with the same content."""
    return [name for name, digest in after.scenarios.items() if before.scenarios.get(name) == digest]


def check_comparable(before: EvaluationFolder, after: Identity) -> None:
    """Raise a `SettingError` if no scenario is in both evaluations, or none of them was flown before."""
    common = _common_scenarios(before.identity, after)
    if not common:
        raise SettingError(
            f"--compare {before.path}: no scenario is in both; fly that evaluation's: "
            f"framerunner evaluate {before.path}/scenarios"
        )
    if before.done.isdisjoint(common):
        raise SettingError(f"--compare {before.path}: has no flight yet of a scenario that is in both")


def compare(before: EvaluationFolder, after: EvaluationFolder) -> Comparison:
    """Compare an evaluation with an earlier one."""
    rows_before, rows_after = before.rows(), after.rows()
    pairs = tuple(
        Pair(rows_before[name], rows_after[name])
        for name in _common_scenarios(before.identity, after.identity)
        if name in rows_before and name in rows_after
    )
    won = sum(pair.after.completed and not pair.before.completed for pair in pairs)
    lost = sum(pair.before.completed and not pair.after.completed for pair in pairs)
    both = [pair for pair in pairs if pair.before.completed and pair.after.completed]
    return Comparison(
        path=before.path,
        mission=before.identity.mission,
        pairs=pairs,
        only_after=len(rows_after) - len(pairs),
        only_before=len(rows_before) - len(pairs),
        landed_before=wilson(sum(pair.before.completed for pair in pairs), len(pairs)),
        landed_after=wilson(sum(pair.after.completed for pair in pairs), len(pairs)),
        won=won,
        lost=lost,
        p_value=mcnemar(won, lost),
        try_time_s=mean_difference([pair.after.try_time_s - pair.before.try_time_s for pair in both]),
    )


def mcnemar(won: int, lost: int) -> float:
    """Exact two-sided p-value of McNemar's test: the probability of so uneven a split if nothing changed.

    Source: Q. McNemar, Note on the sampling error of the difference between correlated proportions (1947),
    with the binomial distribution in place of its approximation.
    """
    from scipy.stats import binomtest

    if won + lost == 0:
        return 1.0
    return float(binomtest(won, won + lost, 0.5).pvalue)


def mean_difference(differences: Sequence[float]) -> MeanDifference | None:
    """Mean with its confidence interval by Student's t; None if there are no differences."""
    count = len(differences)
    if count == 0:
        return None
    mean = fmean(differences)
    if count == 1:
        return MeanDifference(1, mean, None, None)
    from scipy.stats import t

    half = float(t.ppf((1.0 + CONFIDENCE) / 2.0, count - 1)) * stdev(differences) / sqrt(count)
    return MeanDifference(count, mean, mean - half, mean + half)
