"""An evaluation from its plan to its report: what `framerunner evaluate` does."""

from __future__ import annotations

import sys
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from framerunner.errors import SettingError
from framerunner.evaluation.backends import Pool, check_pool
from framerunner.evaluation.compare import check_comparable, compare
from framerunner.evaluation.plan import EvaluationPlan
from framerunner.evaluation.rows import EvaluationRow, csv_text
from framerunner.evaluation.runner import GenuineUse, Terms, fly_all
from framerunner.evaluation.statistics import summarise
from framerunner.evaluation.store import RESULTS, EvaluationFolder, open_folder, read_folder
from framerunner.evaluation.terminal import EvaluationProgress, print_comparison, print_summary
from framerunner.terminal import say
from scenarios.verdict import Verdict

EXIT_INTERRUPTED = 130


@dataclass(frozen=True, slots=True)
class EvaluationSettings:
    """How to fly a plan, and what to leave.

    Attributes:
        plan: what is flown.
        pool: where it is flown.
        out: folder of the evaluation.
        again: delete what was flown there before.
        against: folder of an earlier evaluation to compare with, if any.
        mission: name or file, as given on the command line.
        pilot: a contestant's file, as given; None without one.
        command: continues this evaluation.
        genuine: the genuine autopilot that flies; None: our own.
    """

    plan: EvaluationPlan
    pool: Pool
    out: Path
    again: bool
    against: Path | None
    mission: str
    pilot: str | None
    command: str
    genuine: GenuineUse | None = None


def evaluate(settings: EvaluationSettings) -> int:
    """Fly what is missing, then count, compare and report.

    Returns:
        0 all were flown, 1 a fault of the program ended some of them, 130 stopped with Ctrl-C.

    Raises:
        SettingError: a setting or folder cannot be used, or a cluster cannot be reached.
    """
    check_pool(settings.pool)
    identity = settings.plan.identity
    before = None
    if settings.against is not None:
        if settings.against.resolve() == settings.out.resolve():
            raise SettingError(
                f"--compare {settings.against}: is this evaluation itself; give an earlier one"
            )
        before = read_folder(settings.against, "--compare")
        check_comparable(before, identity)
    with open_folder(settings.out, identity, again=settings.again) as folder:
        try:
            _fly_missing(settings, folder)
            return _report(settings, folder, before)
        except KeyboardInterrupt:
            count = len(folder.rows())  # from disk: the signal may have come between writing and counting
            kept = f"{count} of {len(settings.plan)} flights are kept in {folder.path}"
            say(f"interrupted; {kept}; continue with:\n  {settings.command}")
            return EXIT_INTERRUPTED


def _fly_missing(settings: EvaluationSettings, folder: EvaluationFolder) -> None:
    plan = settings.plan
    kept = len(folder.done)
    if kept:
        say(f"{kept} of {len(plan)} flights are in {folder.path} already")
    if kept == len(plan):
        return
    scenarios = {scenario.name: scenario for scenario in plan.scenarios}
    not_kept: tuple[EvaluationRow, SettingError] | None = None
    tasks, terms = plan.tasks(frozenset(folder.done)), Terms(genuine=settings.genuine)
    with (
        EvaluationProgress(len(plan), list(folder.rows().values())) as progress,
        closing(fly_all(tasks, settings.pool, terms)) as rows,
    ):
        for row in rows:
            if row.version != folder.identity.version:
                raise SettingError(
                    f"--address {settings.pool.address}: a worker has framerunner {row.version}, not "
                    f"{folder.identity.version}; install the same version there"
                )
            try:
                folder.keep(scenarios[row.scenario], row)
            except SettingError as why:
                not_kept = row, why
                break
            progress.add(row)
    if not_kept is not None:
        _print_flown(settings, folder, not_kept[0])
        raise not_kept[1]


def _report(settings: EvaluationSettings, folder: EvaluationFolder, before: EvaluationFolder | None) -> int:
    """Write and print everything; return the exit code."""
    rows = list(folder.rows().values())
    summary = summarise(rows)
    comparison = None if before is None else compare(before, folder)
    title = f"{settings.plan.title}: {folder.identity.mission}"
    print_summary(summary, title)
    if comparison is not None:
        print_comparison(comparison)
    sys.stdout.flush()
    folder.write(RESULTS, csv_text(rows))
    code = 1 if Verdict.ERROR in summary.verdicts else 0

    console = Console(stderr=True)
    with console.status("drawing the report") as status:
        from framerunner.evaluation.report import write_report

        def advance(done: int, total: int) -> None:
            status.update(f"drawing the report, plot {done + 1} of {total}")

        write_report(folder, settings, summary, comparison, advance)
    print(f"left in {folder.path}/: report.html, results.csv", flush=True)
    return code


def _print_flown(settings: EvaluationSettings, folder: EvaluationFolder, last: EvaluationRow) -> None:
    """Print what was flown until a flight could not be written, with that flight."""
    rows = [row for row in folder.rows().values() if row.scenario != last.scenario]
    flown = f"{len(rows) + 1} of {len(settings.plan)} flights"
    print_summary(
        summarise([*rows, last]), f"{settings.plan.title}: {folder.identity.mission}, the first {flown}"
    )
    sys.stdout.flush()
