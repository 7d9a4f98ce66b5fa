"""What an evaluation prints at its end."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import Console
from rich.table import Table

from framerunner.evaluation.compare import Comparison, Pair
from framerunner.evaluation.statistics import Spread, Summary

_NAMES_SHOWN = 8


def print_summary(summary: Summary, title: str) -> None:
    """Print rates, spreads and why flights failed, to standard output."""
    console = _console()
    rates = _table(title, "flights", "share (95 % interval)")
    for verdict, rate in summary.verdicts.items():
        rates.add_row(verdict, str(rate.count), str(rate))
    rates.add_section()
    rates.add_row("landed in time", str(summary.landed.count), str(summary.landed), style="bold")
    if summary.penalised.count:
        rates.add_row("was outside", str(summary.penalised.count), str(summary.penalised))
    console.print(rates)

    spreads = _table("", "10 %", "median", "90 %", "mean")
    spreads.add_row("try time of the landed (s)", *_spread(summary.try_time_s, ".1f"))
    for colour, offset_m in summary.offset_m.items():
        spreads.add_row(f"off the middle of {colour} (m)", *_spread(offset_m, ".3f"))
    spreads.add_row("landing error (m)", *_spread(summary.landing_error_m, ".3f"))
    console.print(spreads)

    if summary.causes:
        why = _table("failures", "in / by", "flights", "such as")
        for cause in summary.causes:
            names = [row.scenario for row in cause.rows]
            why.add_row(cause.verdict, cause.cause or "-", str(len(names)), _some(names, 3))
        console.print(why)


def print_comparison(comparison: Comparison) -> None:
    """Print two evaluations side by side, to standard output."""
    console = _console()
    table = _table(f"against {comparison.path} ({len(comparison.pairs)} same scenarios)", "before", "now")
    table.add_row("landed in time", str(comparison.landed_before), str(comparison.landed_after))
    table.add_row("landed only then / only now", str(comparison.lost), str(comparison.won))
    table.add_row("worse / better verdict", str(len(comparison.worse)), str(len(comparison.better)))
    console.print(table)
    for line in comparison_lines(comparison):
        console.print(line, markup=False, highlight=False, soft_wrap=True)


def comparison_lines(comparison: Comparison) -> list[str]:
    """What there is to say of two evaluations beside their counts, a sentence each."""
    chance = "" if comparison.p_value < 0.05 else "; so uneven a split often comes by chance"
    lines = [f"McNemar's exact test on landing: p = {comparison.p_value:.3g}{chance}"]
    if comparison.won + comparison.lost == 0:
        lines = ["no flight landed in one of the two only"]
    if comparison.try_time_s is not None:
        lines.append(
            f"try time where both landed ({comparison.try_time_s.count} pairs), now minus before: "
            f"{comparison.try_time_s}"
        )
    for word, pairs in (("better", comparison.better), ("worse", comparison.worse)):
        if pairs:
            lines.append(f"{word}: {_some([change_in_words(pair) for pair in pairs], _NAMES_SHOWN)}")
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


def change_in_words(pair: Pair) -> str:
    """Such as "calm-17 (timed out, now clean)"."""
    return f"{pair.after.scenario} ({pair.before.verdict}, now {pair.after.verdict})"


def _console() -> Console:
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = max(console.width, 110)  # a pipe has no width; do not cut what goes into a file
    return console


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title or None, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("", no_wrap=True)
    for column in columns:
        is_words = column in ("in / by", "such as")
        table.add_column(column, justify="left" if is_words else "right")
    return table


def _spread(spread: Spread | None, form: str) -> list[str]:
    if spread is None:
        return ["-"] * 4
    return [format(number, form) for number in (spread.p10, spread.median, spread.p90, spread.mean)]


def _some(names: Sequence[str], most: int) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
