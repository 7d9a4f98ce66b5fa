"""Plots for people: a scenario, or the track of a flight, from above and from the side.

Import this late: matplotlib takes a second. Figures are made without pyplot, so they share no
state and need no display.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import cos, isfinite, nan, sin
from pathlib import Path
from textwrap import shorten
from typing import Any, Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, Polygon, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from framerunner.geometry.vectors import Vec3
from framerunner.runs import PlotError, check_plot_format
from framerunner.runs.track import Track
from offboard.navigation.view import GateEstimate
from scenarios.models import Gate, Scenario, UprightGate, start_position
from scenarios.result import FlightResult, TimedPosition

_Dash = Literal["-"] | tuple[float, Sequence[float]]
_Styles = Mapping[str, tuple[str, _Dash]]
_View = Callable[[float, float, float], tuple[float, float]]

GATE_COLOURS = {
    "red": "#ff0000",
    "green": "#00ff00",
    "blue": "#0000ff",
    "cyan": "#00ffff",
    "magenta": "#ff00ff",
}
# Paul Tol's "muted" scheme, which colour-blind people can tell apart, and three more.
STATE_COLOURS = (
    "#332288",
    "#ee7733",
    "#117733",
    "#cc6677",
    "#33bbee",
    "#999933",
    "#aa4499",
    "#44aa99",
    "#000000",
    "#ddaa33",
    "#777777",
    "#882255",
)
# With more kinds of states than colours, the colours are used again with another dash.
DASHES: tuple[_Dash, ...] = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (4, 1, 1, 1)))

_OTHER_GATE = "#7a7a7a"  # an estimated one that is no part of the task
_AROUND = 1.35  # an estimate's outline is so much larger: around the true gate where it is right
_ESTIMATE_DASH = (0, (3, 1.5))
_INK = "#262626"
_FAINT = "#6b6b6b"
_FLOOR = "#faf3dc"
_FLOOR_EDGE = "#d8c68f"
_GROUND = "#efefef"
_BASE = "#c9b892"
_PRISM = "#7846b4"  # poles and walls
_HALO = [withStroke(linewidth=2.5, foreground="white")]
_CROSSING_MARK: dict[str, Any] = {"marker": "o", "ms": 5.5, "mfc": "white", "mec": _INK, "mew": 1.3}
_REPORTED_PATH: dict[str, Any] = {"color": _FAINT, "lw": 0.9}
_ESTIMATED_PATH: dict[str, Any] = {"color": _INK, "lw": 0.7}
_SHOWN_ERROR_M = 0.05  # a path that is nearer to the true one than this is not drawn beside it
_END_MARK: dict[str, Any] = {"marker": "X", "ms": 8, "mfc": _INK, "mec": "white"}


def _from_above(x: float, y: float, z: float) -> tuple[float, float]:
    return (x, y)


def _from_the_side(x: float, y: float, z: float) -> tuple[float, float]:
    return (x, z)


def draw_scenario(scenario: Scenario) -> Figure:
    """Return a scenario from above and from the side, its gates with their heights."""
    figure, top, side, notes = _new_figure()
    _draw_top(top, scenario, {gate.colour: f"{gate.colour}, {gate.z_m:g} m" for gate in scenario.frames})
    _draw_side(side, scenario)
    for gate in scenario.frames:
        right_m = gate.x_m + gate.outer_width_m * abs(sin(gate.yaw_rad)) / 2
        _label(side, f"{gate.z_m:g} m", (right_m, gate.z_m), (6, 0), va="center", fontsize=8)
    _set_limits(top, side, scenario, Track())
    _write_title(figure, scenario.name, f"{scenario.contents}; try limit {scenario.try_limit_s:g} s")
    _write_numbers(notes, scenario)
    return figure


def draw_track(scenario: Scenario, track: Track, result: FlightResult | None) -> Figure:
    """Return a flight from above and from the side, its path coloured by the mission's state.

    The path is the true one where that is known; what the vehicle reported and what the app estimated are
    thin lines, if they were somewhere else.
    The track may be empty; the result is None if the flight was not judged.
    """
    figure, top, side, notes = _new_figure()
    asides = list(_paths_beside(track))
    track = track.as_flown()
    times_s = {} if result is None else result.times_s
    _draw_top(top, scenario, {gate.colour: _crossing_label(gate, times_s) for gate in scenario.frames})
    _draw_side(side, scenario)
    _draw_estimates(top, side, track.estimates)
    spent_s = track.seconds_in_state()
    styles = {
        kind: (STATE_COLOURS[i % len(STATE_COLOURS)], DASHES[i // len(STATE_COLOURS) % len(DASHES)])
        for i, kind in enumerate(spent_s)
    }
    for axes, view in ((top, _from_above), (side, _from_the_side)):
        for path, style in asides:
            axes.plot(*zip(*(view(x, y, z) for _, x, y, z in path), strict=True), **style, zorder=5)
        _draw_path(axes, view, track, styles)
        _draw_marks(axes, view, track, times_s)
    _set_limits(top, side, scenario, track)
    _draw_legend(
        notes, spent_s, styles, asides=[style for _, style in asides], has_estimates=bool(track.estimates)
    )
    _write_title(figure, *_headline(scenario, result))
    return figure


def draw_paths(
    scenario: Scenario, paths: Mapping[str, Sequence[Vec3]], title: str, subtitle: str = ""
) -> Figure:
    """Return paths through a scenario (arena axes) from above and from the side, each by its name."""
    figure, top, side, notes = _new_figure()
    _draw_top(top, scenario, {gate.colour: gate.colour for gate in scenario.frames})
    _draw_side(side, scenario)
    lines = []
    for (name, points), colour, dash in zip(paths.items(), STATE_COLOURS, DASHES, strict=False):
        for axes, view in ((top, _from_above), (side, _from_the_side)):
            across, up = zip(*(view(*point) for point in points), strict=True)
            axes.plot(across, up, color=colour, linestyle=dash, lw=1.8, zorder=6)
            axes.plot(across[-1], up[-1], **_END_MARK, mew=1.0, zorder=7)
        lines.append(Line2D([], [], color=colour, linestyle=dash, lw=2.4, label=name))
    end = Line2D([], [], ls="", **_END_MARK, label="motors off")
    notes.legend(handles=[*lines, end], loc="upper left", fontsize=9, frameon=False, labelcolor=_INK)
    _set_limits(top, side, scenario, Track())
    _write_title(figure, title, subtitle)
    return figure


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure to a file; its suffix, one of `PLOT_SUFFIXES`, selects the format.

    Raises:
        PlotError: the suffix is not known, or the file cannot be written.
    """
    check_plot_format(path)
    try:
        figure.savefig(path)
    except OSError as error:
        raise PlotError(f"plot: cannot write '{path}': {error.strerror or error}") from error


def _new_figure() -> tuple[Figure, Axes, Axes, Axes]:
    """Return a figure with axes for the view from above, the view from the side, and text."""
    figure = Figure(figsize=(10.6, 5.9), dpi=128, facecolor="white")
    top = figure.add_axes((0.055, 0.08, 0.44, 0.75))
    side = figure.add_axes((0.55, 0.47, 0.435, 0.36))
    notes = figure.add_axes((0.55, 0.03, 0.435, 0.36))
    notes.set_axis_off()
    for axes, name, upward in ((top, "from above", "y, left (m)"), (side, "from the side", "z, up (m)")):
        axes.set_aspect("equal", anchor="N")
        axes.set_facecolor(_GROUND)
        axes.set_title(name, loc="left", fontsize=9, color=_FAINT, pad=4)
        axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
        axes.yaxis.set_major_locator(MaxNLocator(6, integer=True))
        axes.set_axisbelow(True)
        axes.grid(color="#000000", alpha=0.08, linewidth=0.6)
        axes.set_xlabel("x, forward (m)", fontsize=9, color=_INK)
        axes.set_ylabel(upward, fontsize=9, color=_INK)
        axes.tick_params(labelsize=8, colors=_INK, length=2)
        for spine in axes.spines.values():
            spine.set_color("#bbbbbb")
    return figure, top, side, notes


def _draw_top(axes: Axes, scenario: Scenario, labels: dict[str, str]) -> None:
    """Draw the arena from above: floor, base, obstacles, gates with their labels, and start."""
    arena, base, start = scenario.arena, scenario.base, scenario.start
    corner = (-arena.length_x_m / 2, -arena.width_y_m / 2)
    axes.add_patch(Rectangle(corner, arena.length_x_m, arena.width_y_m, fc=_FLOOR, ec=_FLOOR_EDGE, zorder=0))
    corner = (base.x_m - base.edge_m / 2, base.y_m - base.edge_m / 2)
    axes.add_patch(Rectangle(corner, base.edge_m, base.edge_m, fc=_BASE, ec=_INK, lw=0.6, zorder=1))
    for prism in scenario.prisms:
        a, b, _ = prism.half_extents_m
        corners = [prism.to_arena((x, y, 0.0))[:2] for x, y in ((-a, -b), (a, -b), (a, b), (-a, b))]
        axes.add_patch(Polygon(corners, closed=True, fc=_PRISM, ec=_INK, lw=0.6, zorder=2))
    for decoy in scenario.decoys:
        _draw_gate_from_above(axes, decoy)
    for gate in scenario.frames:
        _draw_gate_from_above(axes, gate)
        _label_gate_from_above(axes, gate, labels[gate.colour])
    length_m = 0.09 * min(arena.length_x_m, arena.width_y_m)
    _arrow(axes, (start.x_m, start.y_m), start.yaw_rad, length_m, colour=_INK, lw=1.6, zorder=5)
    axes.plot(start.x_m, start.y_m, marker="o", ms=5, color=_INK, zorder=5)
    below = (start.x_m, start.y_m - base.edge_m / 2)
    _label(axes, "start", below, (0, -4), ha="center", va="top", fontsize=9)


def _draw_gate_from_above(axes: Axes, gate: UprightGate) -> None:
    """Draw a gate as a bar and its normal as an arrow; a decoy has none."""
    c, s = cos(gate.yaw_rad), sin(gate.yaw_rad)
    colour = GATE_COLOURS[gate.colour]
    half = gate.outer_width_m / 2
    depth = max(gate.bar_m, gate.outer_width_m / 6) / 2  # a bar's true depth would be a hairline
    corners = [(-depth, -half), (depth, -half), (depth, half), (-depth, half)]
    outline = [(gate.x_m + c * a - s * b, gate.y_m + s * a + c * b) for a, b in corners]
    axes.add_patch(Polygon(outline, closed=True, fc=colour, ec=_INK, lw=0.6, zorder=4))
    if isinstance(gate, Gate):
        length_m = 2 * gate.outer_width_m
        _arrow(axes, (gate.x_m, gate.y_m), gate.yaw_rad, length_m, colour=colour, lw=1.3, zorder=3)


def _label_gate_from_above(axes: Axes, gate: Gate, label: str) -> None:
    """Write beside the end of a gate's bar."""
    c, s = cos(gate.yaw_rad), sin(gate.yaw_rad)
    half = gate.outer_width_m / 2
    # Of the bar's two ends, the one that points away from the arena's middle has more room.
    outward = 1.0 if -s * gate.x_m + c * gate.y_m >= 0 else -1.0
    right, up = -s * outward, c * outward
    end = (gate.x_m + right * half, gate.y_m + up * half)
    ha = "left" if right > 0.3 else "right" if right < -0.3 else "center"
    va = "bottom" if up > 0.3 else "top" if up < -0.3 else "center"
    _label(axes, label, end, (right * 7, up * 7), ha=ha, va=va, fontsize=9)


def _draw_side(axes: Axes, scenario: Scenario) -> None:
    arena, base = scenario.arena, scenario.base
    corner = (-arena.length_x_m / 2, 0.0)
    axes.add_patch(Rectangle(corner, arena.length_x_m, arena.height_m, fc="white", ec=_FLOOR_EDGE, zorder=0))
    axes.axhline(0, color=_INK, lw=1.0, zorder=1)
    corner = (base.x_m - base.edge_m / 2, 0.0)
    axes.add_patch(Rectangle(corner, base.edge_m, base.top_m, fc=_BASE, ec=_INK, lw=0.6, zorder=1))
    for prism in scenario.prisms:
        across = [x for x, _, _ in prism.corners()]
        corner, width = (min(across), 0.0), max(across) - min(across)
        axes.add_patch(Rectangle(corner, width, 2 * prism.half_extents_m[2], fc=_PRISM, alpha=0.3, zorder=1))
    for gate in scenario.all_gates:
        # Seen along y, a gate's width shrinks with its yaw; never to nothing, its bars have a depth.
        width = gate.outer_width_m * abs(sin(gate.yaw_rad)) + gate.bar_m * abs(cos(gate.yaw_rad))
        corner = (gate.x_m - width / 2, gate.z_m - gate.outer_height_m / 2)
        for colour, line_width in ((_INK, 2.4), (GATE_COLOURS[gate.colour], 1.5)):
            outline = Rectangle(
                corner, width, gate.outer_height_m, fill=False, ec=colour, lw=line_width, zorder=4
            )
            axes.add_patch(outline)


def _draw_estimates(top: Axes, side: Axes, estimates: Sequence[GateEstimate]) -> None:
    """Draw gates as the navigator knew them: outlines around the true ones, ellipses of two deviations."""
    for gate in estimates:
        x, y, z = gate.position_m
        if not all(map(isfinite, (x, y, z, gate.yaw_rad))):
            continue
        colour = GATE_COLOURS.get(gate.colour, _OTHER_GATE)
        width, height = (_AROUND * size for size in (gate.shape.outer_width_m, gate.shape.outer_height_m))
        style: dict[str, Any] = {"fill": False, "ec": colour, "lw": 0.9, "ls": _ESTIMATE_DASH, "zorder": 7}
        c, s = cos(gate.yaw_rad), sin(gate.yaw_rad)
        corners = [(-0.2, -0.5), (0.2, -0.5), (0.2, 0.5), (-0.2, 0.5)]
        outline = [(x + width * (c * a - s * b), y + width * (s * a + c * b)) for a, b in corners]
        top.add_patch(Polygon(outline, closed=True, **style))
        seen_width = width * abs(s) + 0.1 * width * abs(c)
        side.add_patch(Rectangle((x - seen_width / 2, z - height / 2), seen_width, height, **style))
        if all(map(isfinite, gate.position_std_m)):
            std_x, std_y, std_z = gate.position_std_m
            for axes, at, axis_lengths in ((top, (x, y), (std_x, std_y)), (side, (x, z), (std_x, std_z))):
                across, up = (4 * std for std in axis_lengths)
                axes.add_patch(Ellipse(at, across, up, fc=colour, ec="none", alpha=0.18, zorder=2))


def _arrow(
    axes: Axes,
    tail: tuple[float, float],
    yaw_rad: float,
    length_m: float,
    *,
    colour: str,
    lw: float,
    zorder: int,
) -> None:
    head = (tail[0] + cos(yaw_rad) * length_m, tail[1] + sin(yaw_rad) * length_m)
    style = {"arrowstyle": "-|>", "color": colour, "lw": lw, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=head, xytext=tail, arrowprops=style, zorder=zorder)


def _label(
    axes: Axes,
    text: str,
    at: tuple[float, float],
    offset_points: tuple[float, float],
    **style: Any,  # noqa: ANN401 - of matplotlib's text
) -> None:
    axes.annotate(
        text,
        xy=at,
        xytext=offset_points,
        textcoords="offset points",
        color=_INK,
        path_effects=_HALO,
        zorder=8,
        **style,
    )


def _draw_path(axes: Axes, view: _View, track: Track, styles: _Styles) -> None:
    """Draw a line for each kind of state, with gaps where another was flown or the position is unknown."""
    lines: dict[str, list[tuple[float, float]]] = {}
    entries: dict[str, list[tuple[float, float]]] = {}
    for kind, indices in track.stretches():
        points = [
            view(track.x[i], track.y[i], track.z[i]) if track.is_drawable(i) else (nan, nan) for i in indices
        ]
        lines.setdefault(kind, []).extend([*points, (nan, nan)])
        entries.setdefault(kind, []).append(points[0])
    for kind, points in lines.items():
        colour, dash = styles[kind]
        across, up = zip(*points, strict=True)
        axes.plot(across, up, color=colour, linestyle=dash, lw=1.8, solid_capstyle="round", zorder=6)
        # A dot where a state was entered: all that is seen of a state in which the drone did not move.
        axes.plot(*zip(*entries[kind], strict=True), ls="", marker="o", ms=3.6, color=colour, zorder=6)


def _paths_beside(track: Track) -> Iterator[tuple[Sequence[TimedPosition], dict[str, Any]]]:
    """What was reported and what was estimated, with their styles, where the truth is known and elsewhere."""
    for path, words, style in (
        (track.reported_path, "reported", _REPORTED_PATH),
        (track.estimated_path, "estimated", _ESTIMATED_PATH),
    ):
        error_m = track.largest_error_m(path)
        if error_m is not None and error_m > _SHOWN_ERROR_M:
            yield path, {**style, "label": f"as {words}, up to {error_m:.2f} m off"}


def _draw_marks(axes: Axes, view: _View, track: Track, times_s: Mapping[str, float]) -> None:
    """Mark the crossings and the end of the path."""
    for time_s in times_s.values():
        position = track.position_at(time_s)
        if position is not None:
            axes.plot(*view(*position), **_CROSSING_MARK, zorder=7)
    last = next((i for i in reversed(range(len(track))) if track.is_drawable(i)), None)
    if last is not None:
        end = view(track.x[last], track.y[last], track.z[last])
        axes.plot(*end, **_END_MARK, mew=1.0, zorder=7)


def _crossing_label(gate: Gate, times_s: Mapping[str, float]) -> str:
    time_s = times_s.get(gate.colour)
    return f"{gate.colour}\nnot crossed" if time_s is None else f"{gate.colour}\n{time_s:.1f} s"


def _set_limits(top: Axes, side: Axes, scenario: Scenario, track: Track) -> None:
    """Show the whole arena and the path, up to one arena's size outside."""
    arena = scenario.arena
    half_x, half_y = arena.length_x_m / 2, arena.width_y_m / 2
    x = _limits(track.x, -half_x, half_x)
    top.set_xlim(x)
    top.set_ylim(_limits(track.y, -half_y, half_y))
    side.set_xlim(x)
    side.set_ylim(_limits(track.z, 0.0, arena.height_m))


def _limits(values: Sequence[float], low: float, high: float) -> tuple[float, float]:
    size = high - low
    known = [value for value in values if isfinite(value)]
    margin = size * 0.04
    return (
        max(min([low, *known]), low - size) - margin,
        min(max([high, *known]), high + size) + margin,
    )


def _draw_legend(
    axes: Axes,
    spent_s: Mapping[str, float],
    styles: _Styles,
    *,
    asides: Sequence[dict[str, Any]],
    has_estimates: bool,
) -> None:
    """Name the kinds of states in order of appearance, with the time spent in each, and the marks."""
    handles = []
    for kind, seconds in spent_s.items():
        colour, dash = styles[kind]
        name = kind.replace("_", " ") or "no mission"
        handles.append(
            Line2D([], [], color=colour, linestyle=dash, lw=2.4, label=f"{name:.24}  {seconds:.1f} s")
        )
    crossing = Line2D([], [], ls="", **_CROSSING_MARK, label="crossing")
    end = Line2D([], [], ls="", **_END_MARK, label="end of the path")
    handles += [crossing, end] if spent_s else []
    if has_estimates:
        handles.append(
            Line2D([], [], color=_FAINT, lw=0.9, linestyle=_ESTIMATE_DASH, label="frame as estimated")
        )
    handles += [Line2D([], [], **style) for style in asides]
    if not handles:
        axes.text(0, 0.95, "Nothing was recorded.", va="top", fontsize=10, color=_INK)
        return
    fits_in_two_columns = len(handles) <= 20
    legend = axes.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.0, 1.0),
        borderaxespad=0.0,
        ncols=2 if fits_in_two_columns else 3,
        fontsize=9 if fits_in_two_columns else 7,
        frameon=False,
        labelcolor=_INK,
        handlelength=2.4,
        columnspacing=2.0,
    )
    for text in legend.get_texts():
        text.set_parse_math(False)


def _headline(scenario: Scenario, result: FlightResult | None) -> tuple[str, str]:
    """Title and subtitle of a flight."""
    if result is None:
        return scenario.name, ""
    times = f"{result.try_time_s + result.penalty_s:.1f} s"
    if result.penalty_s > 0:
        times += f" (try {result.try_time_s:.1f} s, penalty {result.penalty_s:.1f} s)"
    return f"{scenario.name}: {result.verdict}, {times}", result.reason


def _write_title(figure: Figure, title: str, subtitle: str) -> None:
    subtitle = shorten(subtitle, 140, placeholder=" …")
    figure.text(0.055, 0.94, title, fontsize=15, weight="bold", color=_INK, parse_math=False)
    figure.text(0.055, 0.895, subtitle, fontsize=9.5, color=_INK, parse_math=False)


def _write_numbers(axes: Axes, scenario: Scenario) -> None:
    """Write a table of the poses of start and gates."""
    start, ground_m = scenario.start, start_position(scenario)[2]
    rows = [
        f"{'':6}{'x':>8}{'y':>8}{'z':>8}{'yaw':>8}   opening",
        f"{'start':6}{start.x_m:8.2f}{start.y_m:8.2f}{ground_m:8.2f}{start.yaw_rad:8.2f}",
    ]
    for gate in scenario.frames:
        width, height = gate.opening_m
        pose = f"{gate.x_m:8.2f}{gate.y_m:8.2f}{gate.z_m:8.2f}{gate.yaw_rad:8.2f}"
        rows.append(f"{gate.colour:6}{pose}   {width:.2f} × {height:.2f}")
    rows.append("\nmetres and radians; a frame's yaw is that of its normal")
    axes.text(0, 0.95, "\n".join(rows), va="top", fontsize=8, family="monospace", color=_INK, linespacing=1.5)
