"""The page and the table are complete and self-contained, and text in them is escaped."""

import csv
import re
import shlex
from dataclasses import replace
from html.parser import HTMLParser
from io import StringIO
from pathlib import Path

import pytest

from framerunner.cli import build_app
from framerunner.evaluation.backends import Pool
from framerunner.evaluation.evaluate import EvaluationSettings
from framerunner.evaluation.plan import plan_level
from framerunner.evaluation.report import picked_for_plots, replay_command, write_report
from framerunner.evaluation.rows import COLUMNS, csv_text
from framerunner.evaluation.statistics import summarise
from framerunner.evaluation.store import open_folder
from framerunner.runs.track import Track
from offboard.mission import load_mission
from tests.framerunner.evaluation.flights import made_row

EVIL = "<script>alert('$x_{')</script>"
TRACK = Track([0.0, 9.0], [0.0, 2.0], [0.0, 1.0], [0.5, 1.0], ["red.turning", "red.turning"])
EMPTY = {"link", "meta", "img", "br", "use", "path", "input", "hr"}


class Elements(HTMLParser):
    """Checks that elements are closed as they were opened, and lists them."""

    def __init__(self):
        super().__init__()
        self.open, self.seen, self.ids, self.sources = [], [], [], []

    def handle_starttag(self, tag, attrs):
        self.seen.append(tag)
        given = dict(attrs)
        self.ids += [given["id"]] if "id" in given else []
        self.sources += [given[name] for name in ("src", "href", "xlink:href") if name in given]
        if tag not in EMPTY:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in EMPTY:
            self.open.pop()

    def handle_endtag(self, tag):
        if tag not in EMPTY:
            assert self.open.pop() == tag


def report(path, rows, title="level calm", command="framerunner evaluate"):
    plan = plan_level("calm", 1, 6, load_mission("frame_challenge"))
    with open_folder(path, plan.identity) as folder:
        for scenario, row in zip(plan.scenarios, rows, strict=False):
            folder.keep(scenario, row.model_copy(update={"scenario": scenario.name}))
        drawn = []
        settings = EvaluationSettings(
            plan=replace(plan, title=title),
            pool=Pool(),
            out=path,
            again=False,
            against=None,
            mission="frame_challenge",
            pilot=None,
            command=command,
        )
        write_report(folder, settings, summarise(rows), None, lambda *counts: drawn.append(counts))
        return (path / "report.html").read_text(encoding="utf-8"), drawn


def test_the_page_is_self_contained_and_shows_each_failure(tmp_path):
    rows = [
        made_row("calm-1"),
        made_row("calm-2", "timed out", track=TRACK, seed=2),
        made_row("calm-3", "error", reason=f"ValueError: {EVIL}", traceback=f"Traceback {EVIL}"),
        made_row("calm-4", "crashed", mission_state=EVIL, seconds_in_state={EVIL: 3.0}),
    ]
    html, drawn = report(tmp_path / "a b", rows, title=EVIL, command=f"framerunner evaluate {EVIL}")
    elements = Elements()
    elements.feed(html)
    assert elements.open == []
    assert "script" not in elements.seen
    assert len(elements.ids) == len(set(elements.ids))
    assert all(source.startswith(("#", "data:image/png;base64,")) for source in elements.sources)
    inner = {source[1:] for source in elements.sources if source.startswith("#")}
    assert inner <= set(elements.ids)
    assert not re.search(r"url\((?!#)|@import", html)
    assert elements.seen.count("svg") == 3
    assert elements.seen.count("img") == 1
    assert drawn[-1] == (2, 3)
    command = replay_command(tmp_path / "a b" / "scenarios" / "calm-2.yaml", "frame_challenge", None, 2)
    assert command.replace("'", "&#39;") in html
    assert "50" not in re.search(r"<b>(.*?) %</b>landed in time", html).group(1)
    assert "25.0" in re.search(r"<b>(.*?) %</b>landed in time", html).group(1)


def test_a_page_without_failures_and_one_without_flights(tmp_path):
    html, drawn = report(tmp_path / "good", [made_row("calm-1")])
    assert "Why flights were not clean" not in html
    assert "class open" not in html
    html, _ = report(tmp_path / "open", [made_row("calm-1", mission_class="open")])
    assert "(class open)" in html
    assert "times the bound" not in html  # a flight of an older version, without one
    rows = [
        made_row(f"calm-{n}", bound_s=20.0, times_bound=times) for n, times in enumerate((2.5, 4.5, 3.25))
    ]
    html, _ = report(tmp_path / "bounded", [*rows, made_row("calm-9", "crashed", bound_s=20.0)])
    assert "3.25 times the bound" in html
    assert drawn == []
    bad = [made_row("calm-1", "error", reason="X", frames_crossed=(), crossing_offsets_m=())]
    html, _ = report(tmp_path / "bad", bad)
    assert "Why flights were not clean" in html


def test_the_same_flights_make_the_same_page(tmp_path):
    rows = [made_row("calm-1"), made_row("calm-2", "timed out", track=TRACK)]
    first, _ = report(tmp_path / "a", rows)
    second, _ = report(tmp_path / "b", rows)
    assert first.replace("/a/", "/b/") == second


def test_the_replay_is_a_command_that_flies():
    command = replay_command(Path("runs/my own/scenarios/calm-17.yaml"), "a.yaml", "mine.py", 17)
    assert command == (
        "framerunner fly 'runs/my own/scenarios/calm-17.yaml' --mission a.yaml --pilot mine.py "
        "--seed 17 --lockstep"
    )
    late = replay_command(Path("calm-17.yaml"), "a.yaml", None, 17, "lag=0.5")
    assert late == "framerunner fly calm-17.yaml --mission a.yaml --seed 17 --response lag=0.5 --lockstep"
    build_app().parse_args(shlex.split(command)[1:], print_error=False, exit_on_error=False)


def test_every_cause_is_plotted_once_before_any_is_plotted_twice():
    rows = [made_row(f"a{number}", "timed out") for number in range(50)]
    rows += [made_row("b", "crashed"), made_row("c", "aborted")]
    picked = picked_for_plots(summarise(rows), 4)
    assert len(picked) == 4
    assert {"b", "c"} < picked
    assert len(picked_for_plots(summarise(rows), 100)) == 52


def test_the_table_has_a_row_for_each_flight_and_keeps_the_numbers():
    rows = [
        made_row("a", seconds_in_state={"turning": 3.1999999999999997, "crossing": 4.0}),
        made_row("b", "timed out", reason='he said "no", twice'),
        made_row("c", "error", reason="＝cmd|' /C calc'!A0"),
    ]
    text = csv_text(rows)
    assert text == csv_text(rows)
    read = list(csv.DictReader(StringIO(text)))
    assert tuple(read[0]) == COLUMNS
    assert [line["scenario"] for line in read] == ["a", "b", "c"]
    assert read[0]["crossing_offsets_m"] == "0.01;0.02;0.03"
    assert read[0]["seconds_in_state"] == "turning=3.1999999999999997;crossing=4.0"
    assert (read[0]["landed_on_base"], read[1]["landed_on_base"], read[1]["landing_error_m"]) == (
        "true",
        "false",
        "",
    )
    assert read[1]["reason"] == 'he said "no", twice'
    assert (read[2]["verdict"], read[2]["reason"]) == ("error", "'＝cmd|' /C calc'!A0")
    assert {read[2][name] for name in ("try_time_s", "contacts", "landed_on_base", "ended")} == {""}
    assert "wall_time_s" not in read[0]


@pytest.mark.parametrize("count", [0, 1])
def test_a_table_of_no_row_or_one(count):
    assert len(csv_text([made_row()] * count).splitlines()) == 1 + count
