"""The simulator with a fake ArduPilot at its JSON interface, over UDP."""

import asyncio
from contextlib import asynccontextmanager

from scenarios.loader import load_scenario
from sitl.ardupilot.json_interface import FIRST_PORT, PORTS_AN_INSTANCE
from sitl.ardupilot.server import ArduPilotServer
from sitl.ardupilot.simulation import ArduPilotSimulation
from sitl.autopilots.process import AutopilotStart
from sitl.server_settings import ServerSettings
from tests.processes import free_instance
from tests.sitl.ardupilot.fake_ardupilot import FakeArduPilot

STILL, CLIMB = [1000] * 4, [1400] * 4


@asynccontextmanager
async def serving(channels=16):
    """A running simulator, the lines that it says, and a fake ArduPilot."""
    instance, lines, made = free_instance(), [], []

    def make():
        made.append(ArduPilotSimulation(load_scenario("test-case-1")))
        return made[-1]

    settings = ServerSettings(instance=instance)
    server = ArduPilotServer(make, settings, AutopilotStart(None, "arducopter"), notice=lines.append)
    task = asyncio.create_task(server.run())
    async with asyncio.timeout(20):
        while not any("waiting for ArduPilot" in line for line in lines):
            assert not task.done(), task.exception()
            await asyncio.sleep(0.01)
    fake = FakeArduPilot(FIRST_PORT + PORTS_AN_INSTANCE * instance, channels)
    try:
        yield fake, lines, made
    finally:
        fake.close()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def test_it_flies_by_the_fakes_pulses_in_lockstep():
    async with serving(channels=32) as (fake, lines, made):
        for _ in range(100):
            await asyncio.to_thread(fake.step, STILL)
        for _ in range(900):
            await asyncio.to_thread(fake.step, CLIMB)
        times = [answer["timestamp"] for answer in fake.answers]
        assert times == [round(0.002 * number, 6) for number in range(1, 1001)]  # none lost, none doubled
        assert -fake.answers[-1]["position"][2] > 1.0
        assert made[-1].referee.snapshot().motors_on
        assert "ArduPilot is connected" in lines


async def test_repetitions_that_wait_together_get_one_answer():
    async with serving() as (fake, _lines, made):
        await asyncio.to_thread(fake.step, STILL)
        for _ in range(3):
            fake.send(STILL)  # as after a second without an answer
        answer = await asyncio.to_thread(fake.receive)
        assert answer["timestamp"] == 0.004
        assert (await asyncio.to_thread(fake.step, STILL))["timestamp"] == 0.006
        assert made[-1].time_us == 4000


async def test_an_ardupilot_that_starts_again_gets_a_new_drone():
    async with serving() as (fake, lines, made):
        for _ in range(20):
            await asyncio.to_thread(fake.step, STILL)
        fake.number = 0
        answer = await asyncio.to_thread(fake.step, STILL)
        assert answer["timestamp"] == 0.002
        assert len(made) == 2
        assert any("a new drone is on the start" in line for line in lines)


async def test_other_packets_are_ignored():
    async with serving() as (fake, _lines, _made):
        fake.socket.sendto(b"no frame", fake.place)
        assert (await asyncio.to_thread(fake.step, STILL))["timestamp"] == 0.002
