"""The examples: short, and each does what it says. Those that need a simulator are in tests/realtime."""

import runpy
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
FLOWN_IN_REAL_TIME = {"pymavlink_script.py", "test_with_mavsdk.py"}
PRINTED = {
    "evaluate_and_plot.py": "landed: 100.0 %",
    "fly_and_read.py": "crossed the red frame",
    "gymnasium_loop.py": "the red frame is 2.",
    "own_detector.py": "clean after",
    "own_pilot.py": "CarefulPilot: clean",
}


def test_every_example_is_run_by_a_test():
    assert {path.name for path in EXAMPLES.iterdir() if path.suffix} == {*PRINTED, *FLOWN_IN_REAL_TIME}


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.name)
def test_examples_are_short(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 30


@pytest.mark.parametrize("name", PRINTED)
def test_an_example_does_what_it_says(name, tmp_path, monkeypatch, capsys):
    if name == "gymnasium_loop.py":
        pytest.importorskip("gymnasium")
    picture = tmp_path / "offsets.png"
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.setattr("sys.argv", [name, "1", str(picture)])
    runpy.run_path(str(EXAMPLES / name), run_name="__main__")
    assert PRINTED[name] in capsys.readouterr().out
    assert picture.exists() is (name == "evaluate_and_plot.py")
