"""A disk that fills up during a flight: each file that does not fit is one line, the verdict is kept."""

import re
import subprocess
import sys

import pytest

from tests.processes import ROOT

SHORT = "name: short\nbase: {x_m: 0, y_m: 0}\nstart: {x_m: 0, y_m: 0}\nframes: []\ntry_limit_s: 3\n"
ENVIRONMENT = {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
ON_SMALL_DISK = 'mount -t tmpfs -o size="$0" small disk && exec "$@"'


def can_mount(folder):
    (folder / "disk").mkdir()
    trial = ["unshare", "--mount", "--map-root-user", "sh", "-c", ON_SMALL_DISK, "16k", "true"]
    try:
        return subprocess.run(trial, cwd=folder, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        return False


def run(folder, size, *arguments):
    """Run a command in a folder with a `disk` of a size."""
    if not can_mount(folder):
        pytest.skip("a small disk cannot be mounted on this system")
    program = [sys.executable, "-m", "framerunner", *arguments]
    command = ["unshare", "--mount", "--map-root-user", "sh", "-c", ON_SMALL_DISK, size, *program]
    return subprocess.run(command, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, check=False)


def test_a_flight_that_fills_the_disk_keeps_its_result_and_names_the_missing_files(tmp_path):
    (tmp_path / "short.yaml").write_text(SHORT, encoding="utf-8")
    done = run(tmp_path, "84k", "fly", "short.yaml", "--lockstep", "--record", "--video", "--out", "disk")
    assert done.returncode == 1, done.stderr
    assert done.stdout.startswith("timed out after 3.0 s")
    assert "see it again" in done.stdout  # by its plan and its result
    lines = [line for line in done.stderr.splitlines() if "times real time" not in line]
    for name in ("video.avi", "recording"):
        assert sum(line.startswith("warning: ") and name in line for line in lines) == 1, lines
    assert not any("result.json" in line for line in lines), lines
    assert "Traceback" not in done.stderr


def test_a_flight_does_not_begin_where_its_plan_and_result_do_not_fit(tmp_path):
    done = run(tmp_path, "60k", "fly", "--lockstep", "--out", "disk")
    assert done.returncode == 2
    assert done.stderr == (
        "error: --out disk: cannot be written to (No space left on device); free some space "
        "or choose another\n"
    )


def test_an_evaluation_on_a_full_disk_counts_what_it_flew_and_ends_in_one_line(tmp_path):
    for number in range(4):
        text = SHORT.replace("short", f"short-{number}")
        (tmp_path / f"short-{number}.yaml").write_text(text, encoding="utf-8")
    names = [f"short-{number}.yaml" for number in range(4)]
    done = run(tmp_path, "16k", "evaluate", *names, "--jobs", "1", "--out", "disk/evaluation")
    assert done.returncode == 2
    flown = int(re.search(r"the first (\d) of 4", done.stdout)[1])
    assert re.search(rf"^ timed out +{flown} ", done.stdout, re.MULTILINE), done.stdout
    assert done.stderr.splitlines()[-1] == (
        "error: --out disk/evaluation: cannot be written to (No space left on device); "
        "free some space or choose another; what was kept stays"
    )
    assert "Traceback" not in done.stderr


def test_output_that_cannot_be_written_is_one_line():
    with open("/dev/full", "w", encoding="utf-8") as full:
        program = [sys.executable, "-m", "framerunner", "scenario", "list"]
        done = subprocess.run(
            program, cwd=ROOT, env=ENVIRONMENT, stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2
    assert done.stderr == (
        "error: standard output or a file: cannot be written to (No space left on device); free some space\n"
    )


def test_only_a_full_disk_is_said_to_need_space(tmp_path):
    limited = ["sh", "-c", 'ulimit -f 0; exec "$@" > listed.txt', "sh"]
    program = [sys.executable, "-m", "framerunner", "scenario", "list"]
    command = [*limited, *program]
    done = subprocess.run(command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == (
        "error: standard output or a file: cannot be written to (File too large); choose another place\n"
    )
