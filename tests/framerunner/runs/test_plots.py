"""Plots are checked by their matplotlib objects, not by their pixels."""

from dataclasses import replace
from math import inf, nan, pi

import pytest
from matplotlib.colors import to_hex
from matplotlib.patches import Ellipse

from framerunner.runs import PlotError
from framerunner.runs.plots import STATE_COLOURS, draw_scenario, draw_track, save_figure
from framerunner.runs.track import Track
from offboard.navigation.view import GateEstimate
from scenarios.loader import load_scenario
from scenarios.models import Arena, Base, Gate, Scenario, StartPose
from scenarios.result import FlightResult

SCENARIO = Scenario(
    name="two-frames",
    base=Base(x_m=-3, y_m=-3),
    start=StartPose(x_m=-3, y_m=-3, yaw_rad=1.0),
    frames=(
        Gate(colour="red", x_m=3, y_m=2, z_m=2, yaw_rad=3),
        Gate(colour="green", x_m=-2, y_m=1, z_m=0.5, yaw_rad=2),
    ),
)
TRACK = Track(
    time_s=[0.0, 1.0, 2.0, 3.0, 4.0],
    x=[-3.0, -2.0, 3.0, 3.0, -3.0],
    y=[-3.0, -2.0, 2.0, 2.5, -3.0],
    z=[0.5, 1.0, 2.0, 2.0, 0.6],
    mission_state=["take_off.start", "red.turning", "red.crossing", "green.turning", "landing.stop"],
)
RESULT = FlightResult(
    verdict="timed out",
    reason="in green.turning",
    try_time_s=180.0,
    penalty_s=2.5,
    frames_crossed=("red",),
    crossing_times_s=(2.0,),
)


def texts(figure):
    return [text.get_text() for text in figure.findobj(lambda part: hasattr(part, "get_text"))]


def legend_entries(figure):
    legend = figure.axes[2].get_legend()
    return [text.get_text() for text in legend.get_texts()] if legend else []


def coloured_line(figure, view, colour):
    (line,) = (
        line
        for line in figure.axes[view].lines
        if to_hex(line.get_color()) == colour and line.get_ls() != "None"
    )
    return line


def test_a_track_refuses_sequences_of_different_lengths():
    with pytest.raises(ValueError, match="one length"):
        Track(time_s=[0.0], x=[1.0, 2.0], y=[1.0], z=[1.0], mission_state=[""])


def test_time_in_states_adds_up_over_the_colours_and_to_the_whole():
    spent_s = TRACK.seconds_in_state()
    assert list(spent_s) == ["start", "turning", "crossing", "stop"]
    assert spent_s == {"start": 1.0, "turning": 2.0, "crossing": 1.0, "stop": 0.0}


def test_a_position_is_interpolated_between_samples():
    assert TRACK.position_at(0.5) == pytest.approx((-2.5, -2.5, 0.75))
    assert TRACK.position_at(4.0) == pytest.approx((-3.0, -3.0, 0.6))
    assert TRACK.position_at(-0.1) is None
    assert TRACK.position_at(4.1) is None
    assert Track().position_at(0.0) is None


def test_a_position_is_interpolated_over_samples_without_one():
    track = Track([0.0, 1.0, 2.0], [0.0, nan, 2.0], [0.0] * 3, [1.0] * 3, ["s"] * 3)
    assert track.position_at(1.0) == pytest.approx((1.0, 0.0, 1.0))


def test_the_plot_of_a_scenario_names_gates_and_heights():
    figure = draw_scenario(SCENARIO)
    assert {"two-frames", "red, 2 m", "green, 0.5 m", "start"} <= set(texts(figure))
    assert [axes.get_aspect() for axes in figure.axes[:2]] == [1.0, 1.0]


def test_gates_have_their_true_colours():
    figure = draw_scenario(SCENARIO)
    fills = {to_hex(patch.get_facecolor()) for patch in figure.axes[0].patches}
    assert {"#ff0000", "#00ff00"} <= fills
    assert "#0000ff" not in fills


def test_obstacles_are_drawn_from_above_and_from_the_side():
    scenario = load_scenario("crowded-17")
    figure = draw_scenario(scenario)
    assert "3 frames, 2 decoys, 3 poles, 1 wall; try limit 180 s" in texts(figure)
    top, side = ([to_hex(patch.get_facecolor()) for patch in axes.patches] for axes in figure.axes[:2])
    assert top.count("#7846b4") == side.count("#7846b4") == len(scenario.prisms) == 5
    assert {"#00ffff", "#ff00ff"} <= set(top)


def test_the_plot_of_a_track_shows_verdict_times_and_reason():
    words = texts(draw_track(SCENARIO, TRACK, RESULT))
    assert "two-frames: timed out, 182.5 s (try 180.0 s, penalty 2.5 s)" in words
    assert "in green.turning" in words
    assert "red\n2.0 s" in words
    assert "green\nnot crossed" in words


def test_the_legend_has_the_states_in_order_of_appearance():
    entries = legend_entries(draw_track(SCENARIO, TRACK, RESULT))
    assert entries == [
        "start  1.0 s",
        "turning  2.0 s",
        "crossing  1.0 s",
        "stop  0.0 s",
        "crossing",
        "end of the path",
    ]


@pytest.mark.parametrize(("beside_m", "label"), [(0.9, "as reported, up to 0.90 m off"), (0.02, None)])
def test_the_path_is_the_true_one_and_what_a_drone_that_drifts_reports_is_beside_it(beside_m, label):
    true_path = [
        (t, x, y + beside_m * t / 4, z)
        for t, x, y, z in zip(TRACK.time_s, TRACK.x, TRACK.y, TRACK.z, strict=True)
    ]
    figure = draw_track(SCENARIO, replace(TRACK, true_path=true_path), RESULT)
    entries = legend_entries(figure)
    assert (label in entries) if label else not any(entry.startswith("as reported") for entry in entries)
    path = coloured_line(figure, 0, STATE_COLOURS[2])  # of the crossing, and there the mark of red's
    assert list(path.get_ydata()[:2]) == pytest.approx([2.0 + beside_m / 2, 2.5 + beside_m * 3 / 4])
    assert any(list(line.get_ydata()) == [pytest.approx(2.0 + beside_m / 2)] for line in figure.axes[0].lines)


def test_estimated_gates_are_drawn_beside_the_true_ones():
    red = GateEstimate("red", (3.5, 1.0, 2.0), pi / 2, (0.25, 0.5, 0.1), 0.1, False, True, 9, 0)
    other = GateEstimate("constructor", (0.0, 0.0, 1.0), 0.0, (inf, 1.0, 1.0), 0.1, False, False, 1, 0)
    lost = GateEstimate("blue", (nan, 0.0, 1.0), 0.0, (1.0, 1.0, 1.0), 0.1, False, False, 1, 0)
    figure = draw_track(SCENARIO, replace(TRACK, estimates=(red, other, lost)), RESULT)
    assert legend_entries(figure)[-1] == "frame as estimated"
    for axes, middle, (across, up), (width, height) in (
        (figure.axes[0], (3.5, 1.0), (1.0, 2.0), (1.35 * 0.42, 0.4 * 1.35 * 0.42)),
        (figure.axes[1], (3.5, 2.0), (1.0, 0.4), (1.35 * 0.42, 1.35 * 0.22)),
    ):
        (ellipse,) = (patch for patch in axes.patches if isinstance(patch, Ellipse))
        assert ellipse.center == middle
        assert (ellipse.width, ellipse.height) == pytest.approx((across, up))  # two deviations each way
        outlines = [patch for patch in axes.patches if patch.get_linestyle() != "solid"]
        assert [to_hex(patch.get_edgecolor()) for patch in outlines] == ["#ff0000", "#7a7a7a"]
        box = outlines[0].get_extents().transformed(axes.transData.inverted())
        assert (box.width, box.height) == pytest.approx((width, height), abs=0.06)
        assert ((box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2) == pytest.approx(middle)


def test_the_path_is_drawn_where_the_drone_was_in_both_views():
    track = Track([0.0, 1.0], [1.0, 2.0], [3.0, 4.0], [0.5, 1.5], ["a.fly", "a.fly"])
    figure = draw_track(SCENARIO, track, None)
    for view, across, up in ((0, [1.0, 2.0], [3.0, 4.0]), (1, [1.0, 2.0], [0.5, 1.5])):
        line = coloured_line(figure, view, STATE_COLOURS[0])
        assert list(line.get_xdata())[:2] == across
        assert list(line.get_ydata())[:2] == up


def test_the_crossing_is_marked_where_the_drone_was_then():
    figure = draw_track(SCENARIO, TRACK, RESULT)
    marks = [line for line in figure.axes[0].lines if line.get_markerfacecolor() == "white"]
    assert [(mark.get_xdata()[0], mark.get_ydata()[0]) for mark in marks] == [(3.0, 2.0)]


def test_forty_states_have_different_styles():
    count = 40
    numbers = [float(n) for n in range(count)]
    track = Track(
        numbers, [n / 20 for n in numbers], [0.0] * count, [1.0] * count, [f"m.s{n}" for n in range(count)]
    )
    figure = draw_track(SCENARIO, track, None)
    handles = figure.axes[2].get_legend().legend_handles[:count]
    looks = {(handle.get_color(), str(handle._unscaled_dash_pattern)) for handle in handles}
    assert len(looks) == count


@pytest.mark.parametrize(
    "track",
    [
        Track(),
        Track([0.0], [1.0], [1.0], [1.0], [""]),
        Track([0.0], [nan], [1.0], [1.0], ["a"]),
        Track([0.0, 1.0, 2.0], [0.0, nan, 1e30], [0.0, inf, 1.0], [1.0, 1.0, -inf], ["a", "b", "$x_{$"]),
    ],
    ids=["empty", "one sample", "no position at all", "absurd numbers"],
)
@pytest.mark.parametrize("outcome", [None, RESULT])
@pytest.mark.filterwarnings("error")
def test_odd_tracks_are_drawn_no_farther_out_than_the_arena_is_large(tmp_path, track, outcome):
    path = tmp_path / "track.png"
    save_figure(draw_track(SCENARIO.model_copy(update={"frames": ()}), track, outcome), path)
    assert path.read_bytes().startswith(b"\x89PNG")
    low, high = draw_track(SCENARIO, track, outcome).axes[0].get_xlim()
    assert -20 < low < -5
    assert 5 < high < 20


def test_a_path_out_of_the_arena_is_shown():
    track = Track([0.0, 1.0], [0.0, 8.0], [0.0, 0.0], [1.0, 6.0], ["a", "a"])
    figure = draw_track(SCENARIO, track, None)
    assert figure.axes[0].get_xlim()[1] > 8.0
    assert figure.axes[1].get_ylim()[1] > 6.0


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf", ".PNG"])
def test_the_suffix_selects_the_format(tmp_path, suffix):
    path = tmp_path / f"scenario{suffix}"
    save_figure(draw_scenario(Scenario(name="long-hall", arena=Arena(length_x_m=60, width_y_m=6))), path)
    assert path.stat().st_size > 1000


def test_plots_that_cannot_be_written_are_refused_in_words(tmp_path):
    figure = draw_track(SCENARIO, TRACK, None)
    with pytest.raises(PlotError, match=r"'.*track\.xyz' has no known format; name it \.png, \.svg, \.pdf"):
        save_figure(figure, tmp_path / "track.xyz")
    with pytest.raises(PlotError, match=r"cannot write '.*no/track\.png': No such file"):
        save_figure(figure, tmp_path / "no" / "track.png")
