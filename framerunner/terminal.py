"""What a program tells people while it works: lines on standard error, and how far it is."""

from __future__ import annotations

import sys
import time
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from rich.console import Console


def say(line: str) -> None:
    """Print a line at once."""
    print(line, file=sys.stderr, flush=True)


def warn(problem: str) -> None:
    """Print a problem; nothing if it is empty."""
    if problem:
        say(f"warning: {problem}")


def table_console(width: int) -> Console:
    """Where tables are printed, standard output: a pipe has no width, so what is written to it is not cut."""
    from rich.console import Console

    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = max(console.width, width)
    return console


class ProgressLine:
    """In a terminal one line on standard error that is written again and again; elsewhere a line at times.

    Args:
        line_s: between two lines where there is no terminal.
        quiet_s: nothing is shown before, without a bar.
        refresh_s: between two texts in a terminal.
        total: number of things to do, for a bar; None: there is none.
        done: number of things done before.
    """

    def __init__(
        self,
        line_s: float,
        quiet_s: float = 0.0,
        refresh_s: float = 0.0,
        *,
        total: int | None = None,
        done: int = 0,
    ) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

        self._console = Console(stderr=True)
        mark = SpinnerColumn() if total is None else BarColumn(bar_width=24)
        text = TextColumn("{task.description}", markup=False)
        self._live = Progress(mark, text, console=self._console, transient=True)
        self._task = self._live.add_task("", total=total, completed=done)
        self._wait_s = refresh_s if self._console.is_terminal else line_s
        self.started_s = time.monotonic()
        self._has_bar = total is not None
        self._next_s = self.started_s + (quiet_s if total is None else self._wait_s)

    def __enter__(self) -> Self:
        """With a bar, show it at once; the first line where there is no terminal comes later."""
        if self._has_bar and self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._console.is_terminal:  # elsewhere it prints an empty line
            self._live.stop()

    @property
    def is_due(self) -> bool:
        """Whether the last text is old enough."""
        return time.monotonic() >= self._next_s

    def show(self, text: str, done: int | None = None) -> None:
        """Show a text, with the number of things done, if there is a bar."""
        self._next_s = time.monotonic() + self._wait_s
        if self._console.is_terminal:
            self._live.start()
            self._live.update(self._task, description=text, completed=done)
        else:
            self._console.print(text, markup=False, highlight=False, soft_wrap=True)
