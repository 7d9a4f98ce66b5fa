"""A contestant's Python file: what it may be, what is said if not, and that it travels with a mission."""

import os
import pickle
import signal
import subprocess
import sys
import threading
from textwrap import dedent

import pytest

from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.engine import MissionEngine, MissionRunError
from offboard.mission import MissionError, load_mission
from offboard.pilot import Imu, Pilot, PilotError, velocity_command
from offboard.pilot_file import PilotFile, read_pilot
from scenarios.loader import load_scenario
from vision.types import Detections

GOOD = dedent("""\
    from __future__ import annotations

    from dataclasses import dataclass
    from math import hypot

    from offboard.pilot import Pilot


    @dataclass
    class Gains:
        climb_m_s: float = 0.5


    class MyPilot(Pilot):
        gains: Gains = Gains()
        wanted_m = 1.0

        @property
        def high_enough(self) -> bool:
            return self.imu.z > self.wanted_m

        def climb(self):
            self.hover()
            self.cmd.vel_z = self.rate(self.gains.climb_m_s)

        def rate(self, metres_a_second):
            return hypot(metres_a_second, 0.0)
    """)

MISSION = dedent("""\
    name: little
    initial: up
    variables: {count: 0}
    states:
      up:
        enter: [climb]
        during: [climb]
        transitions:
          - when: high_enough and imu.z > wanted_m and gains.climb_m_s < 1
            to: done
      done:
        enter: [land]
        final: true
    """)

FLY_WHAT_IS_SENT = """
import pickle, sys
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from scenarios.loader import load_scenario

result = fly_lockstep(FlightPlan(load_scenario("empty"), pickle.load(sys.stdin.buffer))).result
print(result.state_sha256, result.try_time_s)
"""


@pytest.fixture
def mission_file(tmp_path):
    path = tmp_path / "little.yaml"
    path.write_text(MISSION, encoding="utf-8")
    return path


def pilot_file(tmp_path, text):
    path = tmp_path / "my_pilot.py"
    path.write_text(text, encoding="utf-8")
    return path


def with_method(text):
    return GOOD + "".join(f"    {line}\n" for line in text.splitlines())


def refusal(path):
    with pytest.raises(MissionError) as caught:
        read_pilot(path)
    said = str(caught.value)
    assert "\n" not in said
    return said


def test_a_mission_uses_what_the_file_adds(tmp_path, mission_file):
    engine = MissionEngine(load_mission(mission_file, read_pilot(pilot_file(tmp_path, GOOD))))
    assert engine.tick(Imu(), Detections(), 0).up_m_s == 0.5
    assert engine.tick(Imu(z=0.9), Detections(), 50_000).up_m_s == 0.5
    engine.tick(Imu(z=1.1), Detections(), 100_000)
    assert engine.finished


def test_without_the_file_its_names_are_unknown(mission_file):
    with pytest.raises(MissionError) as caught:
        load_mission(mission_file)
    said = str(caught.value)
    assert "unknown action 'climb'" in said
    assert "unknown name 'gains'" in said
    assert all(line.endswith("what a Python file adds needs --pilot FILE.py") for line in said.splitlines())


BAD_TEXTS = [
    ("class MyPilot(Pilot)\n", "my_pilot.py:1: Python syntax: "),
    ("x = 1\n", "my_pilot.py: has no subclass of Pilot; write "),
    ("from offboard.pilot import Pilot\n", "has no subclass of Pilot"),
    (GOOD + "\n\nclass Other(Pilot):\n    pass\n", "several subclasses of Pilot: MyPilot, Other; leave one"),
    ("import sys\nimport wings\n", "my_pilot.py:2: cannot be imported: ModuleNotFoundError: No module named"),
    ("x = 1\nraise SystemExit\n", "my_pilot.py:2: cannot be imported: SystemExit"),
    ("class Stop(BaseException): pass\nraise Stop(7)\n", "my_pilot.py:2: cannot be imported: Stop: 7"),
    ("raise KeyboardInterrupt\n", "my_pilot.py:1: cannot be imported: KeyboardInterrupt"),
    ("\n\n\nraise ValueError('two\\nlines')\n", "my_pilot.py:4: cannot be imported: ValueError: two lines"),
    (
        GOOD.replace("gains: Gains", "gains: Wings"),
        "a type in class MyPilot is unknown: NameError: name 'Win",
    ),
    (GOOD.replace("-> bool", "-> wings"), "my_pilot.py:18: the type of 'high_enough' is unknown: NameError"),
    (with_method("async def wait(self): ..."), "my_pilot.py:28: 'wait' is 'async'"),
]


@pytest.mark.parametrize(("text", "message"), BAD_TEXTS)
def test_a_bad_file_is_refused_in_one_line(tmp_path, text, message):
    said = refusal(pilot_file(tmp_path, text))
    assert message in said
    assert said.startswith("my_pilot.py:")


def test_ctrl_c_while_a_file_is_imported_is_the_user_s(tmp_path):
    path = pilot_file(tmp_path, "while True:\n    pass\n")
    threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        read_pilot(path)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_file_that_cannot_be_read_is_refused(tmp_path):
    missing = tmp_path / "none.py"
    assert refusal(missing) == f"{missing}: cannot be read: No such file or directory"
    assert "cannot be read" in refusal(tmp_path)
    path = tmp_path / "latin.py"
    path.write_bytes(b"# \xe9\n")
    assert "is not UTF-8 text" in refusal(path)
    path.write_text("x = 1\n", encoding="utf-16")
    assert "is UTF-16 text, or no text; save it as UTF-8" in refusal(path)
    path.write_text("#" * 1_000_001, encoding="utf-8")
    assert "larger than 1 MB" in refusal(path)


BAD_STARTS = [
    ("def __init__(self, variables):\n    pass", "must begin with 'super().__init__(variables)'"),
    ("def __init__(self):\n    super().__init__()", "my_pilot.py: MyPilot cannot be created: TypeError: "),
    (
        "def __init__(self, variables):\n    super().__init__(variables)\n    self.memory.total += 1",
        "my_pilot.py:30: MyPilot cannot be created: AttributeError: ",
    ),
]


@pytest.mark.parametrize(("text", "message"), BAD_STARTS)
def test_a_class_that_cannot_be_made_is_refused_with_the_mission(tmp_path, mission_file, text, message):
    pilot = read_pilot(pilot_file(tmp_path, with_method(text)))
    with pytest.raises(MissionError) as caught:
        load_mission(mission_file, pilot)
    assert message in str(caught.value)


def test_a_class_may_start_with_the_mission_s_variables(tmp_path, mission_file):
    start = "def __init__(self, variables):\n    super().__init__(variables)\n    self.memory.count += 1"
    mission = load_mission(mission_file, read_pilot(pilot_file(tmp_path, with_method(start))))
    assert [mission.new_pilot().memory.count for _ in range(2)] == [1, 1]


def test_an_action_cannot_need_values(tmp_path, mission_file):
    mission_file.write_text(MISSION.replace("[climb]", "[rate]", 1), encoding="utf-8")
    with pytest.raises(MissionError, match="'rate' needs metres_a_second, but an action is called without"):
        load_mission(mission_file, read_pilot(pilot_file(tmp_path, GOOD)))


def test_a_helper_class_between_is_no_second_pilot(tmp_path):
    text = GOOD + "\n\nclass Better(MyPilot):\n    pass\n\n\nAlias = Better\n"
    assert read_pilot(pilot_file(tmp_path, text)).pilot_class().__name__ == "Better"


def test_no_flight_finds_what_another_left_behind(tmp_path, mission_file):
    count = "seen = []\ndef climb(self):\n    self.seen.append(1)\n    self.cmd.vel_z = 0.1 * len(self.seen)"
    mission = load_mission(mission_file, read_pilot(pilot_file(tmp_path, with_method(count))))
    known = len(sys.modules)
    rates = [MissionEngine(mission).tick(Imu(), Detections(), 0).up_m_s for _ in range(3)]
    assert rates == [0.1, 0.1, 0.1]
    assert len(sys.modules) == known


@pytest.mark.parametrize(
    ("primitive", "message"),
    [
        (
            "def climb(self):\n    self.cmd.vel_z = 1 / 0",
            "my_pilot.py:29: ZeroDivisionError: division by zero",
        ),
        ("def climb(self):\n    raise SystemExit(3)", "my_pilot.py:29: SystemExit: 3"),
        (
            "def climb(self):\n    self.cmd.vel_z = None",
            "cmd.vel_z is None, which is no number; correct",
        ),
        ("def climb(self):\n    min()", "my_pilot.py:29: TypeError: min expected at least 1 argument, got 0"),
    ],
)
def test_an_error_in_a_primitive_ends_the_mission_with_its_line(tmp_path, mission_file, primitive, message):
    engine = MissionEngine(
        load_mission(mission_file, read_pilot(pilot_file(tmp_path, with_method(primitive))))
    )
    with pytest.raises(MissionRunError) as caught:
        engine.tick(Imu(), Detections(), 0)
    assert message in str(caught.value)
    assert str(caught.value).startswith("mission 'little', state '")
    assert "\n" not in str(caught.value)


def test_an_error_in_a_value_is_told_by_its_line_too(tmp_path, mission_file):
    text = GOOD.replace("return self.imu.z", "return self.wings")
    engine = MissionEngine(load_mission(mission_file, read_pilot(pilot_file(tmp_path, text))))
    engine.tick(Imu(), Detections(), 0)
    with pytest.raises(MissionRunError, match=r"state 'up': my_pilot\.py:20: AttributeError: "):
        engine.tick(Imu(), Detections(), 50_000)


def test_an_error_in_flight_ends_it_in_hold(tmp_path, mission_file):
    breaks = GOOD.replace("self.hover()\n", "self.hover()\n        self.memory.count /= self.imu.z < 0.6\n")
    mission = load_mission(mission_file, read_pilot(pilot_file(tmp_path, breaks)))
    flown = fly_lockstep(FlightPlan(load_scenario("empty"), mission))
    assert flown.outcome.ended == "aborted"
    assert "my_pilot.py:24: ZeroDivisionError: " in flown.result.reason
    assert flown.result.verdict == "aborted"
    assert flown.track.z[-1] > 0.5  # its motors were not stopped in the air


def test_a_mission_travels_and_flies_alike(tmp_path, mission_file):
    mission = load_mission(mission_file, read_pilot(pilot_file(tmp_path, GOOD)))
    mission_file.unlink()
    scenario = load_scenario("empty")
    here = fly_lockstep(FlightPlan(scenario, mission))
    sent = pickle.dumps(mission)  # after a flight: what it built must not be sent
    flown = subprocess.run(
        [sys.executable, "-c", FLY_WHAT_IS_SENT], input=sent, capture_output=True, check=True
    )
    assert len(sent) < 10_000
    assert here.outcome.ended == "finished"
    assert flown.stdout.decode().split() == [here.result.state_sha256, str(here.result.try_time_s)]
    assert pickle.loads(sent) == mission


def test_a_mission_of_the_package_travels_too():
    mission = load_mission("frame_challenge")
    copy = pickle.loads(pickle.dumps(mission))
    assert copy == mission
    assert copy.finishes == mission.finishes
    assert isinstance(copy.new_pilot(), Pilot)


def test_a_file_is_small_data():
    pilot = PilotFile("my_pilot.py", GOOD)
    assert pickle.loads(pickle.dumps(pilot)) == pilot
    assert pilot.pilot_class() is not pilot.pilot_class()


@pytest.mark.parametrize("value", [None, "fast", (1, 2), 1j])
def test_a_rate_that_is_no_number_is_not_flown(value):
    pilot = Pilot()
    pilot.cmd.vel_y = value
    with pytest.raises(PilotError, match=r"cmd\.vel_y is"):
        velocity_command(pilot.cmd)
