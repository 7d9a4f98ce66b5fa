"""What the documents show: programs are run, files are read, the site is built, and its links lead somewhere.

Commands, and links between the documents' files, are checked in test_house.py; programs that need real time
are run in tests/realtime/test_simulator.py.
"""

from __future__ import annotations

import ast
import html
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import unquote

import cv2
import pytest
import yaml

import framerunner
from framerunner.camera_calibration.calibration_file import load_calibration
from framerunner.cli import build_app, run
from framerunner.geometry.gate_shape import GateShapes
from framerunner.vehicle.airframe import load_airframe
from offboard.mission import load_mission, new_mission
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.exploration import Explorer
from offboard.navigation.gates.gate_map import GateMap
from offboard.navigation.obstacle_map import ObstacleMap
from offboard.navigation.pose_history import PoseHistory
from offboard.navigation.search.likelihood import Glimpses
from scenarios.loader import load_scenario
from scenarios.random_scenarios import load_level
from sitl.sensors.suite import load_suite
from tests.documents import DOCS, PAGES, ROOT, blocks
from vision.types import Detections

PROGRAMS = {page: found for page in PAGES if (found := blocks(page, "python"))}
FILES = {page: found for page in PAGES if (found := blocks(page, "yaml"))}
IN_REAL_TIME = {("api.md", 1), ("ci.md", 0), ("simulator.md", 0)}


def names_of_the_map():
    """What the program around the pieces in navigation.md has."""
    scenario = load_scenario("test-case-1")
    level = (1.0, 0.0, 0.0, 0.0)
    state = SimpleNamespace(
        time_us=0, position_age_s=0.0, x=-3.0, y=-3.0, z=1.0, velocity_arena_m_s=(0.0, 0.0, 0.0)
    )
    state.attitude_arena, state.camera_attitude_arena = level, None
    classes = (CameraModel, Explorer, GateMap, GateShapes, ObstacleMap, PoseHistory)
    return {
        **{each.__name__: each for each in classes},
        "scenario": scenario,
        "state": state,
        "detections": Detections(time_us=0),
        "position_m": (-3.0, -3.0, 1.0),
        "attitude": level,
        "yaw_rad": 0.0,
        "positions": [],
        "glimpses": Glimpses(CameraModel.of(scenario.camera), GateShapes()),
        "obstacle_map": ObstacleMap(CameraModel.of(scenario.camera), scenario.arena),
    }


def an_image():
    rendered = cv2.imread(str(DOCS / "images" / "crowded-17-camera.png"))
    return {"new_detector": framerunner.new_detector, "image": rendered[:, :480].copy(), "time_us": 0}


def a_mission_with_a_pilot():
    run(["mission", "new", "my_mission", "--python"])
    return {}


def a_recording():
    assert run(["fly", "first-flight", "--mission", "hover", "--lockstep", "--record", "--out", "flown"]) == 0
    (recorded,) = Path("flown").rglob("flight.mcap")
    recorded.rename("flight.mcap")
    return {}


GIVEN = {
    "api.md": lambda: {"framerunner": framerunner, "__file__": str(Path("__init__.py").resolve())},
    "missions.md": a_mission_with_a_pilot,
    "navigation.md": names_of_the_map,
    "recording.md": a_recording,
    "vision.md": an_image,
}
PRINTED = {
    "api.md": "clean clean after",
    "detectors.md": "clean clean after",
    "evaluation.md": "clean ",
    "gymnasium.md": "",
    "missions.md": "name: first",
    "mocap.md": "",
    "navigation.md": "",
    "recording.md": '"state"',
    "tutorials/first-detector.md": "clean clean after",
    "vision.md": "red ",
}


def test_every_program_that_is_shown_is_run():
    shown = {(page, number) for page, found in PROGRAMS.items() for number in range(len(found))}
    assert shown == IN_REAL_TIME | {(page, n) for page in PRINTED for n in range(len(PROGRAMS[page]))}


@pytest.mark.parametrize("page", PRINTED)
def test_a_program_that_is_shown_does_what_is_said(page, tmp_path, monkeypatch, capsys):
    """The blocks of a page are run in its order, as one program."""
    if page == "gymnasium.md":
        pytest.importorskip("gymnasium")
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "__main__", **GIVEN.get(page, dict)()}
    for number, text in enumerate(PROGRAMS[page]):
        if (page, number) not in IN_REAL_TIME:
            exec(compile(text, f"docs/{page}", "exec"), names)
    assert PRINTED[page] in capsys.readouterr().out


def sections(text):
    """The top-level sections of a file as texts, by key; as it is written, so that `off` stays a word."""
    return {each.partition(":")[0]: each for each in re.split(r"^(?=\w)", text, flags=re.MULTILINE)[1:]}


def changed(folder, fragment, original):
    """A file of ours in which some sections are those of a page."""
    file = folder / "shown.yaml"
    whole = sections((ROOT / original).read_text(encoding="utf-8")) | sections(fragment)
    file.write_text("\n".join(whole.values()), encoding="utf-8")
    return file


def read_scenario(text, folder):
    load_scenario(changed(folder, text, "scenarios/files/test-case-1.yaml"))


def read_whole_scenario(text, folder):
    (folder / "shown.yaml").write_text(text, encoding="utf-8")
    load_scenario(folder / "shown.yaml")


def read_level(text, folder):
    level = load_level(changed(folder, text, "scenarios/levels/calm.yaml"))
    framerunner.random_scenario(level, 17)


def read_airframe(text, folder):
    load_airframe(
        str(changed(folder, text, "framerunner/vehicle/airframes/abejorro.yaml")),
    )


def read_suite(text, folder):
    (folder / "shown.yaml").write_text(text, encoding="utf-8")
    load_suite(folder / "shown.yaml")


def read_calibration(text, folder):
    (folder / "shown.yaml").write_text(text, encoding="utf-8")
    load_calibration(folder / "shown.yaml")


def read_part_of_calibration(text, folder):
    complete = next(each for each in FILES["camera.md"] if "fx_px" in each)
    read_calibration(complete + text, folder)


def read_mission(text, folder):
    (folder / "shown.yaml").write_text(text, encoding="utf-8")
    load_mission(folder / "shown.yaml")


def read_transitions(text, folder):
    states = {"shown": yaml.safe_load(text), "lost": {"enter": ["land"], "final": True}}
    read_mission(yaml.safe_dump({"name": "shown", "initial": "shown", "states": states}), folder)


def read_options(text, folder):
    (folder / "shown.yaml").write_text(text, encoding="utf-8")
    build_app().parse_args(
        ["fly", "--settings", str(folder / "shown.yaml")], print_error=False, exit_on_error=False
    )


def read_states_of_first_mission(text, folder):
    """The states of the exercise, in the mission that `mission new` writes; it then flies clean."""
    made = new_mission("my_mission", folder)
    mission = yaml.safe_load(made.texts[made.mission])
    mission["states"] |= yaml.safe_load(text)["states"]
    made.mission.write_text(yaml.safe_dump(mission, sort_keys=False), encoding="utf-8")
    assert framerunner.fly("test-case-1", made.mission).verdict == "clean"


def read_with_omissions(text, folder):
    """It leaves out what is in the states, so that only its form can be checked."""
    assert list(yaml.safe_load(text)) == ["templates"]


def read_workflow(text, folder):
    (job,) = yaml.safe_load(text)["jobs"].values()
    assert [step["run"] for step in job["steps"] if "run" in step][-1] == "pytest"


KINDS = {
    "camera.md": [*[read_scenario] * 4, read_level, read_calibration, read_part_of_calibration],
    "ci.md": [read_workflow],
    "devices.md": [read_scenario],
    "faults.md": [read_scenario],
    "flight-files.md": [read_options],
    "missions.md": [read_mission, read_mission, read_with_omissions, read_transitions],
    "real-drone.md": [read_whole_scenario],
    "scenarios.md": [
        read_whole_scenario,
        *[read_scenario] * 5,
        read_airframe,
        read_scenario,
        read_scenario,
        read_level,
    ],
    "sensors.md": [read_suite],
    "tutorials/first-mission.md": [read_states_of_first_mission],
}


def test_every_file_that_is_shown_is_checked():
    """Add the kind of a new one to KINDS."""
    assert {page: len(found) for page, found in FILES.items()} == {
        page: len(kinds) for page, kinds in KINDS.items()
    }


@pytest.mark.parametrize(("page", "number"), [(page, n) for page in KINDS for n in range(len(KINDS[page]))])
def test_a_file_that_is_shown_is_good(page, number, tmp_path):
    KINDS[page][number](FILES[page][number], tmp_path)


def texts_of_the_program():
    """All strings in the code; what is filled in is an ellipsis."""
    for room in ("framerunner", "offboard", "sitl", "vision", "firmware_py", "scenarios"):
        for path in (ROOT / room).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Constant) and isinstance(node.value, str):
                    yield node.value
                elif isinstance(node, ast.JoinedStr):
                    yield "".join(
                        each.value if isinstance(each, ast.Constant) else "…" for each in node.values
                    )


def test_messages_in_troubleshooting_are_those_of_the_program():
    shown = re.findall(
        r"^### `(.+)`$", (DOCS / "troubleshooting.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    composed = (
        "framerunner: command not found",  # the shell's
        "… cannot be opened (Address already in use); if another simulator",
        "--ardupilot …: has no arducopter",
        "--drone …: needs the URL of its camera too; add --camera",  # of a table of rules, as the next
        "--monitor: shows flights in real time; leave it out with --lockstep",
        "unknown scenario",
    )
    texts = "\n".join([*texts_of_the_program(), (ROOT / "Makefile").read_text(encoding="utf-8")])
    unknown = [each for each in shown if each.removesuffix("…").strip() not in texts]
    assert len(shown) > 20
    assert [each for each in unknown if not each.startswith(composed)] == []


def test_no_node_of_a_diagram_has_a_name_that_mermaid_reserves():
    """It draws an error instead of such a diagram."""
    reserved = re.compile(r"(?<![\w\"-])(class|end|graph|style|subgraph|click|default)(?=\[|\(| *--|$)")
    drawn = [(page, text) for page in PAGES for text in blocks(page, "mermaid")]
    found = [
        (page, line.strip())
        for page, text in drawn
        if text.startswith("flowchart")
        for line in text.splitlines()
        if reserved.search(line) and line.strip() not in ("end",)
    ]
    assert len(drawn) > 8
    assert found == []


@pytest.mark.parametrize("page", sorted((DOCS / "tutorials").glob("*.md")), ids=lambda path: path.name)
def test_a_tutorial_says_the_time_it_takes(page):
    assert re.match(r"# .+\n\n\*\*Time: \d+ minutes\*\*", page.read_text(encoding="utf-8"))


def build_site(folder):
    """Build the site; every warning is an error."""
    options = ["-q", "-E", "-W", "--keep-going", "-b", "html"]
    command = [sys.executable, "-m", "sphinx", *options, str(DOCS), str(folder)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, cwd=ROOT)
    assert (done.returncode, done.stderr) == (0, "")


def broken_links(site, page, texts):
    """Links of a page to files or places in them that are not there."""
    for link in re.findall(r'<(?:a|img|link|script)\b[^>]*?\b(?:href|src)="([^"]+)"', texts[page]):
        path, _, place = html.unescape(link).partition("#")
        if "://" in path or path.startswith(("mailto:", "data:")):
            continue
        target = (page.parent / unquote(path.partition("?")[0])).resolve() if path else page
        known = target.exists() and (
            not place or target not in texts or f'id="{unquote(place)}"' in texts[target]
        )
        if not known:
            yield f"{page.relative_to(site)}: {link}"


def check_pages(site, texts):
    """Every page is there and says a time; so are search, the public names, and what links lead to."""
    assert [page for page in PAGES if (site / page).with_suffix(".html") not in texts] == []
    assert "searchindex.js" in texts[site / "search.html"]
    assert "framerunner" in (site / "searchindex.js").read_text(encoding="utf-8")
    pages = {page: texts[(site / page).with_suffix(".html")] for page in PAGES}
    times = re.compile(r"Reading time: \d+ min|<strong>Time: \d+ min")
    assert [page for page, text in pages.items() if not times.search(text)] == []
    places = (f'id="framerunner.{name}"' for name in framerunner.__all__ if name != "__version__")
    assert [place for place in places if place not in pages["reference.md"]] == []
    assert "framerunner.__version__" in pages["reference.md"]
    assert [each for page in texts for each in broken_links(site, page, texts)] == []


def check_nothing_is_fetched(site, texts):
    source = r'<(?:script|img|iframe)\b[^>]*\bsrc="(?:https?:)?//'
    style = r'<link\b(?=[^>]*rel="(?:stylesheet|preload|preconnect)")[^>]*href="(?:https?:)?//'
    assert [page for page, text in texts.items() if re.search(f"{source}|{style}", text)] == []
    styles = {path: path.read_text(encoding="utf-8") for path in site.rglob("*.css")}
    assert [path for path, text in styles.items() if re.search(r"url\([\"']?(?:https?:)?//", text)] == []


def test_the_site_is_built_without_a_warning_complete_and_for_use_without_network(tmp_path):
    pytest.importorskip("sphinx", reason="Sphinx is not installed; pip install 'framerunner[docs]'")
    site = tmp_path.resolve() / "site"
    build_site(site)
    texts = {path: path.read_text(encoding="utf-8") for path in site.rglob("*.html")}
    check_pages(site, texts)
    check_nothing_is_fetched(site, texts)
