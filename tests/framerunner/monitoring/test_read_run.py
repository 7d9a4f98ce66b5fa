"""The process that reads a run: limited in memory and time, and ended with its parent."""

import json
import subprocess
import sys
import threading
import time
from dataclasses import replace
from math import inf
from pathlib import Path

import pytest

from framerunner.monitor.ports import RunError
from framerunner.monitoring import run_library
from framerunner.monitoring.read_run import RECORDING, read_run
from framerunner.monitoring.run_library import RunFolders
from framerunner.recording.mcap_writer import FlightRecording
from framerunner.runs.track import Track
from framerunner.wire.mission_report import TransitionTaken
from offboard.app import Moment
from offboard.drone import DroneState, PlaceEstimate, VelocityFluCommand
from offboard.mission import load_mission
from offboard.navigation.view import GateEstimate, NavigationView
from scenarios.loader import load_scenario
from scenarios.result import FlightResult
from vision.types import Detections

GREEDY = """
from framerunner.child_process import limit_resources
limit_resources({memory}, 100)
try:
    held = bytearray(200_000_000)
except MemoryError:
    print("refused")
"""
PARENT = """
import sys
from pathlib import Path
from framerunner.monitoring import run_library
run_library.sys = type("S", (), {{"executable": {script!r}}})
run_library._unpack(Path({folder!r}), (), run_library.Readers())
"""


def is_alive(pid):
    """Whether a process exists and is no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def until(condition, limit_s=30.0):
    end_s = time.monotonic() + limit_s
    while not (found := condition()):
        assert time.monotonic() < end_s, "did not happen"
        time.sleep(0.02)
    return found


def slow_reader(tmp_path):
    """A program that starts as the reader does, writes its process id to a file, and then never ends."""
    pid_file = tmp_path / "pid"
    code = (
        "import os, time\n"
        "from framerunner.child_process import end_with_standard_input\n"
        "end_with_standard_input(lambda: None)\n"
        f"open({str(pid_file)!r}, 'w').write(str(os.getpid()) + '\\n')\n"
        "while True: sum(range(10**6))\n"
    )
    script = tmp_path / "python"
    script.write_text(f"#!{sys.executable}\n{code}", encoding="utf-8")
    script.chmod(0o755)
    return script, pid_file


def pid_in(pid_file):
    text = pid_file.read_text() if pid_file.exists() else ""
    return int(text) if text.endswith("\n") else None


def test_memory_is_limited():
    for memory, words in ((100_000_000, "refused\n"), (1_000_000_000, "")):
        done = subprocess.run(
            [sys.executable, "-c", GREEDY.format(memory=memory)], capture_output=True, text=True, check=True
        )
        assert done.stdout == words


def test_the_reader_ends_when_its_parent_is_killed(tmp_path):
    script, pid_file = slow_reader(tmp_path)
    code = PARENT.format(script=str(script), folder=str(tmp_path / "run"))
    parent = subprocess.Popen([sys.executable, "-c", code])
    try:
        pid = until(lambda: pid_in(pid_file))
        assert is_alive(pid)
    finally:
        parent.kill()
        parent.wait()
    until(lambda: not is_alive(pid))


def test_closing_the_library_ends_the_reading(tmp_path, monkeypatch):
    script, pid_file = slow_reader(tmp_path)
    monkeypatch.setattr(run_library.sys, "executable", str(script))
    folder = tmp_path / "runs" / "slow"
    folder.mkdir(parents=True)
    (folder / "flight.tlog").write_bytes(b"\0")
    library = RunFolders(tmp_path / "runs")
    messages = []

    def read():
        with pytest.raises(RunError) as refused:
            library.recording("slow")
        messages.append(str(refused.value))

    reading = threading.Thread(target=read)
    reading.start()
    pid = until(lambda: pid_in(pid_file))
    library.close()
    reading.join(20)
    assert messages == ["run 'slow': reading it takes too long"]
    assert not is_alive(pid)
    with pytest.raises(RunError, match="takes too long"):
        library.recording("slow")  # not read again at once


def test_what_could_not_be_read_is_not_read_again_until_it_changes(tmp_path, monkeypatch):
    folder = tmp_path / "bad"
    folder.mkdir()
    (folder / "flight.mcap").write_bytes(b"no recording")
    library = RunFolders(tmp_path)
    with pytest.raises(RunError, match="not an MCAP file"):
        library.recording("bad")
    started = []
    monkeypatch.setattr(library._readers, "run", lambda command: started.append(command) or (1, ""))
    with pytest.raises(RunError, match="not an MCAP file"):
        library.recording("bad")
    assert started == []
    (folder / "flight.mcap").write_bytes(b"another")
    with pytest.raises(RunError, match="it is damaged"):
        library.recording("bad")
    assert len(started) == 1


def test_the_navigators_map_of_a_recording_is_listed_when_it_changes(tmp_path):
    gate = GateEstimate("red", (3.0, 2.0, 2.0), 0.5, (inf, inf, inf), 0.1, True, False, 1, 0)
    views = [None, NavigationView(goal="explore"), NavigationView((gate,), ((0.0, 0.0, 1.0),), "cross red")]
    place = PlaceEstimate((0.2, 0.1, 1.0), 0.1, (0.04, 0.0, 0.0, 0.0, 0.09, 0.0, 0.0, 0.0, 0.01), 0.05)
    folder, target = tmp_path / "flight", tmp_path / "target"
    folder.mkdir()
    target.mkdir()
    scenario, mission = load_scenario("test-case-1"), load_mission("frame_challenge")
    with FlightRecording(folder / "flight.mcap", scenario, mission, None) as recording:
        for tick in range(30):
            state = DroneState(50_000 * tick, 0.0, 0.0, 1.0, 0.0)
            moment = Moment(state, VelocityFluCommand(), Detections(), "a.b", 0.05 * tick)
            recording.see(replace(moment, navigation=views[tick // 10], place=place if tick >= 20 else None))
        still = [0.0] * 30
        times_s = [0.05 * tick for tick in range(30)]
        true_path = [(0.0, 0.0, 0.5, 1.0), (1.0, 1.0, 0.5, 1.0)]
        track = Track(times_s, still, still, still, ["a.b"] * 30, true_path=true_path)
        recording.finish(FlightResult(verdict="clean"), track)
    read_run(folder, target)
    run = json.loads((target / RECORDING).read_text())
    assert run["poses"][10]["p"] == [0.0, 0.0, 1.0]
    assert run["poses"][10]["truth"] == pytest.approx([0.5, 0.5, 1.0])
    maps = run["maps"]
    assert [each["place"] for each in maps] == [
        None,
        {"p": [0.2, 0.1, 1.0], "yaw": 0.1, "std": [0.2, 0.3, 0.1], "yaw_std": 0.05},
    ]
    assert [(each["t"], each["goal"]) for each in maps] == [(0.5, "explore"), (1.0, "cross red")]
    assert (maps[1]["frames"][0]["p"], maps[1]["frames"][0]["std"]) == ([3.0, 2.0, 2.0], None)
    assert maps[1]["path"] == [[0.0, 0.0, 1.0]]


def test_the_transitions_of_a_recording_have_ids_that_are_found_by_the_chart_if_it_is_older(tmp_path):
    folder, target = tmp_path / "flight", tmp_path / "target"
    folder.mkdir()
    target.mkdir()
    scenario, mission = load_scenario("test-case-1"), load_mission("frame_challenge")
    (folder / "mission.yaml").write_bytes(mission.path.read_bytes())
    taken = [
        ("red.turning", "red.frame_visible", "frame_seen", ("red.turning/1",)),
        ("red.frame_visible", "red.frame_visible", "memory.x0 > 1", ("red.frame_visible/9",)),  # to itself
        ("red.frame_visible", "red.frame_close", "frame.d < 0.45", ()),
        ("red.frame_close", "red.going_up", "", ()),  # which the chart does not have
        ("red.going_up", "green.go_to_center", "done", ()),
        ("green.go_to_center", "red.frame_close", "", ()),  # which the chart does not have
    ]
    with FlightRecording(folder / "flight.mcap", scenario, mission, None) as recording:
        for number, (source, arrived, when, ids) in enumerate(taken, 1):
            state = DroneState(1_000_000 * number, 0.0, 0.0, 1.0, 0.0)
            transition = TransitionTaken(source, arrived, when, (), state.time_us, 1.0, ids)
            what = (state, VelocityFluCommand(), Detections(), arrived, float(number), transition)
            recording.see(Moment(*what))
    read_run(folder, target)
    listed = json.loads((target / RECORDING).read_text())["transitions"]
    assert [each["ids"] for each in listed] == [
        ["red.turning/1"],
        ["red.frame_visible/9"],
        ["red.frame_visible/1"],
        [],
        ["red.going_up/1", "red/then"],
        [],
    ]
