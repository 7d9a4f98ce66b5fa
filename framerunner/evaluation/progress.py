"""What the terminal shows while an evaluation flies."""

from __future__ import annotations

import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from framerunner.evaluation.rows import Row
from scenarios.verdict import Verdict

_LINE_S = 5.0


class EvaluationProgress:
    """A live line on standard error in a terminal, elsewhere a line every five seconds.

    Args:
        total: flights of the evaluation.
        kept: flights that were flown before.
    """

    def __init__(self, total: int, kept: list[Row]) -> None:
        self._total = total
        self._rows = 0
        self._verdicts: dict[str, int] = {}
        self._simulated_s = 0.0
        for row in kept:
            self._count(row)
        self._kept = len(kept)
        self._console = Console(stderr=True)
        self._started_s = time.monotonic()
        self._said_s = self._started_s
        self._live = Progress(
            BarColumn(bar_width=24), TextColumn("{task.description}"), console=self._console, transient=True
        )
        self._task = self._live.add_task(self.text(), total=total, completed=self._rows)

    def __enter__(self) -> EvaluationProgress:
        """Begin to show."""
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        """Take the live line away."""
        if self._console.is_terminal:
            self._live.stop()

    def add(self, row: Row) -> None:
        """Take a flight that is over."""
        self._count(row)
        self._simulated_s += row.try_time_s
        if self._console.is_terminal:
            self._live.update(self._task, completed=self._rows, description=self.text())
            return
        now_s = time.monotonic()
        if now_s - self._said_s >= _LINE_S or self._rows == self._total:
            self._said_s = now_s
            self._console.print(self.text(), markup=False, highlight=False, soft_wrap=True)

    def text(self) -> str:
        """How it stands, in one line."""
        clean = self._verdicts.get(Verdict.CLEAN, 0)
        completed = self._verdicts.get(Verdict.COMPLETED, 0)
        parts = [f"{self._rows} of {self._total} flown", f"{clean} clean", f"{completed} completed"]
        flown = self._rows - self._kept
        spent_s = time.monotonic() - self._started_s if flown else 0.0
        if spent_s > 0.0:
            left_s = spent_s / flown * (self._total - self._rows)
            parts += [f"{self._simulated_s / spent_s:.0f} times real time", f"{_clock(left_s)} left"]
        return ", ".join(parts)

    def _count(self, row: Row) -> None:
        self._rows += 1
        self._verdicts[row.verdict] = self._verdicts.get(row.verdict, 0) + 1


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
