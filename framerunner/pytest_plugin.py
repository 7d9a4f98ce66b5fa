"""Fixtures of pytest for projects that fly a drone: a fresh simulated one each test, and lockstep flights.

Both are available wherever framerunner is installed. What the simulator printed, and how each flight ended,
is attached to the report of a test that fails.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from typing import Any

import pytest

import framerunner

MARK = "framerunner"
_TOLD = pytest.StashKey[list[tuple[str, Callable[[], str]]]]()


def pytest_configure(config: pytest.Config) -> None:
    """Declare the mark."""
    config.addinivalue_line(
        "markers",
        f"{MARK}(scenario='open-field', **options): arguments of framerunner.Simulator for the fixture "
        "framerunner_sim",
    )


@pytest.fixture
def framerunner_sim(request: pytest.FixtureRequest) -> Iterator[framerunner.Simulator]:
    """A running `framerunner.Simulator`, ready for take-off, for this test only.

    `@pytest.mark.framerunner("calm-17", speed=2)` has its arguments.
    """
    mark = request.node.get_closest_marker(MARK)
    args, options = ((), {}) if mark is None else (mark.args, mark.kwargs)
    simulator = framerunner.Simulator(*args, **options)
    _told(request.node).append(("framerunner sim", lambda: simulator.log))
    with simulator:
        simulator.wait_until_ready()
        yield simulator


@pytest.fixture
def framerunner_flight(request: pytest.FixtureRequest) -> Callable[..., framerunner.FlightResult]:
    """`framerunner.fly`, whose result is shown if this test fails."""

    def fly(*args: Any, **options: Any) -> framerunner.FlightResult:  # noqa: ANN401 - those of `framerunner.fly`
        result = framerunner.fly(*args, **options)
        text = result.model_dump_json(indent=1)
        _told(request.node).append((f"framerunner flight {result.scenario}", lambda: text))
        return result

    return fly


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Attach the logs to the report of a test that fails."""
    report = yield
    if report.failed:
        report.sections += [(title, text()) for title, text in _told(item)]
    return report


def _told(item: pytest.Item) -> list[tuple[str, Callable[[], str]]]:
    """What is attached if the test fails: titles, and how to get their texts."""
    return item.stash.setdefault(_TOLD, [])
