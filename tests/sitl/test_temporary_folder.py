"""Temporary folders, and what a program that was killed has left of them."""

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from sitl.temporary_folder import TemporaryFolder

PREFIX = "framerunner-test-"
MAKE = f"""
import time
from sitl.temporary_folder import TemporaryFolder
folder = TemporaryFolder({PREFIX!r})
print(folder.path, flush=True)
(folder.path / "file").touch()
time.sleep(60)
"""


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    """The system's folder for temporary ones."""
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    return tmp_path


def names(place):
    return sorted(each.name for each in place.iterdir())


def test_it_is_removed_when_it_is_closed_or_not_used_any_more(place):
    first, second = TemporaryFolder(PREFIX), TemporaryFolder(PREFIX)
    (first.path / "file").touch()
    assert len(names(place)) == 2
    first.close()
    assert names(place) == [second.path.name]
    del second
    assert names(place) == []


def test_that_of_a_program_that_was_killed_is_removed_by_the_next_and_that_of_a_running_one_is_not(place):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen([sys.executable, "-c", MAKE], stdout=subprocess.PIPE, env=environment) as other:
        try:
            folder = Path(other.stdout.readline().decode().strip())
            TemporaryFolder(PREFIX).close()
            assert folder.is_dir()
        finally:
            other.send_signal(signal.SIGKILL)
            other.wait()
    assert folder.is_dir()
    TemporaryFolder("framerunner-other-").close()
    assert folder.is_dir()
    TemporaryFolder(PREFIX).close()
    assert names(place) == []


def test_links_and_what_they_point_to_are_left_alone(place):
    kept = place / "kept"
    kept.mkdir()
    (kept / "file").touch()
    left = place / f"{PREFIX}left"
    left.mkdir()
    (left / "link").symlink_to(kept)
    (place / f"{PREFIX}link").symlink_to(kept)
    (place / f"{PREFIX}file").touch()
    TemporaryFolder(PREFIX).close()
    assert names(place) == [f"{PREFIX}file", f"{PREFIX}link", "kept"]
    assert (kept / "file").exists()


def test_a_folder_of_another_user_is_left_alone(place, monkeypatch):
    (place / f"{PREFIX}theirs").mkdir()
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    TemporaryFolder(PREFIX).close()
    assert names(place) == [f"{PREFIX}theirs"]
