"""A second package, in a folder of its own, adds to this one by entry points; so do bad ones."""

import json
import sys
from importlib import resources
from pathlib import Path

import pytest
from joblib.externals.loky import get_reusable_executor

import framerunner
from framerunner.cli import run
from framerunner.commands.monitor import equipment
from framerunner.editing.web import EditingRouter
from framerunner.errors import UserError
from framerunner.evaluation.plan import plan_flights
from framerunner.files.extensions import KINDS, ExtensionError
from framerunner.vehicle.airframe import load_airframe
from offboard.mission import MISSIONS
from sitl.sensors.suite import load_suite
from tests.framerunner.editing.page_socket import flights_socket

MISSION = """
name: gentle_hover
description: Hovers, and lands when it has seen a red frame
detector: redness
initial: rise
states:
  rise:
    enter: [hover]
    during: [climb_gently]
    transitions:
      - when: frame_seen
        to: landing
  landing:
    enter: [land]
    final: true
"""
LEVEL = """
name: gentle
description: calm, under another name
airframe: feather
layout:
  x_m: {low: -4.2, high: 4.2}
  y_m: {low: -4.2, high: 4.2}
  apart_m: 2.2
  frame_z_m: {low: 0.9, high: 1.9}
  frame_yaw_rad: {low: -3.1, high: 3.1}
  start_yaw_rad: {low: -3.1, high: 3.1}
"""
CODE = """
from pathlib import Path
from framerunner import Detection, Detections, Pilot

HERE = Path(__file__).parent
HOVER, GENTLE, FEATHER, NOISY = (HERE / f"{name}.yaml" for name in ("hover", "gentle", "feather", "noisy"))
NO_PATH, NO_FILE = 3, HERE / "nowhere.yaml"


class Gentle(Pilot):
    def climb_gently(self):
        self.cmd.vel_z = 0.4


def redness(calibration):
    images = []

    def detect(image, time_us):
        images.append(time_us)
        seen = Detection(10.0, -10.0, 20.0, -20.0, 2.0, 0.0)
        return Detections(red=seen if len(images) > 60 else Detection())

    return detect
"""
ENTRY_POINTS = """
[framerunner.missions]
gentle_hover = second_package:HOVER
explorer = second_package:HOVER
[framerunner.pilots]
gentle = second_package:Gentle
no_pilot = second_package:redness
[framerunner.detectors]
redness = second_package:redness
boxes = second_package:redness
broken = second_package:nothing
[framerunner.levels]
gentle = second_package:GENTLE
calm = second_package:GENTLE
no_path = second_package:NO_PATH
no_file = second_package:NO_FILE
[framerunner.airframes]
feather = second_package:FEATHER
[framerunner.sensors]
noisy = second_package:NOISY
"""


def install(folder, name, entry_points):
    """What an installer leaves of a package's metadata."""
    info = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(entry_points, encoding="utf-8")


@pytest.fixture
def second_package(tmp_path, monkeypatch):
    """Installed for one test, here and, as PYTHONPATH is inherited, in processes that it starts."""
    folder = tmp_path / "site"
    code = folder / "second_package"
    code.mkdir(parents=True)
    (code / "__init__.py").write_text(CODE, encoding="utf-8")
    (code / "hover.yaml").write_text(MISSION, encoding="utf-8")
    (code / "gentle.yaml").write_text(LEVEL, encoding="utf-8")
    airframes = resources.files("framerunner.vehicle") / "airframes"
    abejorro = (airframes / "abejorro.yaml").read_text(encoding="utf-8")
    (code / "feather.yaml").write_text(abejorro.replace("name: abejorro", "name: feather"), encoding="utf-8")
    suites = resources.files("sitl.sensors") / "suites"
    (code / "noisy.yaml").write_bytes((suites / "mocap.yaml").read_bytes())
    install(folder, "second-package", ENTRY_POINTS)
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setenv("PYTHONPATH", str(folder))
    monkeypatch.chdir(tmp_path)
    get_reusable_executor().shutdown(wait=True)  # processes that were started before do not find it
    yield folder
    get_reusable_executor().shutdown(wait=True)
    sys.modules.pop("second_package", None)


def test_a_mission_a_detector_and_a_level_of_another_package_are_flown(second_package):
    result = framerunner.fly("gentle-3", "gentle_hover", pilot="gentle")
    assert (result.scenario, result.mission, result.mission_state) == ("gentle-3", "gentle_hover", "landing")
    again = framerunner.fly("gentle-3", "gentle_hover", pilot="gentle")
    assert again.state_sha256 == result.state_sha256  # each flight has a detector of its own


def test_flights_in_other_processes_use_it_too(second_package):
    level = {"level": "gentle", "count": 2, "mission": "gentle_hover", "pilot": "gentle"}
    alone = framerunner.evaluate(**level, jobs=1)
    assert [row.mission_state for row in alone.rows] == ["landing", "landing"]
    together = framerunner.evaluate(**level, jobs=2)
    assert [row.state_sha256 for row in together.rows] == [row.state_sha256 for row in alone.rows]


def test_the_command_line_takes_their_names(second_package, capsys):
    command = ["gentle-3", "--mission", "gentle_hover", "--pilot", "gentle", "--lockstep", "--out", "runs"]
    assert run(["fly", *command, "--sensors", "noisy"]) == 1
    assert run(["mission", "show", "gentle_hover", "--pilot", "gentle"]) == 0
    (flight,) = Path("runs").iterdir()
    assert run(["replay", str(flight), "--pilot", "gentle", "--fast"]) == 0  # it is the same to the last bit
    options = ["--level", "gentle", "--images", "80", "--detector", "redness", "--out", "rated"]
    assert run(["vision", "evaluate", *options]) == 0
    printed = capsys.readouterr().out
    assert "redness boxes" in printed
    assert "redness frames" not in printed  # it gives none


def test_the_monitor_and_its_editor_take_a_pilots_name(second_package):
    fly = ["fly", "gentle-3", "--mission", "gentle_hover", "--pilot", "gentle", "--lockstep"]
    assert run(fly) == 1
    (flight,) = Path("runs").iterdir()
    given = equipment("udpin://127.0.0.1:14550", None, Path("runs"), pilot="gentle")
    assert given.runs.recording(flight.name)["chart"]["name"] == "gentle_hover"
    editing = next(each for each in given.extensions if isinstance(each, EditingRouter))
    start = {"kind": "start_batch", "tag": 1, "text": MISSION, "scenarios": ["test-case-1"]}
    with flights_socket(editing) as socket:
        socket.send_text(json.dumps(start))
        while (told := json.loads(socket.receive_text()))["kind"] != "flight":
            assert told["kind"] != "refused", told
    assert told["result"]["mission_state"] == "landing", told


def test_airframes_and_sensors_are_found_by_name(second_package):
    assert load_airframe("feather").name == "feather"
    assert load_suite("noisy") == load_suite("mocap")


def test_names_of_ours_cannot_be_replaced(second_package):
    assert framerunner.load_mission("explorer").path.parent == MISSIONS
    assert framerunner.load_level("calm").name == "calm"
    with pytest.raises(UserError, match="unknown detector 'boxes'"):
        framerunner.fly("calm-17", detector="boxes")


def test_a_mission_may_name_an_installed_detector_only(second_package):
    path = second_package / "mine.yaml"
    path.write_text(MISSION.replace("redness", "rednes"), encoding="utf-8")
    with pytest.raises(UserError, match=r"mine.yaml:4:11: unknown detector .*; did you mean 'redness'\?"):
        framerunner.load_mission(path, "gentle")
    for name in ("boxes", "../second_package/__init__.py"):
        path.write_text(MISSION.replace("redness", name), encoding="utf-8")
        with pytest.raises(UserError, match="unknown detector"):
            framerunner.load_mission(path, "gentle")


def test_without_a_package_a_mission_with_a_detector_says_what_to_do(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(MISSION.replace("climb_gently", "hover"), encoding="utf-8")
    with pytest.raises(UserError, match="no installed package adds one; leave 'detector' out"):
        framerunner.load_mission(path)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: framerunner.load_level("no_path"), "is no path of a YAML file but int"),
        (lambda: framerunner.load_level("no_file"), "has no file"),
        (lambda: framerunner.load_mission("explorer", "no_pilot"), "is no subclass of framerunner.Pilot"),
        (lambda: framerunner.fly("calm-17", detector="broken"), "cannot be loaded: AttributeError"),
    ],
)
def test_a_bad_entry_point_is_one_line_with_package_entry_point_and_what_to_do(second_package, call, words):
    with pytest.raises(ExtensionError, match=r"^[^\n]*$") as refused:
        call()
    assert words in str(refused.value)
    assert "second-package 1.0: " in str(refused.value)
    assert '= "second_package:' in str(refused.value)
    assert str(refused.value).endswith("or uninstall second-package")


def test_a_name_that_two_packages_add_is_refused(second_package):
    install(second_package, "third-package", "[framerunner.levels]\ngentle = second_package:GENTLE\n")
    with pytest.raises(ExtensionError, match="level gentle: second-package and third-package both add it"):
        framerunner.load_level("gentle")


def test_an_evaluation_knows_the_versions_that_it_was_flown_with(second_package):
    def identity():
        mission = framerunner.load_mission("gentle_hover", "gentle")
        assert mission.rules == f"class contest, vision boxes, detector redness of second-package {version}"
        return plan_flights(["calm-17"], None, None, None, mission).identity

    version = "1.0"
    before = identity()
    assert before == identity()
    assert before.pilot_sha256
    version = "1.1"
    for file in second_package.glob("*/METADATA"):
        file.write_text(
            file.read_text(encoding="utf-8").replace("Version: 1.0", "Version: 1.1"), encoding="utf-8"
        )
    assert before.difference(identity()) == "another content of mission gentle_hover"


def test_the_list_shows_what_is_installed_and_from_where(second_package, capsys):
    assert run(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if not line.startswith(" ")] == [
        kind if kind == "sensors" else f"{kind}s" for kind in KINDS
    ]
    rows = [" ".join(line.split()) for line in lines]
    assert {"explorer framerunner", "gentle second-package 1.0", "frames framerunner"} <= set(rows)
    assert "calm second-package 1.0; not used: framerunner has one of this name" in rows
    assert "second_package" not in sys.modules  # nothing of it runs
