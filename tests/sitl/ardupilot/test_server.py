"""The simulator with a fake ArduPilot at its JSON interface, over UDP."""

import asyncio
import os
import signal
import socket
import sys
from contextlib import asynccontextmanager, closing
from pathlib import Path

import pytest

from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader
from scenarios.loader import load_scenario
from sitl.ardupilot.build import ArduPilotProcess, find_build
from sitl.ardupilot.json_interface import FIRST_PORT, PORTS_AN_INSTANCE
from sitl.ardupilot.sensor_link import SENSOR_PORT
from sitl.ardupilot.server import ArduPilotServer
from sitl.ardupilot.simulation import ArduPilotSimulation
from sitl.autopilots.process import AutopilotEndedError, AutopilotStart
from sitl.pacing.time_grants import Grant, TimeGrants, parse_answer
from sitl.server_settings import ServerSettings
from tests.processes import free_instance
from tests.sitl.ardupilot.fake_ardupilot import FakeArduPilot
from tests.waiting import stopped, until

STILL, CLIMB = [1000] * 4, [1400] * 4
FAKE = Path(__file__).with_name("fake_ardupilot.py")


def server_with(lines, made, *, process=None, sensors="ideal", grants=None, instance=None):
    """A simulator, and its instance."""
    instance = free_instance() if instance is None else instance
    scenario = load_scenario("test-case-1").model_copy(update={"sensors": sensors})

    def make():
        made.append(ArduPilotSimulation(scenario))
        return made[-1]

    settings = ServerSettings(instance=instance)
    start = AutopilotStart(process, "arducopter")
    return ArduPilotServer(make, settings, start, notice=lines.append, grants=grants), instance


@asynccontextmanager
async def serving(channels=16, **options):
    """A running simulator, the lines that it says, and a fake ArduPilot."""
    lines, made = [], []
    server, instance = server_with(lines, made, **options)
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
        await stopped(task)


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


async def test_an_ardupilot_that_starts_again_at_another_port_gets_a_new_drone_at_once():
    async with serving() as (fake, _lines, made):
        for _ in range(20):
            await asyncio.to_thread(fake.step, STILL)
        fake.close()
        with closing(FakeArduPilot(fake.place[1])) as another:
            another.number = 30  # its first frames were lost
            assert (await asyncio.to_thread(another.step, STILL))["timestamp"] == 0.002
        assert len(made) == 2


async def test_a_strangers_frames_change_nothing_and_are_reported_once():
    async with serving() as (fake, lines, made):
        await asyncio.to_thread(fake.step, STILL)
        with closing(FakeArduPilot(fake.place[1])) as stranger:
            for _ in range(20):
                for number in (0, fake.number, 5000):
                    stranger.send(CLIMB, number)
                await asyncio.to_thread(fake.step, STILL)
            stranger.socket.settimeout(0.05)
            with pytest.raises(TimeoutError):
                stranger.receive()
        assert [answer["timestamp"] for answer in fake.answers] == [
            round(0.002 * number, 6) for number in range(1, 22)
        ]
        assert len(made) == 1
        assert sum("is ignored: ArduPilot at" in line for line in lines) == 1


async def test_other_packets_are_ignored():
    async with serving() as (fake, _lines, _made):
        fake.socket.sendto(b"no frame", fake.place)
        assert (await asyncio.to_thread(fake.step, STILL))["timestamp"] == 0.002


async def test_poses_of_motion_capture_and_the_origin_are_sent_by_mavlink():
    async with serving(sensors="mocap") as (fake, _lines, _made):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as serial:
            serial.settimeout(5.0)
            port = SENSOR_PORT + fake.place[1] - FIRST_PORT
            beat = mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 3, 3)
            system_id = 1 + (fake.place[1] - FIRST_PORT) // PORTS_AN_INSTANCE
            link = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=1)
            serial.sendto(beat.pack(link), ("127.0.0.1", port))
            for _ in range(60):
                await asyncio.to_thread(fake.step, STILL)
            reader = PacketReader()
            found = [message for _ in range(3) for message in reader.feed(serial.recv(2048))]
    assert [each.get_type() for each in found][:2] == ["SET_GPS_GLOBAL_ORIGIN", "VISION_POSITION_ESTIMATE"]
    assert found[0].latitude == pytest.approx(473977420)
    pose = found[1]
    start = fake.answers[0]["position"]
    assert (pose.x, pose.y, pose.z) == pytest.approx(start, abs=0.03)
    assert pose.covariance[0] == pytest.approx(1e-6)


async def test_frames_wait_until_time_is_granted():
    here, there = socket.socketpair()
    lines, made = [], []
    server, instance = server_with(lines, made, grants=TimeGrants(there))
    task = asyncio.create_task(server.run())
    await until(lambda: any("waiting for ArduPilot" in line for line in lines))
    fake = FakeArduPilot(FIRST_PORT + PORTS_AN_INSTANCE * instance)
    reader, writer = await asyncio.open_connection(sock=here)
    await asyncio.to_thread(fake.step, STILL)
    assert await reader.readline() == b"up\n"
    writer.write(Grant(20_000).line())
    while fake.number < 12:  # up to the control tick at 20 ms, and its period
        await asyncio.to_thread(fake.step, STILL)
    for _ in range(3):
        fake.send(STILL)  # as after a second without an answer
    held = parse_answer(await reader.readline())
    assert (held.time_us, made[-1].time_us) == (20_000, 24_000)
    writer.write(Grant(40_000).line())
    assert (await asyncio.to_thread(fake.receive))["timestamp"] == 0.026
    assert (await asyncio.to_thread(fake.step, STILL))["timestamp"] == 0.028
    fake.number = 0
    fake.send(STILL)
    with pytest.raises(AutopilotEndedError, match="has started again"):
        await task
    fake.close()
    writer.close()


def fake_process(tmp_path, instance):
    """A fake ArduPilot that is started as a genuine one."""
    program = tmp_path / "arducopter"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} {FAKE} "$@"\n')
    program.chmod(0o755)
    settings, home = ServerSettings(instance=instance), GeodeticPoint(47.0, 8.0, 400.0)
    options = (find_build(tmp_path), settings, home, {}, tmp_path / "files")
    return ArduPilotProcess(*options, takes_sensors=False)


def child_of(process):
    return process._process.pid


async def test_an_ardupilot_that_is_killed_ends_the_try_and_the_next_one_gets_a_new_drone(tmp_path):
    lines, made, instance = [], [], free_instance()
    process = fake_process(tmp_path, instance)
    server, _ = server_with(lines, made, process=process, instance=instance)
    task = asyncio.create_task(server.run())
    await until(lambda: made[-1].truth.position_arena_m[2] > 1.0)
    flown = made[-1]
    os.kill(child_of(process), signal.SIGKILL)
    await until(lambda: len(made) == 2 and made[-1].time_us > 500_000)
    assert not flown.truth.motors_on
    assert any(line.startswith("ArduPilot was ended by signal 9; at") for line in lines)
    await stopped(task)


async def test_an_ardupilot_that_stands_still_changes_nothing(tmp_path):
    lines, made, instance = [], [], free_instance()
    process = fake_process(tmp_path, instance)
    server, _ = server_with(lines, made, process=process, instance=instance)
    task = asyncio.create_task(server.run())
    await until(lambda: made[-1].time_us > 100_000)
    os.kill(child_of(process), signal.SIGSTOP)
    await asyncio.sleep(0.1)
    standing = server.exchange.steps
    await until(lambda: any("ArduPilot has sent no outputs for 2 s" in line for line in lines))
    assert server.exchange.steps == standing
    os.kill(child_of(process), signal.SIGCONT)
    await until(lambda: any("no step was skipped" in line for line in lines))
    assert len(made) == 1
    assert 2000 * server.exchange.steps - made[-1].time_us in (0, 2000)
    await stopped(task)
