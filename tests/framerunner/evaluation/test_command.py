"""`framerunner evaluate` from the command line."""

import re
from pathlib import Path

import pytest

from framerunner.cli import run
from framerunner.evaluation import evaluate as evaluate_module
from framerunner.evaluation.rows import EvaluationRow
from framerunner.evaluation.terminal import EvaluationProgress
from scenarios.loader import load_scenario
from tests.framerunner.evaluation.flights import made_row, write_scenarios


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def refused(capsys):
    def refuse(*arguments):
        code = run(["evaluate", *map(str, arguments)])
        said = capsys.readouterr()
        assert (code, said.out) == (2, "")
        (line,) = said.err.splitlines()
        return line.removeprefix("error: ")

    return refuse


def evaluate(capsys, *arguments):
    code = run(["evaluate", *map(str, arguments)])
    return code, capsys.readouterr()


def test_flights_are_flown_once_counted_and_reported(capsys):
    write_scenarios(Path("mine"))
    code, said = evaluate(capsys, "mine", "--jobs", 1)
    assert code == 0, said.err
    (folder,) = Path("runs").iterdir()
    assert re.fullmatch(r"evaluate-mine-explorer-[0-9a-f]{6}", folder.name)
    assert "timed out" in said.out and "100.0 %" in said.out
    assert f"left in {folder}/: report.html, results.csv" in said.out
    assert "3 of 3 flown, 0 clean, 0 completed," in said.err
    table = (folder / "results.csv").read_bytes()
    assert table.count(b"\n") == 4
    assert b"wall_time" not in table

    code, said = evaluate(capsys, "mine", "--jobs", 2)
    assert code == 0
    assert "3 of 3 flights are in" in said.err and "flown" not in said.err
    assert (folder / "results.csv").read_bytes() == table

    code, said = evaluate(capsys, "mine", "--jobs", 1, "--again")
    assert "3 of 3 flown" in said.err
    assert (folder / "results.csv").read_bytes() == table


def test_a_level_is_drawn_with_consecutive_seeds(capsys, monkeypatch):
    def made(tasks, _pool, _terms):
        for task in tasks:
            yield made_row(task.scenario.name, seed=task.seed)

    monkeypatch.setattr(evaluate_module, "fly_all", made)
    options = ["--count", 3, "--seed", 8, "--sensors", "flow", "--out", "here"]
    code, said = evaluate(capsys, "--level", "calm", *options)
    assert code == 0, said.err
    assert load_scenario("here/scenarios/calm-8.yaml").sensors == "flow"
    names = [path.name for path in sorted(Path("here/scenarios").iterdir())]
    assert names == ["calm-10.yaml", "calm-8.yaml", "calm-9.yaml"]
    lines = Path("here/results.csv").read_text(encoding="utf-8").splitlines()
    assert [line.split(",")[:3] for line in lines[1:]] == [
        [f"calm-{seed}", "frame_challenge", str(seed)] for seed in (8, 9, 10)
    ]


def test_a_fault_of_the_program_is_reported_with_its_traceback(capsys, monkeypatch):
    def made(tasks, _pool, _terms):
        for task in tasks:
            yield made_row(task.scenario.name, "error", reason="ValueError: no", traceback="Traceback: why")

    monkeypatch.setattr(evaluate_module, "fly_all", made)
    code, said = evaluate(capsys, "test-case-1", "--out", "here")
    assert code == 1
    assert "ValueError" in said.out
    assert Path("here/errors/test-case-1.txt").read_text(encoding="utf-8") == "Traceback: why"
    assert "Traceback: why" in Path("here/report.html").read_text(encoding="utf-8")


def test_two_evaluations_are_compared(capsys):
    write_scenarios(Path("mine"), (1, 2, 3))
    write_scenarios(Path("others"), (2, 3, 4))
    write_scenarios(Path("strange"), (7,))
    paper = ["--mission", "frame_challenge", "--out", "before"]
    assert evaluate(capsys, "mine", "--jobs", 1, *paper)[0] == 0
    options = ["--jobs", 1, "--out", "after", "--mission", "soft_landing"]
    code, said = evaluate(capsys, "others", *options, "--compare", "before")
    assert code == 0, said.err
    assert "against before (2 same scenarios)" in said.out
    assert "2 of 2 flights are the same to the last bit" in said.out  # both end before landing
    assert "not compared: 1 flights of this evaluation and 1 of the other" in said.out
    assert "Against before" in Path("after/report.html").read_text(encoding="utf-8")
    code, said = evaluate(capsys, "strange", "--compare", "before")
    assert code == 2
    assert "no scenario is in both; fly that evaluation's: framerunner evaluate before/scenarios" in said.err
    assert not list(Path("runs").glob("*")) if Path("runs").exists() else True


def test_contradicting_options_are_refused(refused):
    assert refused().startswith("--level: say what to fly")
    assert "not both" in refused("test-case-1", "--level", "calm")
    assert refused("test-case-1", "--count", 3).startswith("--count 3: is for scenarios of a level")
    assert refused("test-case-1", "--seed", 3).startswith("--seed 3: ")
    assert refused("--level", "calm", "--count", 0).startswith("--count 0: ")
    assert refused("--level", "breezy").startswith('unknown level "breezy"')
    assert refused("nowhere").startswith('unknown scenario "nowhere"')
    assert refused("test-case-1", "--jobs", 0).startswith("--jobs 0: ")
    assert refused("test-case-1", "--backend", "dask").startswith("--backend dask: needs")
    assert "--backend" in refused("test-case-1", "--backend", "cray")
    assert "hover_more" in refused("test-case-1", "--mission", "hover_more")
    assert "did you mean 'lag'" in refused("test-case-1", "--response", "lagg=0.5")
    assert "nowhere.py" in refused("test-case-1", "--pilot", "nowhere.py")
    assert refused("test-case-1", "--compare", "nothing").startswith("--compare nothing: holds no evaluation")
    assert not Path("runs").exists()


def test_a_folder_of_something_else_is_refused(refused, capsys):
    write_scenarios(Path("mine"), (1,))
    assert evaluate(capsys, "mine", "--jobs", 1, "--out", "here")[0] == 0
    line = refused("mine", "--mission", "soft_landing", "--out", "here")
    assert line == (
        "--out here: has an evaluation of mission explorer, not soft_landing; "
        "choose another, or --again to fly it again"
    )
    assert refused("mine", "--out", "here", "--compare", "here").startswith("--compare here: is this")


def test_a_worker_of_another_version_is_refused(refused, monkeypatch):
    monkeypatch.setattr(evaluate_module, "fly_all", lambda _tasks, _pool, _terms: iter_rows(version="0.0.1"))
    line = refused("test-case-1", "--out", "here", "--backend", "dask", "--address", "tcp://10.0.0.1:1")
    assert "has framerunner 0.0.1, not" in line


def iter_rows(**values):
    yield made_row("test-case-1", **values)


def test_progress_shows_counts_verdicts_speed_and_time_left(monkeypatch):
    now = [100.0]
    monkeypatch.setattr("framerunner.evaluation.terminal.time.monotonic", lambda: now[0])
    rows: list[EvaluationRow] = [made_row("a"), made_row("b", "timed out")]
    progress = EvaluationProgress(130, rows)
    assert progress.text() == "2 of 130 flown, 1 clean, 0 completed"
    now[0] += 2.0
    progress.add(made_row("c", "completed"))
    assert progress.text() == ("3 of 130 flown, 1 clean, 1 completed, 45 times real time, 4:14 left")


def test_help_shows_examples(capsys):
    assert run(["evaluate", "--help"]) == 0
    shown = capsys.readouterr().out
    assert "framerunner evaluate --level calm --count 200 --seed 1" in shown.partition("Example")[2]
