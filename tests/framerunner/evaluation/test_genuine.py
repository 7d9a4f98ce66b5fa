"""`framerunner evaluate` with genuine autopilots: none is needed, their flights are lockstep flights here."""

import asyncio
import json
import os
import signal
import socket
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from framerunner import instances
from framerunner.cli import run
from framerunner.errors import SettingError
from framerunner.evaluation import runner
from framerunner.evaluation.plan import plan_files
from framerunner.evaluation.runner import interrupted_once
from framerunner.flying.lockstep import fly_lockstep
from framerunner.instances import claimed_instance
from offboard.mission import load_mission
from scenarios.faults.declaration import parse_fault
from scenarios.loader import dump_yaml, load_scenario
from tests.framerunner.evaluation.flights import short_scenario, write_scenarios


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def three_instances(monkeypatch, tmp_path):
    """Their ports are not those of other tests, nor their locks; returns the folder of the locks."""
    monkeypatch.setattr(instances, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr(instances, "INSTANCES", 3)
    monkeypatch.setattr(instances, "_TCP_PORTS", (24560,))
    monkeypatch.setattr(instances, "_UDP_PORTS", (24580,))
    monkeypatch.setattr(instances, "_ARDUPILOT_UDP_PORTS", ())
    monkeypatch.setattr(instances, "_PX4_LOCKS", str(tmp_path / "px4_lock-"))
    return tmp_path


@pytest.fixture
def px4():
    """A folder that looks like a build of PX4, whose program ends at once."""
    folder = Path("px4")
    (folder / "bin").mkdir(parents=True)
    (folder / "etc").mkdir()
    program = folder / "bin" / "px4"
    program.write_text("#!/bin/sh\necho 'ERROR [init] no airframe'; exit 3\n")
    program.chmod(0o755)
    return folder


@pytest.fixture
def flown(monkeypatch):
    """Plans that were flown by a "genuine" autopilot."""
    plans = []

    def fly(plan, use):
        plans.append((plan, use))
        flight = fly_lockstep(plan)
        return replace(flight, result=flight.result.model_copy(update={"autopilot": use.autopilot.title}))

    monkeypatch.setattr(runner, "fly_with_genuine", fly)
    return plans


def test_flights_are_kept_counted_and_continued_as_in_lockstep(px4, flown, capsys):
    write_scenarios(Path("mine"), seeds=(1, 2))
    assert run(["evaluate", "mine", "--px4", str(px4)]) == 0
    said = capsys.readouterr()
    assert "drones with ideal sensors have mocap" in said.err
    assert "mine, flown by PX4: explorer" in said.out
    assert [(plan.scenario.sensors, use.speed) for plan, use in flown] == [("mocap", 4.0)] * 2
    (folder,) = Path("runs").iterdir()
    assert folder.name.startswith("evaluate-mine-px4-explorer-")
    assert load_scenario(folder / "scenarios" / "calm-1.yaml").sensors == "mocap"
    header, *rows = (folder / "results.csv").read_text().splitlines()
    at = header.split(",").index("autopilot") - len(header.split(","))
    assert {row.split(",")[at] for row in rows} == {"PX4"}
    assert " --px4 px4" in (folder / "report.html").read_text()

    lines = (folder / "flights.jsonl").read_text().splitlines(keepends=True)
    (folder / "flights.jsonl").write_text(lines[0])
    assert run(["evaluate", "mine", "--px4", str(px4)]) == 0
    assert len(flown) == 3
    (px4 / "bin" / "px4").write_text("#!/bin/sh\nanother build\n")
    out = ["--out", str(folder)]
    assert run(["evaluate", "mine", "--px4", str(px4), *out]) == 2
    assert "has an evaluation of autopilot PX4 " in capsys.readouterr().err
    assert run(["evaluate", "mine", *out]) == 2


def test_ardupilot_flies_as_px4_does(flown, capsys):
    program = Path("ardupilot/build/sitl/bin/arducopter")
    program.parent.mkdir(parents=True)
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    write_scenarios(Path("mine"), seeds=(1,))
    assert run(["evaluate", "mine", "--ardupilot", "ardupilot", "--speed", "5"]) == 0
    assert "mine, flown by ArduPilot: explorer" in capsys.readouterr().out
    ((plan, use),) = flown
    assert (plan.scenario.sensors, use.autopilot.name, use.speed) == ("mocap", "ardupilot", 5.0)
    (folder,) = Path("runs").iterdir()
    assert folder.name.startswith("evaluate-mine-ardupilot-explorer-")


def test_our_own_autopilots_evaluations_are_recognised_as_before():
    identity = plan_files([str(write_scenarios(Path("mine")))], load_mission("explorer")).identity
    assert "autopilot" not in identity.as_data()
    assert "autopilot" in replace(identity, autopilot="PX4 1234").as_data()


def test_a_px4_that_ends_is_an_error_in_words(px4, capsys):
    write_scenarios(Path("mine"), seeds=(1,))
    assert run(["evaluate", "mine", "--px4", str(px4), "--out", "kept"]) == 1
    (row,) = (json.loads(line) for line in Path("kept/flights.jsonl").read_text().splitlines())
    assert row["verdict"] == "error"
    assert "PX4 ended with code 3: ERROR [init] no airframe" in row["reason"]


def test_flights_with_faults_of_the_link_are_left_out(px4, flown, capsys):
    folder = Path("mine")
    folder.mkdir()
    for seed, fault in ((1, "link off at 1 s"), (2, "barometer off at 0 s")):
        scenario = short_scenario(seed).model_copy(
            update={"sensors": "mocap", "faults": (parse_fault(fault),)}
        )
        (folder / f"{scenario.name}.yaml").write_text(dump_yaml(scenario))
    assert run(["evaluate", "mine", "--px4", str(px4)]) == 0
    assert "1 of 2 flights have a fault of it, left out" in capsys.readouterr().err
    assert [plan.scenario.name for plan, _ in flown] == ["calm-2"]
    assert run(["evaluate", "mine/calm-1.yaml", "--px4", str(px4)]) == 2
    assert "all flights have a fault of the link" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--px4", "/no/px4"], "--px4 /no/px4: has no bin/px4"),
        (["--speed", "2"], "--speed 2: is for flights with --px4 or --ardupilot"),
        (["--px4", "px4", "--response", "lag=0.5"], "--response lag=0.5: changes our autopilot's flights"),
        (["--px4", "px4", "--backend", "ray"], "--backend ray: PX4 is started on this machine"),
        (["--px4", "px4", "--jobs", "11"], "--jobs"),
        (["--px4", "px4", "--ardupilot", "here"], "--ardupilot here: PX4 flies, by --px4 px4"),
        (["--ardupilot", "/no/ardupilot"], "--ardupilot /no/ardupilot: has no arducopter"),
    ],
)
def test_options_that_do_not_go_together(px4, options, message, capsys):
    assert run(["evaluate", "calm-1", *options]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.usefixtures("three_instances")
def test_each_flight_at_once_has_an_instance_of_its_own():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 24581))
        with claimed_instance() as first, claimed_instance() as second:
            assert (first, second) == (0, 2)
            with pytest.raises(SettingError, match="all 3 instances are in use"), claimed_instance():
                pass
        with claimed_instance() as again:
            assert again == 0


def test_an_instance_whose_px4_runs_already_is_left_to_it(three_instances):
    lock = three_instances / "px4_lock-0"
    lock.touch()
    with claimed_instance() as instance:
        assert instance == 0  # left by a PX4 that has ended
    hold = "import fcntl, sys; f = open(sys.argv[1], 'r+'); fcntl.lockf(f, fcntl.LOCK_EX); print(); input()"
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", hold, str(lock)], **pipes) as other:
        other.stdout.readline()
        with claimed_instance() as instance:
            assert instance == 1
        other.communicate(b"\n")


def test_a_flight_that_is_interrupted_twice_still_ends_in_order():
    ended = []

    async def flight():
        try:
            os.kill(os.getpid(), signal.SIGINT)
            await asyncio.sleep(20.0)
        finally:
            await asyncio.sleep(0.01)
            os.kill(os.getpid(), signal.SIGINT)
            await asyncio.sleep(0.01)
            ended.append(True)

    with pytest.raises(KeyboardInterrupt):
        asyncio.run(interrupted_once(flight()))
    assert ended
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_lock_in_the_shared_folder_neither_changes_nor_waits_for_other_files(three_instances):
    valuable = three_instances / "valuable"
    valuable.write_text("kept")
    (three_instances / "framerunner-instance-0.lock").symlink_to(valuable)
    left = three_instances / "framerunner-instance-1.lock"  # by an earlier flight of another user
    left.write_text("theirs")
    left.chmod(0o666)
    with claimed_instance() as instance:
        assert instance == 1
    assert (valuable.read_text(), left.read_text()) == ("kept", "theirs")
    with claimed_instance(), claimed_instance() as instance:
        assert instance == 2
    made = three_instances / "framerunner-instance-2.lock"
    assert made.stat().st_mode & 0o777 == 0o666  # other users claim it, too


def test_a_pipe_in_the_place_of_a_lock_of_px4_is_not_waited_for(three_instances):
    os.mkfifo(three_instances / "px4_lock-0")
    with claimed_instance() as instance:
        assert instance == 0
