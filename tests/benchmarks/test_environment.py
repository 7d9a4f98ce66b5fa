"""The peers' environment: used again, and failing in words."""

from pathlib import Path

import pytest

from benchmarks.peers.environment import (
    FOLDER,
    REQUIREMENTS,
    PeerMissingError,
    ensure,
    why_not_installed,
)

LOG = Path("there/.venv-bench/pip-mujoco.log")


def write_program(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


@pytest.fixture
def folder(tmp_path):
    """An environment whose Python does what a test says, and never reaches for a network."""
    write_program(tmp_path / FOLDER / "bin" / "pip", "exit 1")
    return tmp_path / FOLDER


def test_what_is_installed_is_used_again_without_asking(folder):
    write_program(folder / "bin" / "python", "exit 1")
    (folder / "installed-mujoco").write_text(REQUIREMENTS["mujoco"])
    said = []
    assert ensure("mujoco", folder.parent, said.append) == folder / "bin" / "python"
    assert said == []


def test_another_requirement_is_installed_anew_and_remembered(folder):
    write_program(folder / "bin" / "python", 'echo "Collecting $*"')
    (folder / "installed-mujoco").write_text("mujoco==1.0")
    said = []
    ensure("mujoco", folder.parent, said.append)
    assert said[0] == f"installing {REQUIREMENTS['mujoco']}"
    assert said[1].startswith("Collecting -m pip install")
    assert (folder / "installed-mujoco").read_text() == REQUIREMENTS["mujoco"]


def test_a_failed_installation_says_why_and_keeps_what_pip_said(folder):
    write_program(folder / "bin" / "python", 'echo "ERROR: no wheel for this Python"; exit 1')
    with pytest.raises(PeerMissingError, match="could not be installed: no wheel for this Python") as failure:
        ensure("pyflyt", folder.parent, lambda _words: None)
    assert "\n" not in str(failure.value)
    assert not (folder / "installed-pyflyt").exists()
    assert "no wheel" in (folder / "pip-pyflyt.log").read_text()


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (["WARNING: … NewConnectionError(…)", "ERROR: No matching distribution found"], "no connection"),
        (["Collecting", "ERROR: Failed building wheel"], "Failed building wheel"),
        ([], "pip said nothing"),
    ],
)
def test_reasons(lines, words):
    reason = why_not_installed("mujoco>=3.3", lines, LOG)
    assert words in reason
    assert ".venv-bench/pip-mujoco.log" in reason
