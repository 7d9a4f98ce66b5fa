"""How pictures look. Importing this imports matplotlib; see `framerunner.runs.pictures` for what to call.

Figures are made without pyplot, so there is no state shared between them and no display is needed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, isfinite, nan, sin
from textwrap import shorten
from typing import Literal, Protocol

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from framerunner.runs.track import Track
from scenarios.models import Frame, Scenario, start_position
from scenarios.result import FlightResult

_Dash = Literal["-"] | tuple[float, Sequence[float]]

FRAME_COLOURS = {"red": "#ff0000", "green": "#00ff00", "blue": "#0000ff"}
# Paul Tol's "muted" scheme, which colour-blind people can tell apart, and three more beside it.
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
# When a mission has more kinds of states than there are colours, the colours come again in another dash.
DASHES: tuple[_Dash, ...] = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (4, 1, 1, 1)))

_INK = "#262626"
_FAINT = "#6b6b6b"
_FLOOR = "#faf3dc"
_GROUND = "#efefef"
_BASE = "#c9b892"
_HALO = [withStroke(linewidth=2.5, foreground="white")]


_Styles = Mapping[str, tuple[str, _Dash]]


class _View(Protocol):
    """Takes a place in the arena to the two axes of a picture."""

    def __call__(self, x: float, y: float, z: float) -> tuple[float, float]: ...


def _from_above(x: float, y: float, z: float) -> tuple[float, float]:
    return (x, y)


def _from_the_side(x: float, y: float, z: float) -> tuple[float, float]:
    return (x, z)


def draw_scenario(scenario: Scenario) -> Figure:
    """Return a scenario from above and from the side."""
    figure, top, side, words = _sheet()
    _draw_top(top, scenario, {frame.colour: f"{frame.colour}, {frame.z_m:g} m" for frame in scenario.frames})
    _draw_side(side, scenario)
    _label_heights(side, scenario)
    _draw_start(top, scenario)
    _set_limits(top, side, scenario, Track())
    _write(figure, scenario.name, f"{len(scenario.frames)} frames, try limit {scenario.try_limit_s:g} s")
    _draw_table(words, scenario)
    return figure


def draw_track(scenario: Scenario, track: Track, result: FlightResult | None) -> Figure:
    """Return a flight from above and from the side, with a legend of its states in order of appearance."""
    figure, top, side, words = _sheet()
    times_s = {} if result is None else result.times_s
    _draw_top(top, scenario, {frame.colour: _crossing_label(frame, times_s) for frame in scenario.frames})
    _draw_side(side, scenario)
    _draw_start(top, scenario)
    spent_s = track.seconds_in_state()
    styles = {kind: _style(number) for number, kind in enumerate(spent_s)}
    for axes, view in ((top, _from_above), (side, _from_the_side)):
        _draw_path(axes, view, track, styles)
        _draw_marks(axes, view, track, times_s)
    _set_limits(top, side, scenario, track)
    _draw_legend(words, spent_s, styles)
    _write(figure, *_headline(scenario, result))
    return figure


def _sheet() -> tuple[Figure, Axes, Axes, Axes]:
    """Return a figure with axes for the view from above, the view from the side, and words."""
    figure = Figure(figsize=(10.6, 5.9), dpi=128, facecolor="white")
    top = figure.add_axes((0.055, 0.08, 0.44, 0.75))
    side = figure.add_axes((0.55, 0.47, 0.435, 0.36))
    words = figure.add_axes((0.55, 0.03, 0.435, 0.36))
    words.set_axis_off()
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
    return figure, top, side, words


def _draw_top(axes: Axes, scenario: Scenario, labels: dict[str, str]) -> None:
    arena, base = scenario.arena, scenario.base
    half_x, half_y = arena.length_x_m / 2, arena.width_y_m / 2
    axes.add_patch(Rectangle((-half_x, -half_y), 2 * half_x, 2 * half_y, fc=_FLOOR, ec="#d8c68f", zorder=0))
    corner = (base.x_m - base.edge_m / 2, base.y_m - base.edge_m / 2)
    axes.add_patch(Rectangle(corner, base.edge_m, base.edge_m, fc=_BASE, ec=_INK, lw=0.6, zorder=1))
    for frame in scenario.frames:
        _draw_frame_from_above(axes, frame, labels[frame.colour])


def _draw_frame_from_above(axes: Axes, frame: Frame, label: str) -> None:
    """Draw a frame as a bar, its normal as an arrow; the label stands at its end, off the way through it."""
    c, s = cos(frame.yaw_rad), sin(frame.yaw_rad)
    colour = FRAME_COLOURS[frame.colour]
    half = frame.outer_width_m / 2
    depth = max(frame.bar_m, frame.outer_width_m / 6) / 2  # a bar's true depth would be a hairline
    corners = [(-depth, -half), (depth, -half), (depth, half), (-depth, half)]
    outline = [(frame.x_m + c * a - s * b, frame.y_m + s * a + c * b) for a, b in corners]
    axes.add_patch(Polygon(outline, closed=True, fc=colour, ec=_INK, lw=0.6, zorder=4))
    axes.annotate(
        "",
        xy=(frame.x_m + c * 2 * frame.outer_width_m, frame.y_m + s * 2 * frame.outer_width_m),
        xytext=(frame.x_m, frame.y_m),
        arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.3, "shrinkA": 0, "shrinkB": 0},
        zorder=3,
    )
    # Of the bar's two ends, the one that points away from the arena's middle has more room.
    outward = 1.0 if -s * frame.x_m + c * frame.y_m >= 0 else -1.0
    right, up = -s * outward, c * outward
    axes.annotate(
        label,
        xy=(frame.x_m + right * half, frame.y_m + up * half),
        xytext=(right * 7, up * 7),
        textcoords="offset points",
        ha="left" if right > 0.3 else "right" if right < -0.3 else "center",
        va="bottom" if up > 0.3 else "top" if up < -0.3 else "center",
        fontsize=9,
        color=_INK,
        path_effects=_HALO,
        zorder=8,
    )


def _draw_side(axes: Axes, scenario: Scenario) -> None:
    arena, base = scenario.arena, scenario.base
    half_x = arena.length_x_m / 2
    axes.add_patch(Rectangle((-half_x, 0), 2 * half_x, arena.height_m, fc="white", ec="#d8c68f", zorder=0))
    axes.axhline(0, color=_INK, lw=1.0, zorder=1)
    axes.add_patch(
        Rectangle(
            (base.x_m - base.edge_m / 2, 0), base.edge_m, base.top_m, fc=_BASE, ec=_INK, lw=0.6, zorder=1
        )
    )
    for frame in scenario.frames:
        # Seen along y, a frame's width shrinks with its yaw; never to nothing, its bars have a depth.
        width = frame.outer_width_m * abs(sin(frame.yaw_rad)) + frame.bar_m * abs(cos(frame.yaw_rad))
        corner = (frame.x_m - width / 2, frame.z_m - frame.outer_height_m / 2)
        axes.add_patch(Rectangle(corner, width, frame.outer_height_m, fill=False, ec=_INK, lw=2.4, zorder=4))
        axes.add_patch(
            Rectangle(
                corner,
                width,
                frame.outer_height_m,
                fill=False,
                ec=FRAME_COLOURS[frame.colour],
                lw=1.5,
                zorder=4,
            )
        )


def _label_heights(axes: Axes, scenario: Scenario) -> None:
    for frame in scenario.frames:
        width = frame.outer_width_m * abs(sin(frame.yaw_rad))
        axes.annotate(
            f"{frame.z_m:g} m",
            xy=(frame.x_m + width / 2, frame.z_m),
            xytext=(6, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
            color=_INK,
            path_effects=_HALO,
            zorder=8,
        )


def _draw_start(axes: Axes, scenario: Scenario) -> None:
    start = scenario.start
    length = 0.09 * min(scenario.arena.length_x_m, scenario.arena.width_y_m)
    axes.annotate(
        "",
        xy=(start.x_m + length * cos(start.yaw_rad), start.y_m + length * sin(start.yaw_rad)),
        xytext=(start.x_m, start.y_m),
        arrowprops={"arrowstyle": "-|>", "color": _INK, "lw": 1.6, "shrinkA": 0, "shrinkB": 0},
        zorder=5,
    )
    axes.plot(start.x_m, start.y_m, marker="o", ms=5, color=_INK, zorder=5)
    axes.annotate(
        "start",
        xy=(start.x_m, start.y_m - scenario.base.edge_m / 2),
        xytext=(0, -4),
        textcoords="offset points",
        ha="center",
        va="top",
        fontsize=9,
        color=_INK,
        path_effects=_HALO,
        zorder=8,
    )


def _style(number: int) -> tuple[str, _Dash]:
    """Colour and dash of the n-th kind of state."""
    return STATE_COLOURS[number % len(STATE_COLOURS)], DASHES[number // len(STATE_COLOURS) % len(DASHES)]


def _draw_path(axes: Axes, view: _View, track: Track, styles: _Styles) -> None:
    """Draw one line for each kind of state, broken where another was flown and where no place is known."""
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
        # A dot where a state was entered; it is all there is of a state in which the drone stood still.
        axes.plot(*zip(*entries[kind], strict=True), ls="", marker="o", ms=3.6, color=colour, zorder=6)


def _draw_marks(axes: Axes, view: _View, track: Track, times_s: Mapping[str, float]) -> None:
    """Mark the crossings, and where the path ends."""
    for time_s in times_s.values():
        place = track.place_at(time_s)
        if place is not None:
            axes.plot(*view(*place), marker="o", ms=5.5, mfc="white", mec=_INK, mew=1.3, zorder=7)
    last = next((i for i in reversed(range(len(track))) if track.is_drawable(i)), None)
    if last is not None:
        end = view(track.x[last], track.y[last], track.z[last])
        axes.plot(*end, marker="X", ms=8, mfc=_INK, mec="white", mew=1.0, zorder=7)


def _crossing_label(frame: Frame, times_s: Mapping[str, float]) -> str:
    time_s = times_s.get(frame.colour)
    return f"{frame.colour}\nnot crossed" if time_s is None else f"{frame.colour}\n{time_s:.1f} s"


def _set_limits(top: Axes, side: Axes, scenario: Scenario, track: Track) -> None:
    """Show the whole arena and the path, but not farther out than the arena is large."""
    arena = scenario.arena
    half_x, half_y = arena.length_x_m / 2, arena.width_y_m / 2
    x = _span(track.x, -half_x, half_x)
    top.set_xlim(x)
    top.set_ylim(_span(track.y, -half_y, half_y))
    side.set_xlim(x)
    side.set_ylim(_span(track.z, 0.0, arena.height_m))


def _span(values: Sequence[float], low: float, high: float) -> tuple[float, float]:
    size = high - low
    known = [value for value in values if isfinite(value)]
    margin = size * 0.04
    return (
        max(min([low, *known]), low - size) - margin,
        min(max([high, *known]), high + size) + margin,
    )


def _draw_legend(axes: Axes, spent_s: Mapping[str, float], styles: _Styles) -> None:
    """Name the kinds of states in order of appearance, with the time spent in each, and the marks."""
    handles = []
    for kind, seconds in spent_s.items():
        colour, dash = styles[kind]
        name = kind.replace("_", " ") or "no mission"
        handles.append(
            Line2D([], [], color=colour, linestyle=dash, lw=2.4, label=f"{name:.24}  {seconds:.1f} s")
        )
    crossing = Line2D([], [], ls="", marker="o", ms=5.5, mfc="white", mec=_INK, mew=1.3, label="crossing")
    end = Line2D([], [], ls="", marker="X", ms=8, mfc=_INK, mec="white", label="end of the path")
    handles += [crossing, end] if spent_s else []
    if not handles:
        axes.text(0, 0.95, "Nothing was recorded.", va="top", fontsize=10, color=_INK)
        return
    rows_for_large = 20  # in two columns; more need smaller letters and a third
    few = len(handles) <= rows_for_large
    legend = axes.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.0, 1.0),
        borderaxespad=0.0,
        ncols=2 if few else 3,
        fontsize=9 if few else 7,
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
    total_s = result.try_time_s + result.penalty_s
    times = f"{total_s:.1f} s"
    if result.penalty_s > 0:
        times += f" (try {result.try_time_s:.1f} s, penalty {result.penalty_s:.1f} s)"
    return f"{scenario.name}: {result.verdict}, {times}", result.reason


def _write(figure: Figure, title: str, subtitle: str) -> None:
    figure.text(0.055, 0.94, title, fontsize=15, weight="bold", color=_INK, parse_math=False)
    figure.text(
        0.055, 0.895, shorten(subtitle, 140, placeholder=" …"), fontsize=9.5, color=_INK, parse_math=False
    )


def _draw_table(axes: Axes, scenario: Scenario) -> None:
    """Write the numbers of start and frames."""
    start, ground_m = scenario.start, start_position(scenario)[2]
    rows = [
        f"{'':6}{'x':>8}{'y':>8}{'z':>8}{'yaw':>8}   opening",
        f"{'start':6}{start.x_m:8.2f}{start.y_m:8.2f}{ground_m:8.2f}{start.yaw_rad:8.2f}",
    ]
    for frame in scenario.frames:
        width, height = frame.opening_m
        place = f"{frame.x_m:8.2f}{frame.y_m:8.2f}{frame.z_m:8.2f}{frame.yaw_rad:8.2f}"
        rows.append(f"{frame.colour:6}{place}   {width:.2f} × {height:.2f}")
    rows.append("\nmetres and radians; a frame's yaw is that of its normal")
    axes.text(0, 0.95, "\n".join(rows), va="top", fontsize=8, family="monospace", color=_INK, linespacing=1.5)
