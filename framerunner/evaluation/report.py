"""`report.html`: one self-contained page for a browser, a phone or a printer.

Import this late: matplotlib takes a second.
"""

from __future__ import annotations

import re
import shlex
from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import BytesIO, StringIO
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from framerunner.evaluation.compare import Comparison
from framerunner.evaluation.rows import EvaluationRow
from framerunner.evaluation.statistics import Summary, crossing_offsets_m, mean_seconds_in_state
from framerunner.evaluation.store import REPORT, EvaluationFolder
from framerunner.evaluation.terminal import comparison_lines, spread_cells
from framerunner.files.text_file import TextError, read_text
from framerunner.runs.plots import draw_track
from scenarios.loader import load_scenario
from scenarios.models import COLOURS, ScenarioError
from scenarios.verdict import Verdict

if TYPE_CHECKING:
    from framerunner.evaluation.evaluate import EvaluationSettings
    from framerunner.evaluation.runner import GenuineUse

MAX_PLOTS = 150
"""Of tracks; some 60 kB each. Phones cannot show a page with more."""
_PLOT_DPI = 84
VERDICT_COLOURS = {
    "clean": "#117733",
    "completed": "#88bb66",
    "timed out": "#ddaa33",
    "crashed": "#bb3344",
    "aborted": "#777777",
    "wrong order": "#aa4499",
    "error": "#222222",
}
_GATE_COLOURS = {"red": "#cc3311", "green": "#228833", "blue": "#3355bb"}
_INK, _FAINT = "#262626", "#6b6b6b"
# Colours of charts that are those of the page, which has others in the dark.
_IN_PAGE = {
    _INK: "--ink",
    _FAINT: "--faint",
    "#bbbbbb": "--line",
    "#222222": "--ink",
}
_WIDTH_IN = 5.4
_MAX_STATES = 14


@dataclass(frozen=True, slots=True)
class Failure:
    """What the page shows of a flight that was not clean: a command flies it again, a plot is a data URI."""

    row: EvaluationRow
    command: str
    plot: str | None
    traceback: str


def write_report(
    folder: EvaluationFolder,
    settings: EvaluationSettings,
    summary: Summary,
    comparison: Comparison | None,
    advance: Callable[[int, int], None] = lambda _done, _total: None,
) -> None:
    """Draw and write the page.

    Args:
        folder: of the evaluation.
        settings: by which it was flown.
        summary: of its flights.
        comparison: with an earlier evaluation; None without.
        advance: called with the number of tracks plotted so far and in all.

    Raises:
        SettingError: the page cannot be written.
    """
    environment = Environment(
        loader=PackageLoader("framerunner.evaluation"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["spread"] = lambda spread, form: spread_cells(spread, form, "–")
    rows = list(folder.rows().values())
    failures = _failures(folder, settings, summary, advance)
    with mpl.rc_context({"text.parse_math": False}):  # a state's name may have a dollar sign
        charts = [
            ("Try times", "how long from motors on to motors off", Markup(_time_chart(rows))),
            ("Crossings", "how far off the opening's middle", Markup(_offset_chart(rows))),
            ("Where time goes", "mean seconds in each state of the mission", Markup(_state_chart(rows))),
        ]
    text = environment.get_template("report.html.j2").render(
        title=settings.plan.title,
        command=settings.command,
        identity=folder.identity,
        is_open=any(row.mission_class == "open" for row in rows),
        summary=summary,
        comparison=comparison,
        comparison_lines=comparison_lines(comparison) if comparison else [],
        charts=charts,
        colours=VERDICT_COLOURS,
        failures=failures,
        max_plots=MAX_PLOTS,
    )
    folder.write(REPORT, text)


def replay_command(
    path: Path,
    mission: str,
    pilot: str | None,
    seed: int,
    response: str = "",
    *,
    genuine: GenuineUse | None = None,
) -> str:
    """The command that flies the scenario of a file again, in lockstep the same to the last bit."""
    words = ["framerunner", "fly", str(path), "--mission", mission]
    words += ["--pilot", pilot] if pilot else []
    words += ["--seed", str(seed)] if seed else []
    words += ["--response", response] if response else []
    words += (
        ["--lockstep"] if genuine is None else [f"--{genuine.autopilot.name}", str(genuine.autopilot.folder)]
    )
    return shlex.join(words)


def picked_for_plots(summary: Summary, count: int) -> set[str]:
    """Names of flights to plot: of every group in turn, so that rare ends are not left out."""
    picked: list[str] = []
    for index in range(max((len(cause.rows) for cause in summary.causes), default=0)):
        picked += [cause.rows[index].scenario for cause in summary.causes if index < len(cause.rows)]
        if len(picked) >= count:
            break
    return set(picked[:count])


def _failures(
    folder: EvaluationFolder,
    settings: EvaluationSettings,
    summary: Summary,
    advance: Callable[[int, int], None],
) -> list[tuple[str, str, list[Failure]]]:
    """Verdict, end and flights, for each group of flights that were not clean."""
    picked = picked_for_plots(summary, MAX_PLOTS)
    done = 0
    groups = []
    for cause in summary.causes:
        failures = []
        for row in cause.rows:
            plot = None
            if row.scenario in picked:
                advance(done, len(picked))
                plot = _track_plot(folder, row)
                done += 1
            file = folder.scenario_file(row.scenario)
            command = replay_command(
                file, settings.mission, settings.pilot, row.seed or 0, row.response, genuine=settings.genuine
            )
            failures.append(Failure(row, command, plot, _traceback(folder, row)))
        groups.append((cause.verdict, cause.ended_in, failures))
    return groups


def _track_plot(folder: EvaluationFolder, row: EvaluationRow) -> str | None:
    """The track as a PNG in a data URI; None if it is not known."""
    track = folder.track(row.scenario)
    if len(track) == 0:
        return None
    try:
        scenario = load_scenario(folder.scenario_file(row.scenario))
    except ScenarioError:
        return None  # the file was removed
    png = BytesIO()
    draw_track(scenario, track, row).savefig(png, format="png", dpi=_PLOT_DPI)
    return f"data:image/png;base64,{b64encode(png.getvalue()).decode()}"


def _traceback(folder: EvaluationFolder, row: EvaluationRow) -> str:
    if row.verdict is not Verdict.ERROR:
        return ""
    try:
        return read_text(folder.error_file(row.scenario))
    except TextError:
        return ""


def _time_chart(rows: Sequence[EvaluationRow]) -> str:
    """Histogram of try times by verdict, of all flights without an error."""
    times: dict[str, list[float]] = {verdict: [] for verdict in VERDICT_COLOURS}
    for row in rows:
        if row.verdict is not Verdict.ERROR:
            times[row.verdict].append(row.try_time_s)
    verdicts = [verdict for verdict, times_s in times.items() if times_s]
    figure, axes = _new_chart(2.9)
    if verdicts:
        last_s = max(max(times[verdict]) for verdict in verdicts)
        step_s = 5.0 if last_s > 60.0 else max(last_s / 12.0, 0.1)
        colours = [VERDICT_COLOURS[verdict] for verdict in verdicts]
        _histogram(axes, [times[verdict] for verdict in verdicts], step_s, verdicts, colours)
    _name_axes(axes, "try time (s)", "flights")
    return _svg(figure, "time")


def _offset_chart(rows: Sequence[EvaluationRow]) -> str:
    """Histogram of the crossings' distances from the gate's centre, by colour."""
    offsets = {colour: crossing_offsets_m(rows, colour) for colour in COLOURS}
    colours = [colour for colour in COLOURS if offsets[colour]]
    figure, axes = _new_chart(2.9)
    if colours:
        step_m = 0.01 if max(max(offsets[colour]) for colour in colours) > 0.05 else 0.005
        labels = [f"{colour} ({len(offsets[colour])})" for colour in colours]
        fills = [_GATE_COLOURS[colour] for colour in colours]
        _histogram(axes, [offsets[colour] for colour in colours], step_m, labels, fills)
    _name_axes(axes, "distance from the opening's middle (m)", "crossings")
    return _svg(figure, "offset")


def _histogram(
    axes: Axes, parts: Sequence[Sequence[float]], step: float, labels: Sequence[str], colours: Sequence[str]
) -> None:
    """Draw a stacked histogram that begins at zero."""
    last = max(max(part) for part in parts)
    edges = [step * number for number in range(ceil(last / step + 1e-9) + 1)]
    axes.hist(list(parts), edges, stacked=True, color=list(colours), label=list(labels), ec="white", lw=0.5)
    axes.legend(frameon=False, fontsize=8, labelcolor=_INK)


def _name_axes(axes: Axes, across: str, up: str) -> None:
    axes.set_xlabel(across)
    axes.set_ylabel(up)
    axes.yaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.set_xlim(left=0.0)


def _state_chart(rows: Sequence[EvaluationRow]) -> str:
    """Mean seconds in each kind of state, of flights that landed in time and of those that failed."""
    flown = [row for row in rows if row.verdict is not Verdict.ERROR]
    groups = {
        "landed in time": ([row for row in flown if row.completed], VERDICT_COLOURS["clean"]),
        "failed": ([row for row in flown if not row.completed], VERDICT_COLOURS["timed out"]),
    }
    means_s = {name: mean_seconds_in_state(group) for name, (group, _) in groups.items()}
    order = dict.fromkeys(state for row in flown for state in row.seconds_in_state)  # as they are flown
    states = [state for state in order if any(mean.get(state, 0.0) >= 0.05 for mean in means_s.values())]
    states = states[:_MAX_STATES]
    figure, axes = _new_chart(max(0.7 + 0.34 * len(states), 1.4))
    shown = [(name, len(group), colour) for name, (group, colour) in groups.items() if group]
    height = 0.8 / max(len(shown), 1)
    for number, (name, count, colour) in enumerate(shown):
        positions = [index + (number - (len(shown) - 1) / 2) * height for index in range(len(states))]
        seconds = [means_s[name].get(state, 0.0) for state in states]
        bars = axes.barh(positions, seconds, height * 0.92, color=colour, label=f"{name} ({count})")
        axes.bar_label(bars, [f"{value:.1f}" for value in seconds], padding=2, fontsize=7, color=_FAINT)
    axes.set_yticks(range(len(states)), [state.replace("_", " ") or "no mission" for state in states])
    axes.invert_yaxis()
    axes.margins(x=0.12)
    axes.set_xlabel("mean seconds a flight")
    axes.grid(visible=False, axis="y")
    if shown:
        axes.legend(frameon=False, fontsize=8, labelcolor=_INK, loc="best")
    return _svg(figure, "state")


def _new_chart(height_in: float) -> tuple[Figure, Axes]:
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
    """The figure as an SVG element: no header, size or date, and ids that are unique within the page."""
    text = StringIO()
    with mpl.rc_context({"svg.hashsalt": name}):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None}, transparent=True)
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", svg, count=1)
    svg = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", svg, count=1)
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    for colour, name_in_page in _IN_PAGE.items():
        svg = svg.replace(colour, f"var({name_in_page})")
    return re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{name}-", svg)
