"""What a program tells people while it works: lines on standard error."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

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
