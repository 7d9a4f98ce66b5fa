"""What an evaluation shows in the terminal: its progress, and at the end its summary."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence

from rich import box
from rich.table import Table

from framerunner.evaluation.compare import Comparison
from framerunner.evaluation.rows import EvaluationRow
from framerunner.evaluation.statistics import Spread, Summary
from framerunner.terminal import ProgressLine, table_console
from scenarios.verdict import Verdict

_MAX_NAMES = 8
_MAX_CAUSES = 20


class EvaluationProgress(ProgressLine):
    """A bar and a text in a terminal, elsewhere a line every five seconds and at the end.

    It counts `total` flights, of which those in `kept` were flown before.
    """

    def __init__(self, total: int, kept: Sequence[EvaluationRow]) -> None:
        super().__init__(line_s=5.0, total=total, done=len(kept))
        self._total = total
        self._rows = self._kept = len(kept)
        self._verdicts = Counter(row.verdict for row in kept)
        self._simulated_s = 0.0
        self._live.update(self._task, description=self.text())

    def add(self, row: EvaluationRow) -> None:
        """Count a flight that has ended."""
        self._rows += 1
        self._verdicts[row.verdict] += 1
        self._simulated_s += row.try_time_s
        if self.is_due or self._rows == self._total:
            self.show(self.text(), self._rows)

    def text(self) -> str:
        """The progress in one line."""
        clean, completed = self._verdicts[Verdict.CLEAN], self._verdicts[Verdict.COMPLETED]
        parts = [f"{self._rows} of {self._total} flown", f"{clean} clean", f"{completed} completed"]
        flown = self._rows - self._kept
        spent_s = time.monotonic() - self.started_s if flown else 0.0
        if spent_s > 0.0:
            left_s = spent_s / flown * (self._total - self._rows)
            parts += [f"{self._simulated_s / spent_s:.0f} times real time", f"{_duration(left_s)} left"]
        return ", ".join(parts)


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def print_summary(summary: Summary, title: str) -> None:
    """Print rates, distributions and why flights were not clean to standard output."""
    console = table_console(110)
    rates = _table(title, "flights", "share (95 % interval)")
    for verdict, rate in summary.verdicts.items():
        rates.add_row(verdict, str(rate.count), str(rate))
    rates.add_section()
    rates.add_row("landed in time", str(summary.landed.count), str(summary.landed), style="bold")
    if summary.penalised.count:
        rates.add_row("was outside", str(summary.penalised.count), str(summary.penalised))
    if (false := summary.with_false_gates) is not None:
        rates.add_row("a false gate on the map", str(false.count), str(false))
    if (faults := summary.faults_as_expected) is not None:
        rates.add_row("ended as the fault table says", str(faults.count), str(faults), style="bold")
    console.print(rates)

    spreads = _table("", "10 %", "median", "90 %", "mean")
    spreads.add_row("try time of the landed (s)", *spread_cells(summary.try_time_s, ".1f", "-"))
    if summary.times_bound is not None:
        spreads.add_row("the same in multiples of the bound", *spread_cells(summary.times_bound, ".2f", "-"))
    for colour, offset_m in summary.offset_m.items():
        name = f"crossing offset from the centre of {colour} (m)"
        spreads.add_row(name, *spread_cells(offset_m, ".3f", "-"))
    spreads.add_row("landing error (m)", *spread_cells(summary.landing_error_m, ".3f", "-"))
    console.print(spreads)

    if summary.causes:
        failures = _table("not clean", "in / by", "flights", "such as")
        for cause in summary.causes:
            names = [row.scenario for row in cause.rows]
            failures.add_row(cause.verdict, cause.ended_in or "-", str(len(names)), _first(names, 3))
        console.print(failures)
        rows = [row for cause in summary.causes for row in cause.rows]
        for row in rows[:_MAX_CAUSES]:
            line = f"{row.scenario}: {row.cause or row.reason}"
            console.print(line, markup=False, highlight=False, soft_wrap=True)
        if len(rows) > _MAX_CAUSES:
            console.print(f"and {len(rows) - _MAX_CAUSES} more in results.csv, column cause")
        console.print()


def print_comparison(comparison: Comparison) -> None:
    """Print two evaluations side by side to standard output."""
    console = table_console(110)
    table = _table(f"against {comparison.path} ({len(comparison.pairs)} same scenarios)", "before", "now")
    table.add_row("landed in time", str(comparison.landed_before), str(comparison.landed_after))
    table.add_row("landed only then / only now", str(comparison.lost), str(comparison.won))
    table.add_row("worse / better verdict", str(len(comparison.worse)), str(len(comparison.better)))
    console.print(table)
    for line in comparison_lines(comparison):
        console.print(line, markup=False, highlight=False, soft_wrap=True)


def comparison_lines(comparison: Comparison) -> list[str]:
    """Tests, changes and remarks on two evaluations, a sentence each."""
    chance = "" if comparison.p_value < 0.05 else "; so uneven a split often comes by chance"
    lines = [f"McNemar's exact test on landing: p = {comparison.p_value:.3g}{chance}"]
    if comparison.won + comparison.lost == 0:
        lines = ["no flight landed in one of the two only"]
    if comparison.try_time_s is not None:
        lines.append(
            f"try time where both landed ({comparison.try_time_s.count} pairs), now minus before: "
            f"{comparison.try_time_s}"
        )
    for change, pairs in (("better", comparison.better), ("worse", comparison.worse)):
        if pairs:
            names = [f"{p.after.scenario} ({p.before.verdict}, now {p.after.verdict})" for p in pairs]
            lines.append(f"{change}: {_first(names, _MAX_NAMES)}")
    if comparison.identical:
        lines.append(
            f"{comparison.identical} of {len(comparison.pairs)} flights are the same to the last bit"
        )
    if comparison.only_after or comparison.only_before:
        lines.append(
            f"not compared: {comparison.only_after} flights of this evaluation and "
            f"{comparison.only_before} of the other have no partner"
        )
    return lines


def spread_cells(spread: Spread | None, form: str, unknown: str) -> list[str]:
    """10 %, median, 90 % and mean, as cells of a table."""
    if spread is None:
        return [unknown] * 4
    return [format(number, form) for number in (spread.p10, spread.median, spread.p90, spread.mean)]


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title or None, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("", no_wrap=True)
    for column in columns:
        table.add_column(column, justify="left" if column in ("in / by", "such as") else "right")
    return table


def _first(names: Sequence[str], count: int) -> str:
    more = f" and {len(names) - count} more" if len(names) > count else ""
    return ", ".join(names[:count]) + more
