"""Programs that are run, the peers' environment, and the command line."""

import sys
from pathlib import Path

import pytest

from benchmarks.__main__ import read_options
from benchmarks.compare import BadResultError
from benchmarks.peers.job import EXIT_CANNOT_FLY
from benchmarks.run import (
    FOLDER,
    REQUIREMENTS,
    PeerMissingError,
    ensure_peer,
    job_for,
    run_program,
    why_not_installed,
)
from scenarios.loader import load_scenario

LOG = Path("there/.venv-bench/pip-mujoco.log")


def python(text):
    return [sys.executable, "-c", text]


def test_a_program_gets_its_input_and_runs_in_single_threads():
    text = "import os, sys; print(sys.stdin.read(), os.environ['OMP_NUM_THREADS'])"
    assert run_program(python(text), "hello") == "hello 1\n"


def test_a_program_that_cannot_fly_is_quoted():
    text = f"import sys; print('noise\\nneeds EGL', file=sys.stderr); sys.exit({EXIT_CANNOT_FLY})"
    with pytest.raises(BadResultError, match=r"^needs EGL$"):
        run_program(python(text), "")


def test_a_program_that_fails_is_told_from_one_that_cannot():
    with pytest.raises(BadResultError, match=r"^failed: ZeroDivisionError: division by zero$"):
        run_program(python("1 / 0"), "")
    with pytest.raises(BadResultError, match=r"^failed: ended with code 7$"):
        run_program(python("raise SystemExit(7)"), "")


def test_the_job_shows_the_peers_what_our_camera_sees():
    job = job_for(load_scenario("test-case-1"), "test-case-1", 20.0, 10.0)
    assert len(job.boxes) == 1 + 3 * 4
    assert job.vertical_fov_rad == pytest.approx(1.286, abs=1e-3)  # of 1.57 over the width of 4 : 3
    red = [box for box in job.boxes if box.rgb == (1.0, 0.0, 0.0)]
    assert sum(box.centre_m[2] for box in red) / 4 == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--repeats", "0"], "--repeats 0: must be 1 or more"),
        (["--seconds", "nan"], "--seconds nan: must be from 5 to 600"),
        (["--peers", "gazebo"], "invalid choice: 'gazebo'"),
        (["--json", "nowhere/at/all.json"], "there is no folder nowhere/at"),
    ],
)
def test_bad_options_are_refused_before_anything_is_measured(words, complaint, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["benchmarks", *words])
    with pytest.raises(SystemExit) as ended:
        read_options()
    assert ended.value.code == 2
    assert complaint in capsys.readouterr().err


def write_program(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


@pytest.fixture
def folder(tmp_path):
    """An environment whose Python does what a test says, and uses no network."""
    write_program(tmp_path / FOLDER / "bin" / "pip", "exit 1")
    return tmp_path / FOLDER


def test_what_is_installed_is_used_again_without_asking(folder):
    write_program(folder / "bin" / "python", "exit 1")
    (folder / "installed-mujoco").write_text(REQUIREMENTS["mujoco"])
    lines = []
    assert ensure_peer("mujoco", folder.parent, lines.append) == folder / "bin" / "python"
    assert lines == []


def test_another_requirement_is_installed_and_remembered(folder):
    write_program(folder / "bin" / "python", 'echo "Collecting $*"')
    (folder / "installed-mujoco").write_text("mujoco==1.0")
    lines = []
    ensure_peer("mujoco", folder.parent, lines.append)
    assert lines[0] == f"installing {REQUIREMENTS['mujoco']}"
    assert lines[1].startswith("Collecting -m pip install")
    assert (folder / "installed-mujoco").read_text() == REQUIREMENTS["mujoco"]


def test_a_failed_installation_says_why_and_keeps_what_pip_said(folder):
    write_program(folder / "bin" / "python", 'echo "ERROR: no wheel for this Python"; exit 1')
    with pytest.raises(PeerMissingError, match="could not be installed: no wheel for this Python") as failure:
        ensure_peer("pyflyt", folder.parent, lambda _words: None)
    assert "\n" not in str(failure.value)
    assert not (folder / "installed-pyflyt").exists()
    assert "no wheel" in (folder / "pip-pyflyt.log").read_text()


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (["WARNING: … NewConnectionError(…)", "ERROR: No matching distribution found"], "no connection"),
        (["Collecting", "ERROR: Failed building wheel"], "Failed building wheel"),
        ([], "pip printed nothing"),
    ],
)
def test_reasons(lines, words):
    reason = why_not_installed("mujoco>=3.3", lines, LOG)
    assert words in reason
    assert ".venv-bench/pip-mujoco.log" in reason
