"""The charts of a report, as SVG to stand within a page. Importing this imports matplotlib."""

from __future__ import annotations

import re
from collections.abc import Sequence
from io import StringIO
from math import ceil

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from framerunner.evaluation.rows import Row
from framerunner.evaluation.statistics import crossing_offsets_m, mean_seconds_in_state
from scenarios.models import COLOURS
from scenarios.verdict import Verdict

VERDICT_COLOURS = {
    "clean": "#117733",
    "completed": "#88bb66",
    "timed out": "#ddaa33",
    "crashed": "#bb3344",
    "aborted": "#777777",
    "wrong order": "#aa4499",
    "error": "#222222",
}
_FRAME_INKS = {"red": "#cc3311", "green": "#228833", "blue": "#3355bb"}
_INK, _FAINT = "#262626", "#6b6b6b"
_WIDTH_IN = 5.4
_STATES_SHOWN = 14
_in_plain_words = mpl.rc_context({"text.parse_math": False})  # a state's name may have a dollar sign


@_in_plain_words
def time_chart(rows: Sequence[Row]) -> str:
    """How long tries took, by verdict; every flight that was flown counts."""
    flown = [row for row in rows if row.verdict is not Verdict.ERROR]
    figure, axes = _sheet(2.9)
    verdicts = [verdict for verdict in VERDICT_COLOURS if any(row.verdict == verdict for row in flown)]
    times = [[row.try_time_s for row in flown if row.verdict == verdict] for verdict in verdicts]
    if verdicts:
        last_s = max(max(part) for part in times)
        step_s = 5.0 if last_s > 60.0 else max(last_s / 12.0, 0.1)
        _stack(axes, times, step_s, verdicts, [VERDICT_COLOURS[verdict] for verdict in verdicts])
    _name_axes(axes, "try time (s)", "flights")
    return _svg(figure, "time")


@_in_plain_words
def offset_chart(rows: Sequence[Row]) -> str:
    """How far off a frame's middle it was crossed, by colour."""
    figure, axes = _sheet(2.9)
    parts = {colour: crossing_offsets_m(rows, colour) for colour in COLOURS}
    parts = {colour: offsets for colour, offsets in parts.items() if offsets}
    if parts:
        last_m = max(max(offsets) for offsets in parts.values())
        labels = [f"{colour} ({len(offsets)})" for colour, offsets in parts.items()]
        inks = [_FRAME_INKS[colour] for colour in parts]
        _stack(axes, list(parts.values()), 0.01 if last_m > 0.05 else 0.005, labels, inks)
    _name_axes(axes, "distance from the opening's middle (m)", "crossings")
    return _svg(figure, "offset")


def _stack(
    axes: Axes, parts: Sequence[Sequence[float]], step: float, labels: Sequence[str], colours: Sequence[str]
) -> None:
    """Draw a histogram from zero on, its parts one on the other."""
    last = max(max(part) for part in parts)
    edges = [step * number for number in range(ceil(last / step + 1e-9) + 1)]
    axes.hist(list(parts), edges, stacked=True, color=list(colours), label=list(labels), ec="white", lw=0.5)
    axes.legend(frameon=False, fontsize=8, labelcolor=_INK)


def _name_axes(axes: Axes, across: str, up: str) -> None:
    """Say what stands on the axes of a histogram of things that are counted."""
    axes.set_xlabel(across)
    axes.set_ylabel(up)
    axes.yaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.set_xlim(left=0.0)


@_in_plain_words
def state_chart(rows: Sequence[Row]) -> str:
    """Where time goes: mean seconds in each kind of state, of flights that landed and that failed."""
    flown = [row for row in rows if row.verdict is not Verdict.ERROR]
    landed = [row for row in flown if row.completed]
    failed = [row for row in flown if not row.completed]
    parts = {"landed in time": mean_seconds_in_state(landed), "failed": mean_seconds_in_state(failed)}
    order = dict.fromkeys(state for row in flown for state in row.seconds_in_state)  # as they are flown
    states = [state for state in order if any(part.get(state, 0.0) >= 0.05 for part in parts.values())]
    states = states[:_STATES_SHOWN]
    figure, axes = _sheet(max(0.7 + 0.34 * len(states), 1.4))
    groups = [(name, len(group)) for name, group in (("landed in time", landed), ("failed", failed)) if group]
    thick = 0.8 / max(len(groups), 1)
    for number, (name, count) in enumerate(groups):
        colour = VERDICT_COLOURS["clean"] if name == "landed in time" else VERDICT_COLOURS["timed out"]
        places = [index + (number - (len(groups) - 1) / 2) * thick for index in range(len(states))]
        seconds = [parts[name].get(state, 0.0) for state in states]
        bars = axes.barh(places, seconds, thick * 0.92, color=colour, label=f"{name} ({count})")
        axes.bar_label(bars, [f"{value:.1f}" for value in seconds], padding=2, fontsize=7, color=_FAINT)
    axes.set_yticks(range(len(states)), [state.replace("_", " ") or "no mission" for state in states])
    axes.invert_yaxis()
    axes.margins(x=0.12)
    axes.set_xlabel("mean seconds a flight")
    axes.grid(visible=False, axis="y")
    if groups:
        axes.legend(frameon=False, fontsize=8, labelcolor=_INK, loc="best")
    return _svg(figure, "state")


def rate_colours() -> dict[str, str]:
    """The colour of each verdict, for the page's own bars."""
    return dict(VERDICT_COLOURS)


def _sheet(height_in: float) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(_WIDTH_IN, height_in), layout="constrained")
    axes = figure.add_subplot()
    axes.set_axisbelow(True)
    axes.grid(color="#000000", alpha=0.08, linewidth=0.6)
    axes.tick_params(labelsize=8, colors=_INK, length=2)
    axes.xaxis.label.set(fontsize=9, color=_INK)
    axes.yaxis.label.set(fontsize=9, color=_INK)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color("#bbbbbb")
    return figure, axes


def _svg(figure: Figure, name: str) -> str:
    """The figure as an element of a page: no header, no fixed size, names of its own, no date."""
    text = StringIO()
    with mpl.rc_context({"svg.hashsalt": name}):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None}, transparent=True)
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", svg, count=1)
    svg = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", svg, count=1)
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    return re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{name}-", svg)
