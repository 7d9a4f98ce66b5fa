"""Two evaluations side by side, flight by flight on the same scenarios."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from statistics import fmean, stdev

from errors import SettingError
from framerunner.evaluation.plan import Identity
from framerunner.evaluation.rows import Row
from framerunner.evaluation.statistics import CONFIDENCE, Rate, wilson
from framerunner.evaluation.store import EvaluationFolder
from scenarios.verdict import Verdict

_RANK = {Verdict.CLEAN: 2, Verdict.COMPLETED: 1}


@dataclass(frozen=True, slots=True)
class Pair:
    """One scenario in both evaluations."""

    before: Row
    after: Row

    @property
    def change(self) -> int:
        """1 better, -1 worse, 0 alike: clean is above completed, and that above all the rest."""
        before, after = _RANK.get(self.before.verdict, 0), _RANK.get(self.after.verdict, 0)
        return (after > before) - (after < before)

    @property
    def longer_s(self) -> float:
        """Seconds by which the try became longer."""
        return self.after.try_time_s - self.before.try_time_s


@dataclass(frozen=True, slots=True)
class MeanDifference:
    """A mean of paired differences with its 95 % confidence interval (Student's t).

    Attributes:
        count: pairs.
        mean: of the differences.
        low: lower end of the interval; None with a single pair.
        high: upper end.
    """

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
    """An evaluation against an earlier one.

    Attributes:
        path: folder of the earlier one.
        mission: what it flew.
        pairs: scenarios flown in both, in order.
        only_after: scenarios flown in this one only, or with another content.
        only_before: scenarios flown in the earlier one only.
        landed_before: of the pairs.
        landed_after: of the pairs.
        won: pairs that landed only now.
        lost: pairs that landed only before.
        p_value: how likely so uneven a split of `won` and `lost` is if nothing changed (McNemar, exact).
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
    def same(self) -> int:
        """Number of pairs with a verdict as good as before."""
        return sum(pair.change == 0 for pair in self.pairs)

    @property
    def identical(self) -> int:
        """Number of pairs that were the same flight to the last bit."""
        return sum(_same_flight(pair) for pair in self.pairs)


def common_scenarios(before: Identity, after: Identity) -> list[str]:
    """Names of scenarios that both have, with the same content."""
    theirs: Mapping[str, str] = before.scenarios
    return [name for name, digest in after.scenarios.items() if theirs.get(name) == digest]


def check_comparable(before: EvaluationFolder, after: Identity) -> None:
    """Refuse a comparison that would have nothing to compare, before anything is flown.

    Raises:
        SettingError: no scenario is in both.
    """
    common = common_scenarios(before.identity, after)
    if not common:
        raise SettingError(
            f"--compare {before.path}: no scenario is in both; fly that evaluation's: "
            f"framerunner evaluate {before.path}/scenarios"
        )
    if before.done.isdisjoint(common):
        raise SettingError(f"--compare {before.path}: has no flight yet of a scenario that is in both")


def compare(before: EvaluationFolder, after: EvaluationFolder) -> Comparison:
    """Set an evaluation against an earlier one.

    Args:
        before: the earlier one.
        after: this one.
    """
    theirs, ours = before.rows(), after.rows()
    pairs = tuple(
        Pair(theirs[name], ours[name])
        for name in common_scenarios(before.identity, after.identity)
        if name in theirs and name in ours
    )
    won = sum(pair.after.completed and not pair.before.completed for pair in pairs)
    lost = sum(pair.before.completed and not pair.after.completed for pair in pairs)
    both = [pair for pair in pairs if pair.before.completed and pair.after.completed]
    return Comparison(
        path=before.path,
        mission=before.identity.mission,
        pairs=pairs,
        only_after=len(ours) - len(pairs),
        only_before=len(theirs) - len(pairs),
        landed_before=wilson(sum(pair.before.completed for pair in pairs), len(pairs)),
        landed_after=wilson(sum(pair.after.completed for pair in pairs), len(pairs)),
        won=won,
        lost=lost,
        p_value=mcnemar(won, lost),
        try_time_s=mean_difference([pair.longer_s for pair in both]),
    )


def mcnemar(won: int, lost: int) -> float:
    """Exact two-sided p-value of McNemar's test: are flights won and lost like tosses of a coin?

    Source: Q. McNemar, Note on the sampling error of the difference between correlated proportions (1947),
    with the binomial distribution in place of its approximation.
    """
    from scipy.stats import binomtest

    if won + lost == 0:
        return 1.0
    return float(binomtest(won, won + lost, 0.5).pvalue)


def mean_difference(differences: Sequence[float]) -> MeanDifference | None:
    """Mean with its interval by Student's t; None of nothing."""
    count = len(differences)
    if count == 0:
        return None
    mean = fmean(differences)
    if count == 1:
        return MeanDifference(1, mean, None, None)
    from scipy.stats import t

    half = float(t.ppf((1.0 + CONFIDENCE) / 2.0, count - 1)) * stdev(differences) / sqrt(count)
    return MeanDifference(count, mean, mean - half, mean + half)


def _same_flight(pair: Pair) -> bool:
    return pair.before.state_sha256 == pair.after.state_sha256 != ""
