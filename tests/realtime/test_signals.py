"""What is left when a flight is stopped from outside: nothing running, everything recorded kept."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from pymavlink import mavutil

from tests.processes import ROOT, free_instance, is_running, ports_are_free, program, wait_until

pytestmark = pytest.mark.realtime


@pytest.fixture
def flight(tmp_path):
    """A flight of test case 1 in the air, its instance and its child processes, first the simulator."""
    instance = free_instance()
    with program(tmp_path, "fly", "test-case-1", "--instance", str(instance), "--speed", "4") as running:
        running.wait_for("red.", 60.0)
        yield running, instance, running.children()


def run_folder(tmp_path):
    (folder,) = (tmp_path / "runs").iterdir()
    return folder


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
def test_a_stopped_flight_keeps_everything_and_leaves_nothing_running(tmp_path, flight, number):
    running, instance, children = flight
    time.sleep(1.0)
    assert running.end(number) == 130
    assert wait_until(lambda: not any(map(is_running, children)), 5.0)
    assert ports_are_free(instance)
    assert "Traceback" not in running.err

    folder = run_folder(tmp_path)
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert result["verdict"] == "aborted"
    assert "interrupted" in result["reason"]
    assert result["try_time_s"] > 1.0
    assert cv2.imread(str(folder / "track.png")).shape[0] > 300
    assert cv2.VideoCapture(str(folder / "video.avi")).read()[0]
    log = mavutil.mavlink_connection(str(folder / "flight.tlog"))
    assert log.recv_match(type="ATTITUDE") is not None
    assert "aborted" in running.out


def test_a_killed_flight_takes_its_simulator_with_it(tmp_path, flight):
    running, instance, children = flight
    assert running.end(signal.SIGKILL) == -signal.SIGKILL
    assert wait_until(lambda: not any(map(is_running, children)), 10.0)
    assert ports_are_free(instance)
    assert (run_folder(tmp_path) / "flight.tlog").stat().st_size > 10_000


def test_a_simulator_that_dies_ends_the_flight_with_its_reason(tmp_path, flight):
    running, _, (sim, *_) = flight
    os.kill(sim, signal.SIGKILL)
    assert running.process.wait(30.0) in (1, 2)
    assert "Traceback" not in running.err
    assert "the simulator was ended by signal 9" in running.err
    folder = run_folder(tmp_path)
    assert (folder / "flight.tlog").stat().st_size > 10_000
    assert cv2.VideoCapture(str(folder / "video.avi")).read()[0]


def test_a_drone_that_is_not_there_is_said_in_one_line(tmp_path):
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    cv2.imwrite(str(pictures / "1.png"), np.zeros((240, 320, 3), np.uint8))
    port = 14540 + free_instance()
    arguments = ("--drone", f"udpin://127.0.0.1:{port}", "--camera", str(pictures), "--simulated")
    with program(tmp_path, "fly", "test-case-1", *arguments) as running:
        assert wait_until(lambda: f":{port:04X} " in Path("/proc/net/udp").read_text(), 30.0)  # it listens
        assert running.process.wait(20.0) == 2  # its own limit is 10 s
    (line,) = running.err.splitlines()
    assert line.startswith("error: ")
    assert str(port) in line


def test_a_simulator_stopped_before_the_start_is_interrupted(tmp_path):
    instance = free_instance()
    with program(tmp_path, "fly", "test-case-1", "--instance", str(instance)) as running:
        assert wait_until(running.children, 20.0)
        assert running.end() == 130
    assert wait_until(lambda: ports_are_free(instance), 5.0)
    assert "Traceback" not in running.err
    assert "interrupted" in running.err


@pytest.mark.parametrize(("command", "ready"), [("sim", "Ready for takeoff!"), ("fly", "red.")])
def test_a_program_started_in_the_background_of_a_script_can_be_ended(tmp_path, command, ready):
    """There SIGINT is ignored from the start (POSIX shells do so), SIGTERM must still do."""
    instance = free_instance()
    script = f'"{sys.executable}" -m framerunner {command} --instance {instance} 2>said & echo $!; wait'
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    said = tmp_path / "said"
    said.touch()  # the script opens it in the background, perhaps after its first line
    with subprocess.Popen(
        ["sh", "-c", script], stdout=subprocess.PIPE, cwd=tmp_path, env=environment
    ) as shell:
        pid = int(shell.stdout.readline())
        assert wait_until(lambda: ready in said.read_text(encoding="utf-8"), 20.0), said.read_text()
        os.kill(pid, signal.SIGTERM)
        assert wait_until(lambda: not is_running(pid), 10.0)
    assert ports_are_free(instance)
