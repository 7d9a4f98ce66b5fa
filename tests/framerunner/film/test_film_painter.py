"""What a film shows: the trail in its colours, gates, crossing times and verdict, at any size."""

import numpy as np
import pytest

from framerunner.film.arena_view import state_colour
from framerunner.film.film_painter import FilmPainter
from framerunner.film.style import GATE, GOOD, Letters, lay_out
from framerunner.film.timeline import Timeline
from framerunner.film.viewpoint import FilmCamera, Flyby
from framerunner.recording.collected import collect
from framerunner.recording.open_recording import recorded_flight
from scenarios.loader import load_scenario

SIZE = (640, 360)


@pytest.fixture(scope="module")
def flight(run_folder):
    with recorded_flight(run_folder) as recorded, collect(recorded) as collected:
        yield collected


@pytest.fixture(scope="module")
def timeline(flight):
    return Timeline(flight, load_scenario("test-case-1"))


def near(image, colour, tolerance=25):
    """How many pixels have about that colour."""
    return int((np.abs(image.astype(int) - np.array(colour)).max(axis=2) <= tolerance).sum())


def test_the_timeline_has_the_times_of_the_result(timeline, flight):
    times = dict(zip(flight.result.frames_crossed, flight.result.crossing_times_s, strict=True))
    end = timeline.at(timeline.end_s)
    assert end.crossed == pytest.approx(times, abs=1e-5)
    assert timeline.at(times["green"] - 0.01).crossed == pytest.approx({"red": times["red"]}, abs=1e-5)
    assert timeline.try_end_s == flight.result.try_time_s
    assert timeline.begin_s == -1.0
    assert timeline.result.verdict == "clean"
    assert timeline.stretches[0][0] == timeline.begin_s
    assert timeline.stretches[-1][1] == timeline.end_s
    assert all(a[1] == b[0] for a, b in zip(timeline.stretches, timeline.stretches[1:], strict=False))


def test_an_instant_is_interpolated_between_ticks(timeline, flight):
    moment, after = flight.moments[300:302]
    began_us = flight.began_us
    half = timeline.at(((moment.state.time_us + after.state.time_us) / 2 - began_us) / 1e6)
    assert half.position_arena_m[0] == pytest.approx((moment.state.x + after.state.x) / 2, abs=1e-9)
    assert half.state == moment.mission_state
    assert timeline.kinds[half.kind] == moment.mission_state.rpartition(".")[2]


def test_the_trail_has_the_colours_of_its_states(timeline):
    painter = FilmPainter(timeline, SIZE, 8.0)
    view = lay_out(*SIZE, 4 / 3).view
    early, late = (
        painter.paint(time_s)[view.y : view.bottom, view.x : view.right] for time_s in (0.5, timeline.end_s)
    )
    for kind in ("crossing", "return"):
        colour = state_colour(timeline.kinds.index(kind))
        assert near(late, colour) > near(early, colour) + 60


def test_chips_are_filled_when_gates_are_crossed_and_the_verdict_is_shown_last(timeline):
    painter = FilmPainter(timeline, SIZE, 8.0)
    box = lay_out(*SIZE, 4 / 3).figures
    end_s = timeline.end_s
    crossed = timeline.at(end_s).crossed
    before, between, over = (
        painter.paint(time_s, over=time_s == end_s)[box.y : box.bottom]
        for time_s in (crossed["red"] - 2.0, crossed["green"] + 1.0, end_s)
    )
    full = 1000
    assert [near(image, GATE["red"]) > full for image in (before, between, over)] == [False, True, True]
    assert [near(image, GATE["blue"]) > full for image in (before, between, over)] == [False, False, True]
    assert [near(image, GOOD) > full for image in (before, between, over)] == [False, False, True]


def test_base_and_gates_are_in_the_image_all_the_time(timeline):
    flyby = Flyby(timeline, (400, 300), 8.0)
    scenario = timeline.scenario
    points = [(scenario.base.x_m, scenario.base.y_m, 0.0), *(f.position_arena_m for f in scenario.frames)]
    for time_s in np.linspace(timeline.begin_s, timeline.end_s, 40):
        here = timeline.at(float(time_s)).position_arena_m
        pixels = flyby.at(float(time_s)).project(np.array([*points, here]))
        assert (pixels > 0).all()
        assert (pixels < (400, 300)).all()


def test_the_viewpoint_turns_slowly(timeline):
    flyby = Flyby(timeline, (400, 300), 8.0)
    eyes = [flyby.at(float(t)).eye_m for t in np.arange(timeline.begin_s, timeline.end_s, 8.0 / 25)]
    steps = np.linalg.norm(np.diff(eyes, axis=0), axis=1)
    assert steps.max() < 0.15  # metres from one image to the next
    assert np.linalg.norm(eyes[0] - eyes[-1]) > 2.0


def test_a_point_ahead_is_in_the_middle_and_one_to_the_right_is_right():
    view = FilmCamera(np.zeros(3), np.array([(0, -1.0, 0), (0, 0, -1.0), (1.0, 0, 0)]), 100.0, (50.0, 40.0))
    pixels = view.project(np.array([(2.0, 0.0, 0.0), (2.0, -1.0, 0.5), (-1.0, 0.0, 0.0)]))
    assert pixels[:2].tolist() == [[50.0, 40.0], [100.0, 15.0]]
    assert np.isnan(pixels[2]).all()


@pytest.mark.parametrize("size", [(240, 180), (480, 270), (720, 1280), (1920, 1080), (640, 640)])
def test_all_parts_are_within_the_image(timeline, size):
    layout = lay_out(*size, 4 / 3)
    for box in (layout.view, layout.camera, layout.state, layout.figures, layout.strip):
        assert box.x >= 0
        assert box.y >= 0
        assert box.right <= size[0]
        assert box.bottom <= size[1]
        assert min(box.width, box.height) > 0
    assert FilmPainter(timeline, size, 8.0).paint(20.0).shape == (size[1], size[0], 3)


def test_a_text_that_is_too_long_is_cut():
    letters = Letters()
    cut = letters.shortened("a very long name of a scenario", 20, 100)
    assert cut.endswith("…")
    assert letters.width(cut, 20) <= 100
    assert letters.shortened("short", 20, 100) == "short"


def test_letters_at_the_border_are_cut_off_and_controls_become_spaces():
    image = np.full((20, 40, 3), 255, np.uint8)
    assert Letters().write(image, (20.0, 15.0), "\n\x1bWWW", 14, (0, 0, 0)) > 20
    assert image.min() < 50
