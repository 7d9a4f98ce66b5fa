"""A genuine PX4 in our world: `make test-px4 PX4_DIR=…`. Skipped without one; CI has none."""

import asyncio
import json
import os
import sys
from pathlib import Path

import pytest
from pymavlink import mavutil

from framerunner.wire.px4_modes import px4_name
from scenarios.loader import load_scenario
from sitl.autopilots.process import AutopilotStart
from sitl.autopilots.sensors import with_estimable_sensors
from sitl.px4.build import Px4Process, find_build
from sitl.px4.parameters import all_parameters
from sitl.px4.server import Px4Server
from sitl.px4.simulation import Px4Simulation
from sitl.px4.transmitter import CENTRED
from sitl.sensors.suite import load_suite
from sitl.server_settings import ServerSettings
from tests.processes import free_instance
from tests.waiting import stopped

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
    await stopped(task)


async def test_sticks_and_switches_of_a_transmitter(tmp_path):
    """Climb and fly by sticks, change the mode, lose the link, stop the motors."""
    scenario = load_scenario("empty").model_copy(update={"sensors": "mocap"})
    channels, instance, made = list(CENTRED), free_instance(), []
    signal = [True]

    def make():
        made.append(Px4Simulation(scenario, transmitter=lambda: tuple(channels) if signal[0] else None))
        return made[-1]

    airframe = Px4Simulation(scenario).world.airframe
    values = all_parameters(airframe, load_suite("mocap"), 2.0, transmitter=True)
    process = Px4Process(find_build(Path(PX4_DIR)), instance, tmp_path, values)
    settings = ServerSettings(instance=instance, speed=2.0)
    task = asyncio.create_task(Px4Server(make, settings, AutopilotStart(process, "")).run())
    link = mavutil.mavlink_connection(f"udpin:127.0.0.1:{14540 + instance}", source_system=245)
    heard = []

    async def until(condition, limit_s=60.0):
        async with asyncio.timeout(limit_s):
            while not condition():
                assert not task.done()
                while (message := link.recv_match(type="HEARTBEAT", blocking=False)) is not None:
                    if message.get_srcComponent() == 1:
                        heard.append((px4_name(message.custom_mode), message.system_status))
                await asyncio.sleep(0.01)

    def place():
        return made[-1].truth.position_arena_m

    await until(lambda: heard and heard[-1] == ("POSCTL", mavutil.mavlink.MAV_STATE_STANDBY))
    link.mav.command_long_send(instance + 1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)
    await until(lambda: made[-1].armed)
    channels[2] = 1900
    await until(lambda: place()[2] > 1.5)
    channels[2] = 1500
    channels[1] = 1700
    await until(lambda: place()[0] > 1.0)
    assert abs(place()[1]) < 0.5
    channels[1] = 1500
    centred_us = made[-1].time_us
    await until(lambda: made[-1].time_us > centred_us + 1_500_000)  # sticks that move end the mode hold
    channels[4] = 1500
    await until(lambda: heard[-1][0] == "LOITER")
    signal[0] = False
    await until(lambda: made[-1].failsafes)
    await until(lambda: made[-1].failsafes[-1][1].endswith("LAND"))
    first, last = (text for _, text in made[-1].failsafes)
    assert "Failsafe activated: entering Hold for" in first
    assert last.endswith("Failsafe activated: LAND")
    signal[0] = True
    back_us = made[-1].time_us
    await until(lambda: made[-1].time_us > back_us + 500_000)
    channels[5] = 2000
    await until(lambda: max(made[-1].world.dynamics.motor_speeds_rad_s()) < 1.0)
    await until(lambda: not made[-1].armed)
    await stopped(task)
    link.close()


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
