"""Whether a genuine autopilot flies the same flight again, and what `fly` says of it."""

import os
import sys
from pathlib import Path

import pytest

from framerunner import instances
from framerunner.cli import run
from framerunner.flying import run as flying
from framerunner.flying import simulator_process
from framerunner.flying.simulator_process import GenuineAutopilot
from sitl.autopilots.process import may_use_real_time


@pytest.fixture
def px4(tmp_path):
    """A folder that looks like a build of PX4."""
    (tmp_path / "bin").mkdir()
    (tmp_path / "etc").mkdir()
    program = tmp_path / "bin" / "px4"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    return tmp_path


@pytest.mark.parametrize("allowed", [True, False])
def test_that_px4_may_not_use_real_time_priorities_is_said_once(px4, allowed, capsys, monkeypatch):
    async def fly_once(settings):
        return 0

    monkeypatch.setattr(flying, "fly_once", fly_once)
    monkeypatch.setattr(simulator_process, "may_use_real_time", lambda: allowed)
    assert run(["fly", "--px4", str(px4)]) == 0
    assert capsys.readouterr().err.count("may not use real-time priorities") == (not allowed)


@pytest.mark.parametrize(("options", "number"), [((), 2), (("--instance", "1"), 1)])
def test_a_flight_of_px4_takes_the_first_free_instance(px4, options, number, monkeypatch, tmp_path):
    taken = []

    async def fly_once(settings):
        taken.append(settings.real_time.instance)
        return 0

    monkeypatch.setattr(flying, "fly_once", fly_once)
    monkeypatch.setattr(instances, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr(instances, "_is_free", lambda instance: instance >= 2)
    assert run(["fly", "--px4", str(px4), *options]) == 0
    assert taken == [number]


@pytest.mark.parametrize("allowed", [True, False])
def test_px4_alone_needs_real_time_priorities_to_repeat_its_flights(allowed, monkeypatch):
    monkeypatch.setattr(simulator_process, "may_use_real_time", lambda: allowed)
    assert GenuineAutopilot("px4", Path()).repeats == allowed
    assert GenuineAutopilot("ardupilot", Path()).repeats


@pytest.mark.skipif(sys.platform != "linux", reason="sets limits of Linux")
@pytest.mark.parametrize("error", [None, PermissionError])
def test_whether_real_time_priorities_are_allowed_is_tried_and_undone(error, monkeypatch):
    tried = []

    def set_scheduler(process_id, policy, parameters):
        tried.append(policy)
        if error is not None:
            raise error

    monkeypatch.setattr(os, "sched_setscheduler", set_scheduler)
    assert may_use_real_time() == (error is None)
    assert tried == ([os.SCHED_FIFO, os.sched_getscheduler(0)] if error is None else [os.SCHED_FIFO])
