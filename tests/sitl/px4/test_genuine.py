"""A genuine PX4 in our world: `make test-px4 PX4_DIR=…`. Skipped without one; CI has none."""

import asyncio
import json
import os
import sys
from pathlib import Path

import pytest

from scenarios.loader import load_scenario
from sitl.autopilots.process import AutopilotStart
from sitl.autopilots.sensors import with_estimable_sensors
from sitl.px4.build import Px4Process, find_build
from sitl.px4.parameters import all_parameters
from sitl.px4.server import Px4Server
from sitl.px4.simulation import Px4Simulation
from sitl.sensors.suite import load_suite
from sitl.server_settings import ServerSettings
from tests.processes import free_instance

PX4_DIR = os.environ.get("FRAMERUNNER_PX4_DIR", "")
pytestmark = pytest.mark.skipif(not PX4_DIR, reason="no genuine PX4: make test-px4 PX4_DIR=PX4-Autopilot")


async def test_lockstep_loses_and_doubles_no_step(tmp_path):
    scenario, instance, lines = with_estimable_sensors(load_scenario("test-case-1")), free_instance(), []
    values = all_parameters(Px4Simulation(scenario).world.airframe, load_suite(scenario.sensors), 10.0)
    process = Px4Process(find_build(Path(PX4_DIR)), instance, tmp_path, values)
    settings = ServerSettings(instance=instance, speed=10.0)
    server = Px4Server(lambda: Px4Simulation(scenario), settings, AutopilotStart(process, ""), lines.append)
    task = asyncio.create_task(server.run())
    async with asyncio.timeout(120):
        while server.link is None or server.link.steps < 25_000:
            await asyncio.sleep(0.1)
            assert not task.done(), lines
    assert server.link.unexpected == 0
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


async def test_the_whole_challenge(tmp_path):
    options = ["--px4", PX4_DIR, "--instance", str(free_instance()), "--speed", "2", "--out", str(tmp_path)]
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "framerunner", "fly", "test-case-1", *options),
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert await asyncio.wait_for(process.wait(), 300) == 0
    (result,) = tmp_path.glob("*/result.json")
    found = json.loads(result.read_text())
    assert found["frames_crossed"] == ["red", "green", "blue"]
    assert found["landed_on_base"]
    assert list(tmp_path.glob("*/px4-*/log/*/*.ulg"))  # PX4's own log is beside the result
