"""An evaluation that a signal stopped and that is continued has the same results; nothing is lost."""

import signal

import pytest

from tests.framerunner.evaluation.flights import write_scenarios
from tests.processes import is_running, program, wait_until

COUNT = 6


def arguments(out, jobs):
    return ["evaluate", "short", "--out", out, "--jobs", str(jobs)]


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with scenarios and the results of an evaluation that was not stopped."""
    folder = tmp_path_factory.mktemp("interrupts")
    write_scenarios(folder / "short", range(1, 1 + COUNT))
    with program(folder, *arguments("whole", 1)) as running:
        assert running.process.wait(240) == 0, running.err
    return folder


def lines_in(path):
    return path.read_bytes().count(b"\n") if path.exists() else 0


@pytest.mark.parametrize(
    ("jobs", "number"),
    [(1, signal.SIGINT), (2, signal.SIGKILL)],
    ids=["1-SIGINT", "2-SIGKILL"],
)
def test_a_stopped_evaluation_is_continued_where_it_was(place, jobs, number):
    out = f"{number.name}-{jobs}"
    flights = place / out / "flights.jsonl"
    with program(place, *arguments(out, jobs)) as running:
        assert wait_until(lambda: lines_in(flights) >= 2, 120), running.err
        workers = running.children()
        code = running.end(number)
        said = running.err
    kept = lines_in(flights)
    assert 2 <= kept < COUNT
    assert wait_until(lambda: not any(is_running(worker) for worker in workers), 20)
    if number is not signal.SIGKILL:
        assert code == 130
        assert f"interrupted; {kept} of {COUNT} flights are kept in {out}; continue with:" in said
        command = f"framerunner evaluate short --mission explorer --jobs {jobs} --out {out}"
        assert said.splitlines()[-1].strip() == command
        assert "Traceback" not in said
    with program(place, *arguments(out, 1)) as running:
        assert running.process.wait(240) == 0, running.err
        assert f"{kept} of {COUNT} flights are in {out} already" in running.err
    assert (place / out / "results.csv").read_bytes() == (place / "whole" / "results.csv").read_bytes()
