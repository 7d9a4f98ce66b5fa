"""What a flight leaves: track, recorder, plots and the folder with all of it. Here: the formats of plots."""

from __future__ import annotations

from pathlib import Path

from framerunner.errors import UserError

PLOT_SUFFIXES = (".png", ".svg", ".pdf")


class PlotError(UserError):
    """A plot that cannot be written; the message is one line for people."""


def check_plot_format(path: Path) -> None:
    """Raise `PlotError` if a file's suffix is none of `PLOT_SUFFIXES`; needs no matplotlib."""
    if path.suffix.lower() not in PLOT_SUFFIXES:
        raise PlotError(f"plot: '{path}' has no known format; name it {', '.join(PLOT_SUFFIXES)}")
