"""`mission new` writes a valid mission with comments that flies, and overwrites nothing."""

import fnmatch
import re
import shlex
import tomllib
from pathlib import Path

import pytest

from framerunner.cli import run
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.chart.vocabulary import Vocabulary
from offboard.mission import TEMPLATES, load_mission, new_mission
from offboard.pilot import Pilot
from offboard.pilot_file import read_pilot
from scenarios.loader import load_scenario

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def new(*arguments):
    assert run(["mission", "new", *arguments]) == 0


def fly(scenario, mission, pilot=None):
    loaded = load_mission(mission, pilot and read_pilot(pilot))
    return fly_lockstep(FlightPlan(load_scenario(scenario), loaded))


def with_exercise_done(text):
    """Green and blue as well, by removing the # as the comment says."""
    start, end = text.index("  # First exercise"), text.index("  go_home:")
    lines = text[start:end].splitlines()[1:]
    done = "\n".join(line.replace("  # ", "  ", 1) for line in lines)
    return text[:start].replace("then: go_home", "then: green") + done + "\n\n" + text[end:]


@pytest.mark.parametrize("scenario", ["test-case-1", "test-case-2", "test-case-3"])
def test_the_starter_crosses_red_and_lands(scenario):
    new("mine")
    result = fly(scenario, "mine.yaml").result
    assert result.ended == "finished", result.reason
    assert result.frames_crossed == ("red",)
    assert result.landed_on_base
    assert result.landing_error_m < 0.15


def test_the_starter_with_python_does_so_too():
    new("mine", "--python")
    result = fly("test-case-1", "mine.yaml", "mine.py").result
    assert result.ended == "finished", result.reason
    assert result.frames_crossed == ("red",)
    assert result.landed_on_base
    assert result.seconds_in_state["circle"] > 1.0  # its own primitive was flown


def test_its_first_exercise_flies_the_whole_challenge():
    new("mine")
    path = Path("mine.yaml")
    path.write_text(with_exercise_done(path.read_text(encoding="utf-8")), encoding="utf-8")
    assert fly("test-case-1", "mine.yaml").result.verdict == "clean"


@pytest.mark.parametrize("python", [[], ["--python"]], ids=["yaml", "python"])
def test_what_it_prints_can_be_pasted(capsys, python):
    new("mine", "--out", "a folder", *python)
    said = capsys.readouterr().out
    commands = [shlex.split(line)[1:] for line in said.splitlines() if line.startswith("  framerunner ")]
    assert [words[:2] for words in commands] == [["mission", "check"], ["fly", "test-case-1"]]
    assert run(commands[0]) == 0
    assert "good" in capsys.readouterr().out
    assert sorted(path.name for path in Path("a folder").iterdir()) == ["mine.py", "mine.yaml"][not python :]


@pytest.mark.parametrize("python", [False, True])
def test_it_explains_every_word_it_uses_and_is_neatly_laid_out(python):
    files = new_mission("mine", Path(), python=python)
    text = files.texts[files.mission]
    head, _, chart = text.partition("\nname: mine\n")
    words = set(re.findall(r"- ([a-z_]+)(?= #|$)", chart, re.MULTILINE))
    assert words >= {"hover", "fly_to_goal", "look_to_frame", "land"}
    assert [word for word in words if word not in head] == []
    for written in files.texts.values():
        assert "{%" not in written
        assert "{{" not in written
        assert max(map(len, written.splitlines())) <= 110
        assert written.endswith("\n")
        assert not written.endswith("\n\n")
    assert "\n\n\n" not in text


def test_the_python_file_shows_with_the_diagram(capsys):
    new("mine", "--python")
    capsys.readouterr()
    assert run(["mission", "show", "mine.yaml", "--pilot", "mine.py"]) == 0
    shown = capsys.readouterr().out
    assert "red.circle : during / circle_frame" in shown
    assert shown.count("landed --> [*]") == 1


def test_nothing_is_overwritten(capsys):
    Path("mine.py").write_text("# dear to me\n", encoding="utf-8")
    assert run(["mission", "new", "mine", "--python"]) == 2
    assert "mine.py is there already and is left as it is" in capsys.readouterr().err
    assert not Path("mine.yaml").exists()
    new("mine")
    assert run(["mission", "new", "mine"]) == 2
    assert Path("mine.py").read_text(encoding="utf-8") == "# dear to me\n"


@pytest.mark.parametrize("name", ["Mine", "mine.yaml", "../mine", "1st", "", "a b", "m" * 61])
def test_a_bad_name_is_refused(capsys, name):
    assert run(["mission", "new", name]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: NAME '{name}': use small letters")
    assert said.count("\n") == 1
    assert list(Path().iterdir()) == []


def test_a_folder_that_cannot_be_made_is_refused(capsys):
    Path("file").touch()
    assert run(["mission", "new", "mine", "--out", "file/folder"]) == 2
    assert "cannot be written" in capsys.readouterr().err


@pytest.mark.parametrize("command", [["mission", "check", "mine.yaml"], ["mission", "show", "mine.yaml"]])
def test_a_pilot_that_cannot_be_used_is_refused_in_one_line(capsys, command):
    new("mine", "--python")
    Path("bad.py").write_text("class MyPilot(Pilot):\n    pass\n", encoding="utf-8")
    capsys.readouterr()
    for file, message in (("none.py", "none.py: cannot be read"), ("bad.py", "bad.py:1: cannot be imported")):
        assert run([*command, "--pilot", file]) == 2
        said = capsys.readouterr()
        assert message in said.err
        assert said.err.count("\n") == 1
        assert said.out == ""


def test_the_documents_name_every_word_of_a_mission():
    text = (ROOT / "docs" / "missions.md").read_text(encoding="utf-8")
    vocabulary = Vocabulary(Pilot, {})
    words = [*vocabulary.primitives, *vocabulary.values]
    assert [word for word in words if not re.search(rf"`{word}\b", text)] == []


@pytest.mark.parametrize("kind", ["yaml", "python"])
def test_the_examples_of_the_documents_are_good(kind):
    text = (ROOT / "docs" / "missions.md").read_text(encoding="utf-8")
    example = re.search(rf"```{kind}\n(.*?)```", text, re.DOTALL).group(1)
    if kind == "python":
        Path("mine.py").write_text(example, encoding="utf-8")
        assert {"creep", "far_away", "careful_m_s"} <= set(dir(read_pilot("mine.py").pilot_class()))
    else:
        Path("mine.yaml").write_text(example, encoding="utf-8")
        assert fly("empty", "mine.yaml").result.ended == "finished"


def test_its_templates_are_shipped():
    patterns = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    shipped = patterns["package-data"]["offboard"]
    templates = [f"templates/{path.name}" for path in TEMPLATES.iterdir()]
    assert len(templates) == 2
    assert all(any(fnmatch.fnmatch(path, pattern) for pattern in shipped) for path in templates)
