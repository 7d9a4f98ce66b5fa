"""The mistakes that people make who write their first missions: each is told once, at its place."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

import pytest
import yaml

from framerunner.flying.plan import FlightPlan
from offboard.chart.vocabulary import Vocabulary
from offboard.engine import MissionEngine, MissionRunError
from offboard.mission import MissionError, load_mission
from offboard.pilot import NAMES_ON_MAP, Imu, Pilot, PilotError
from scenarios.loader import load_scenario
from vision.types import Detections

GOOD = dedent("""\
    name: little
    initial: rise
    variables:
      home_x: 0
    states:
      rise:
        enter:
          - hover
          - memory.home_x = imu.x
          - goal_m = (imu.x, imu.y, 2)
        during:
          - fly_to_goal
        transitions:
          - when: distance_to_goal_m < 0.1
            to: search
      search:
        enter:
          - hover
          - colour = 'red'
          - cmd.rot_z = 0.5
        transitions:
          - when: frame_seen
            to: down
          - when: seconds_in_state > 30
            to: down
      down:
        enter:
          - land
        final: true
    """)

MISTAKES = yaml.safe_load(Path(__file__).with_name("mission_mistakes.yaml").read_text(encoding="utf-8"))


def said(tmp_path, text: str) -> str:
    path = tmp_path / "m.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(MissionError) as caught:
        load_mission(str(path))
    return str(caught.value).replace(f"{tmp_path}/", "")


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: repr(mistake["wrong"]))
def test_a_mistake_is_told_of_once_in_words_at_its_place(tmp_path, mistake):
    assert mistake["right"] in GOOD
    told = said(tmp_path, GOOD.replace(mistake["right"], mistake["wrong"], 1))
    assert told == f"m.yaml:{mistake['said']}"


ALLOWED = [
    ("(imu.x, imu.y, 2)", "imu.x, imu.y, 2"),
    ("frame_seen", "0.3 < frame.d < 1 and not cam.blue.seen"),
    ("frame_seen", "memory.home_x"),
    ("frame_seen", "(imu.x + 1) * 2 > -imu.y / 3 or colour != 'blue'"),
    ("frame_seen", "goal_m == (0, 0, 2)"),
    ("frame_seen", "True"),
    ("cmd.rot_z = 0.5", "cmd.rot_z = -1"),
    ("cmd.rot_z = 0.5", "cmd.vel_x = (frame.d - 0.4) / 2"),
    ("cmd.rot_z = 0.5", "memory.home_x = (1, 2, 3)"),
    ("home_x: 0", "home_x: 'red'"),
    ("home_x: 0", "home_x: (0, 0, 2)"),
    ("name: little", "\ufeffname: little"),
    ("colour = 'red'", 'colour = "red"'),
    ("to: search", "to: 'search'"),
]


@pytest.mark.parametrize(("old", "new"), ALLOWED)
def test_what_is_no_mistake_is_let_pass(tmp_path, old, new):
    assert old in GOOD
    path = tmp_path / "m.yaml"
    path.write_text(GOOD.replace(old, new, 1), encoding="utf-8")
    assert load_mission(str(path)).name == "little"


LEGS = dedent("""\
    initial: a
    templates:
      leg:
        initial: go
        states:
          go:
            transitions:
              - when: frame_seen
                to: end
          end:
            final: true
    states:
      a: {use: leg, then: b}
      b: {use: leg, then: c}
      c: {use: leg}
    """)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            "frame_seen",
            "frame_sen",
            "8:19: when 'frame_sen': unknown name 'frame_sen'; did you mean",
        ),
        ("to: end", "to: edn", "9:17: target 'edn' of state 'a.go' is not a state; did you mean 'end'?"),
        ("initial: go", "initial: og", "4:14: 'initial' of state 'a' is 'og'; it has the states go, end"),
        (
            "final: true",
            "exit: [hover]",
            "10:7: none of the states of 'a' has 'final: true', so its 'then' is never reached",
        ),
        ("  leg:\n", "", "3:5: 'initial' stands beside the templates; indent it more"),
        (
            "initial: a",
            "initial: c",
            "13:3: state 'a' is never reached; add a transition to it",
        ),
    ],
)
def test_a_mistake_in_a_template_is_told_of_once_however_often_it_is_used(tmp_path, old, new, expected):
    told = said(tmp_path, LEGS.replace(old, new, 1))
    assert "\n" not in told
    assert told.startswith(f"m.yaml:{expected}")


def test_faults_of_all_kinds_come_at_once(tmp_path):
    text = (
        GOOD.replace("to: search", "to: serch").replace("frame_seen", "frame_sen").replace("- land", "- lnad")
    )
    assert [line.split(":")[1] for line in said(tmp_path, text).splitlines()] == ["15", "22", "28"]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("my_mission", "my_mission"),
        ("My Mission (2)", "my-mission-2"),
        ("..", "mission"),
        ("ÄÖ", "mission"),
        ("a" * 200, "a" * 80),
    ],
)
def test_without_a_name_the_file_s_is_written_as_one(tmp_path, name, expected):
    path = tmp_path / f"{name}.yaml"
    path.write_text(GOOD.replace("name: little\n", ""), encoding="utf-8")
    assert load_mission(str(path)).name == expected


def test_no_name_leads_out_of_a_folder_and_what_is_quoted_cannot_move_the_cursor(tmp_path):
    for name in ("../../../pwnd", "/etc/x", "a/b", "..", "a\\b", ".", "~x", '"a\\0"', "x" * 81):
        told = said(tmp_path, GOOD.replace("little", name))
        assert told.startswith("m.yaml:1:7: name '") or told.startswith("m.yaml:1:8: name '")
    told = said(tmp_path, GOOD.replace("little", '"\\e[31mred\\u202e"'))
    assert told.isprintable()
    assert "\\x1b[31mred\\u202e" in told


def test_of_very_many_mistakes_fifty_are_told(tmp_path):
    lines = said(tmp_path, GOOD.replace("- fly_to_goal\n", "- fly\n" + "      - fly\n" * 79)).splitlines()
    assert len(lines) == 51
    assert lines[-1] == "m.yaml: and 30 more mistakes"


@pytest.mark.parametrize("sign", ["-", "not ", "(", "1+", "frame_seen and "])
def test_an_expression_as_deep_as_may_be_is_checked(tmp_path, sign):
    path = tmp_path / "m.yaml"
    deep = sign * (490 // len(sign))
    path.write_text(GOOD.replace("when: frame_seen", f"when: {deep}"), encoding="utf-8")
    with pytest.raises(MissionError, match=r"/m.yaml:22"):
        load_mission(str(path))


def test_every_name_that_needs_the_map_is_known_to_the_checker():
    pilot = Pilot()
    needed = set()
    for name in {*Vocabulary(Pilot, {}).primitives, *Vocabulary(Pilot, {}).values}:
        try:
            member = getattr(pilot, name)
            if callable(member):
                member()
        except PilotError:
            needed.add(name)
    assert needed == NAMES_ON_MAP


def test_a_contestants_own_action_of_the_same_name_needs_no_map(tmp_path):
    class Own(Pilot):
        def explore(self):
            self.hover()

    path = tmp_path / "m.yaml"
    path.write_text(GOOD.replace("- fly_to_goal", "- explore"), encoding="utf-8")
    assert load_mission(path, Own).vision == "boxes"


def test_a_map_without_surroundings_or_state_is_one_line():
    mission = load_mission("explorer")
    with pytest.raises(MissionRunError, match="mission 'explorer': its map of frames needs the surr"):
        MissionEngine(mission)
    engine = MissionEngine(mission, surroundings=FlightPlan(load_scenario("empty"), mission).surroundings)
    with pytest.raises(MissionRunError, match="its map of frames needs the drone's state; give it to each"):
        engine.tick(Imu(), Detections(), 0)
