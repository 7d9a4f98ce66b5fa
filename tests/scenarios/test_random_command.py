"""`framerunner scenario random`."""

import pytest

from framerunner.cli import run
from scenarios.loader import dump_yaml, load_scenario
from scenarios.random_scenarios import load_level, random_scenario

DRAW = ["scenario", "random", "--level", "calm", "--seed"]


def test_it_prints_the_scenario(capsys):
    assert run([*DRAW, "17"]) == 0
    assert capsys.readouterr().out == dump_yaml(random_scenario(load_level("calm"), 17))


def test_it_writes_a_file_that_can_be_flown(tmp_path, capsys):
    path = tmp_path / "calm-17.yaml"
    assert run([*DRAW, "17", "--out", str(path)]) == 0
    captured = capsys.readouterr()
    assert captured.out == ""
    assert str(path) in captured.err
    assert load_scenario(path) == random_scenario(load_level("calm"), 17)
    assert run([*DRAW, "18", "--out", str(path)]) == 2
    assert "is there already and is left as it is" in capsys.readouterr().err
    assert load_scenario(path) == random_scenario(load_level("calm"), 17)


def test_help_shows_how(capsys):
    assert run(["scenario", "random", "--help"]) == 0
    assert "framerunner scenario random --level calm --seed 17 --out" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([*DRAW, "-1"], "seed -1 is out of range; use a whole number from 0"),
        ([*DRAW, "1.5"], "--seed"),
        ([*DRAW, "x"], "--seed"),
        (DRAW[:-1], "--seed"),
        (["scenario", "random", "--seed", "1"], "--level"),
        (["scenario", "random", "--level", "clam", "--seed", "1"], "did you mean calm?"),
        ([*DRAW, "1", "--out", "no/such/folder/a.yaml"], "--out no/such/folder/a.yaml: cannot be written"),
        ([*DRAW, "1", "--out", "."], ". is there already"),
    ],
)
def test_bad_input_is_one_line(tmp_path, monkeypatch, capsys, arguments, said):
    monkeypatch.chdir(tmp_path)
    assert run(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert len(captured.err.splitlines()) == 1
    assert said in captured.err
    assert list(tmp_path.iterdir()) == []
