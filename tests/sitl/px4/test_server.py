"""The simulator with a fake PX4 at its simulator interface."""

import asyncio
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from dataclasses import replace
from math import nan
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common as mavlink

from framerunner.errors import SettingError
from framerunner.wire.transports.urls import LinkError
from scenarios.loader import load_scenario
from sitl.autopilots.process import AutopilotEndedError, AutopilotStart
from sitl.autopilots.sensors import with_estimable_sensors
from sitl.pacing.time_grants import Grant, TimeGrants
from sitl.px4.build import Px4Process, find_build
from sitl.px4.link import FIRST_PORT, Px4GoneError, Px4Link
from sitl.px4.server import Px4Server
from sitl.px4.simulation import MotionError, Px4Simulation
from sitl.px4.simulator_messages import ActuatorControls
from sitl.server_settings import ServerSettings
from tests.processes import free_instance
from tests.sitl.px4.fake_px4 import FakePx4, connect
from tests.waiting import stopped, until

FAKE = Path(__file__).with_name("fake_px4.py")


def new_simulation():
    return Px4Simulation(with_estimable_sensors(load_scenario("test-case-1")))


def serving(lines, speed=20.0):
    instance = free_instance()
    made = []

    def make():
        made.append(new_simulation())
        return made[-1]

    settings = ServerSettings(instance=instance, speed=speed)
    server = Px4Server(make, settings, AutopilotStart(None, "px4"), notice=lines.append)
    return server, FIRST_PORT + instance, made


def run_fake(port, fakes, **options):
    def run():
        fakes.append(FakePx4(port, **options))
        fakes[-1].serve()

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    return thread


async def test_every_sensor_is_answered_once_and_the_answers_fly_the_drone():
    lines, fakes = [], []
    server, port, made = serving(lines)
    task = asyncio.create_task(server.run())
    run_fake(port, fakes, armed_from_us=2_000_000, output=0.35)
    await until(lambda: made[-1].truth.position_arena_m[2] > 1.5)
    fake, simulation = fakes[-1], made[-1]
    assert simulation.referee.snapshot().motors_on
    times_us = list(fake.times_us)
    assert times_us == list(range(times_us[0], times_us[-1] + 1, 4000))  # none lost, none doubled
    assert server.link.in_lockstep
    assert server.link.unexpected == 0
    assert {"ODOMETRY", "HIL_STATE_QUATERNION"} <= set(fake.others)
    assert any("waiting for PX4 on TCP" in line for line in lines)
    await stopped(task)


async def test_others_that_connect_first_do_not_take_the_place_of_px4():
    lines, fakes = [], []
    server, port, made = serving(lines)
    task = asyncio.create_task(server.run())
    await until(lambda: server.link is not None)
    silent, ground_station = connect(port), connect(port)
    mav = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    ground_station.sendall(mav.heartbeat_encode(6, 8, 0, 0, 4).pack(mav))
    await asyncio.sleep(0.05)
    run_fake(port, fakes)
    await until(lambda: server.link.in_lockstep)
    late = connect(port)
    await until(lambda: len(fakes[-1].times_us) > 500)
    fakes[-1].connection.shutdown(2)
    await until(lambda: len(made) == 2)
    await asyncio.sleep(0.1)
    assert [line for line in lines if line.startswith("PX4 is connected")] == ["PX4 is connected"]
    run_fake(port, fakes)
    await until(lambda: made[-1].time_us > 100_000)
    await stopped(task)
    for other in (silent, ground_station, late):
        other.close()


async def test_a_connection_that_is_not_of_px4_is_told_once(monkeypatch):
    monkeypatch.setattr("sitl.px4.link._STRANGE_S", 0.0)
    place, lines = ("127.0.0.1", FIRST_PORT + free_instance()), []
    link = Px4Link(place, lines.append)
    with connect(place[1]) as other:
        host, port = other.getsockname()
        await until(lambda: not link.try_connect() and lines)
        link.try_connect()
    assert len(lines) == 1
    said = f"warning: {host}:{port} is connected to PX4's port and has sent no heartbeat of a PX4"
    assert lines[0].startswith(said)
    link.close()


async def test_a_px4_that_is_killed_ends_the_try_and_a_new_one_gets_a_new_drone():
    lines, fakes = [], []
    server, port, made = serving(lines)
    task = asyncio.create_task(server.run())
    run_fake(port, fakes, armed_from_us=1_000_000, output=0.35)
    await until(lambda: made[-1].truth.position_arena_m[2] > 1.5)
    flown = made[-1]
    fakes[-1].connection.shutdown(2)
    await until(lambda: not flown.truth.motors_on)
    began_s = time.monotonic()
    run_fake(port, fakes)
    await until(lambda: len(made) == 2 and made[-1].time_us > 1_000_000)
    assert time.monotonic() - began_s < 5.0
    assert any("PX4 has closed the connection; at" in line for line in lines)
    await stopped(task)


async def test_a_px4_that_is_gone_for_good_is_waited_for():
    lines, fakes = [], []
    server, port, made = serving(lines)
    task = asyncio.create_task(server.run())
    run_fake(port, fakes)
    await until(lambda: made[-1].time_us > 1_000_000)
    fakes[-1].connection.shutdown(2)
    await until(lambda: len(made) == 2)
    await asyncio.sleep(0.5)
    assert [line for line in lines if line.startswith("PX4 is connected")] == ["PX4 is connected"]
    assert "waiting for PX4 on TCP" in lines[-1]
    await stopped(task)


async def test_a_px4_that_stands_still_changes_nothing():
    lines = []
    server, port, made = serving(lines)
    task = asyncio.create_task(server.run())
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, str(FAKE), str(port)]
    with subprocess.Popen(command, env=environment) as fake:  # noqa: ASYNC220 - it starts at once
        try:
            await until(lambda: made[-1].time_us > 1_000_000)
            fake.send_signal(signal.SIGSTOP)
            await asyncio.sleep(0.1)
            standing_us = made[-1].time_us
            await asyncio.sleep(2.5)
            assert made[-1].time_us == standing_us
            fake.send_signal(signal.SIGCONT)
            await until(lambda: made[-1].time_us > standing_us + 200_000)
            assert server.link.unexpected == 0
            assert any("PX4 has not answered for 2 s" in line for line in lines)
            assert any("PX4 answers again" in line for line in lines)
        finally:
            fake.kill()
    await stopped(task)


def test_an_output_that_is_no_number_stops_its_motor():
    simulation = new_simulation()
    for _ in range(50):
        controls = ActuatorControls(simulation.time_us, (nan, *(0.3,) * 15), armed=True)
        simulation.sense()
        simulation.move(controls)
    speeds_rad_s = simulation.world.dynamics.motor_speeds_rad_s()
    assert speeds_rad_s[0] == 0.0
    assert min(speeds_rad_s[1:]) > 0.0


def test_a_motion_that_is_no_number_ends_in_words():
    simulation = new_simulation()
    simulation.sense()
    simulation.truth = replace(simulation.truth, position_arena_m=(nan, 0.0, 1.0))
    with pytest.raises(MotionError, match="turned too fast to be simulated"):
        simulation.move(None)


async def test_an_answer_to_another_sensor_is_counted():
    place = ("127.0.0.1", FIRST_PORT + free_instance())
    link = Px4Link(place, print)
    waiting = asyncio.create_task(link.connected())
    fake = await asyncio.to_thread(FakePx4, place[1])
    await waiting
    link.in_lockstep = True
    for time_us in (4000, 4000, 8000):
        fake.send(fake.mav.hil_actuator_controls_encode(time_us, [0.0] * 16, 1, 1))
    answer = await link.late_answer(8000)
    assert (answer.time_us, link.unexpected) == (8000, 2)
    fake.close()
    with pytest.raises(Px4GoneError):
        await link.late_answer(12_000)
    link.close()


def build_of(tmp_path, script):
    (tmp_path / "bin").mkdir()
    (tmp_path / "etc").mkdir()
    program = tmp_path / "bin" / "px4"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    return find_build(tmp_path)


async def test_a_px4_that_ends_at_once_is_reported_with_its_error(tmp_path):
    build = build_of(tmp_path, "env | grep PX4_; echo 'ERROR [init] no airframe'; exit 3")
    process = Px4Process(build, 2, tmp_path / "files", {"MPC_THR_HOVER": 0.5})
    await process.start()
    assert await process.ended() == "PX4 ended with code 3: ERROR [init] no airframe"
    assert "PX4_PARAM_MPC_THR_HOVER=0.5" in process.log.read_text()
    assert "PX4_SIM_MODEL=none_iris" in process.log.read_text()


async def test_a_px4_that_ends_while_simulated_time_waits_ends_the_server_in_words(tmp_path):
    instance = free_instance()
    build = build_of(tmp_path, f"exec {sys.executable} {FAKE} {FIRST_PORT + instance}")
    process = Px4Process(build, instance, tmp_path / "files", {})
    here, there = socket.socketpair()
    settings = ServerSettings(instance=instance, speed=20.0)
    start = AutopilotStart(process, "px4")
    running = asyncio.create_task(Px4Server(new_simulation, settings, start, grants=TimeGrants(there)).run())
    reader, writer = await asyncio.open_connection(sock=here)
    assert await reader.readline() == b"up\n"
    writer.write(Grant(0).line())
    await reader.readline()
    os.kill(process.process_id, signal.SIGKILL)
    with pytest.raises(
        AutopilotEndedError, match=r"^at \d+\.\d s of simulated time PX4 was ended by signal 9$"
    ):
        await asyncio.wait_for(running, 5.0)
    writer.close()


async def test_what_to_do_where_another_px4_has_the_instance_is_said(tmp_path):
    taken = "INFO  [px4] PX4 server already running for instance 0"
    process = Px4Process(build_of(tmp_path, f"echo '{taken}'; exit 255"), 0, tmp_path / "files", {})
    await process.start()
    assert await process.ended() == f"PX4 ended with code 255: {taken}; choose another --instance"


async def test_a_second_simulator_of_the_same_instance_says_what_to_do():
    place = ("127.0.0.1", FIRST_PORT + free_instance())
    first = Px4Link(place, lambda line: None)
    try:
        with pytest.raises(LinkError, match=r"cannot be listened on .*; choose another --instance"):
            Px4Link(place, lambda line: None)
    finally:
        first.close()


async def test_a_px4_that_is_restarted_goes_on_with_its_log(tmp_path):
    script = "if [ -f was ]; then exit 4; fi; touch was; echo 'ERROR [init] the first start'"
    process = Px4Process(build_of(tmp_path, script), 2, tmp_path / "files", {})
    await process.start()
    assert (await process.ended()).endswith("ERROR [init] the first start")
    await process.start()
    assert await process.ended() == "PX4 ended with code 4"  # not the words of the start before
    assert "the first start" in process.log.read_text()


def test_a_folder_is_given_to_px4_by_its_absolute_path(tmp_path):
    command = Px4Process(tmp_path, 0, Path("drone-files/px4-0"), {}).command()
    assert Path("drone-files/px4-0").absolute() == Path(command[command.index("-w") + 1])


async def test_a_folder_that_cannot_be_made_is_one_line(tmp_path):
    (tmp_path / "file").touch()
    process = Px4Process(build_of(tmp_path, "true"), 0, tmp_path / "file" / "px4-0", {})
    with pytest.raises(SettingError, match="name another folder by --storage"):
        await process.start()


def is_gone(child):
    """Whether a process has ended; one that nobody has waited for is a zombie."""
    try:
        return Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


async def test_a_px4_is_ended_with_its_script(tmp_path):
    process = Px4Process(build_of(tmp_path, "sleep 100 & echo $!; wait"), 2, tmp_path / "files", {})
    await process.start()
    await until(lambda: process.log.read_text().strip())
    child = int(process.log.read_text())
    await process.stop()
    await until(lambda: is_gone(child))
