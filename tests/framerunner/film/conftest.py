"""Flights, flown once for all tests of films."""

import pytest

from framerunner.cli import run

SHORT = """name: short
frames: [{colour: red, x_m: 2.0, y_m: 0.0, z_m: 1.0}]
try_limit_s: 4
"""


def fly(out, *arguments):
    code = run(["fly", *arguments, "--lockstep", "--out", str(out)])
    (folder,) = out.iterdir()
    return code, folder


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory):
    """Of a complete flight, recorded."""
    code, folder = fly(tmp_path_factory.mktemp("film") / "runs", "test-case-1", "--record")
    assert code == 0
    return folder


@pytest.fixture(scope="session")
def short_folder(tmp_path_factory):
    """Of a flight of four seconds, without a recording."""
    path = tmp_path_factory.mktemp("film")
    (path / "short.yaml").write_text(SHORT, encoding="utf-8")
    code, folder = fly(path / "runs", str(path / "short.yaml"))
    assert code == 1
    return folder


@pytest.fixture(scope="session")
def recorded_folder(tmp_path_factory):
    """Of the same, recorded."""
    path = tmp_path_factory.mktemp("film")
    (path / "short.yaml").write_text(SHORT, encoding="utf-8")
    return fly(path / "runs", str(path / "short.yaml"), "--record")[1]
