"""Mission files: what is refused, and how one is flown.

The mistakes of people who write their first missions are in `test_mission_mistakes.py`.
"""

from __future__ import annotations

from math import hypot
from pathlib import Path
from textwrap import dedent

import pytest

from framerunner.flying.plan import FlightPlan
from framerunner.geometry.gate_shape import GateShape
from offboard.authoring import Document, export_scxml, import_scxml
from offboard.drone import VelocityFluCommand
from offboard.engine import MissionEngine, MissionRunError
from offboard.limits import CONTEST, CommandLimits
from offboard.mission import MissionError, list_missions, load_mission, mermaid
from offboard.pilot import Imu, Pilot
from scenarios.models import Gate, Scenario
from vision.types import Detections

MINIMAL = dedent("""\
    name: little
    initial: up
    variables: {count: 0, word: 'x'}
    states:
      up:
        enter:
          - hover
        during:
          - fly_to_goal
        transitions:
          - when: seconds_in_state > 1
            to: done
      done:
        enter:
          - motors_off
        final: true
    """)


def load(tmp_path: Path, text: str, pilot_class=Pilot):
    path = tmp_path / "m.yaml"
    path.write_text(text, encoding="utf-8")
    return load_mission(str(path), pilot_class)


def problems(tmp_path: Path, text: str) -> str:
    with pytest.raises(MissionError) as caught:
        load(tmp_path, text)
    said = str(caught.value)
    assert all(line.startswith(f"{tmp_path}/m.yaml") for line in said.splitlines())  # as it was named
    return said.replace(f"{tmp_path}/", "")


def test_the_package_has_its_missions():
    assert {"careful_crossing", "frame_challenge", "soft_landing"} <= set(list_missions())
    for name in list_missions():
        assert load_mission(name).description


def test_class_and_vision_are_inherited_and_have_defaults(tmp_path):
    plain = load(tmp_path, MINIMAL)
    assert (plain.mission_class, plain.vision) == ("contest", "boxes")
    (tmp_path / "base.yaml").write_text(f"class: open\nvision: frames\n{MINIMAL}", encoding="utf-8")
    inherited = load(tmp_path, "extends: base.yaml\n")
    assert (inherited.mission_class, inherited.vision) == ("open", "frames")
    replaced = load(tmp_path, "extends: base.yaml\nclass: contest\n")
    assert (replaced.mission_class, replaced.vision) == ("contest", "frames")


def test_the_scenario_tells_the_shape_of_its_gates_and_the_mission_that_of_others(tmp_path):
    text = "gate: {outer_width_m: 0.8, outer_height_m: 0.5, bar_m: 0.03}\n"
    (tmp_path / "base.yaml").write_text(f"{text}{MINIMAL}", encoding="utf-8")
    mission = load(tmp_path, "extends: base.yaml\n")
    assert mission.gate == GateShape(0.8, 0.5, 0.03, 0.03)
    assert Document.from_text(import_scxml(export_scxml(mission.spec).encode())).chart.gate == mission.gate
    red = Gate(colour="red", x_m=0, y_m=0, z_m=1, outer_width_m=1.2)
    shapes = FlightPlan(Scenario(name="one", frames=(red,)), mission).surroundings.shapes
    assert (shapes.of("red"), shapes.of("green")) == (red.shape, mission.gate)
    assert load(tmp_path, MINIMAL).gate is None


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("class: Contets", "m.yaml:1:8: unknown class 'Contets'; did you mean 'contest'?"),
        ("class: 7", "m.yaml:1:8: unknown class '7'; it is contest or open"),
        ("class:", "m.yaml:1:7: unknown class ''; it is contest or open"),
        ("vision: box", "m.yaml:1:9: unknown vision 'box'; did you mean 'boxes'?"),
        ("vision: [frames]", "m.yaml:1:1: 'vision' must be one line of text"),
        ("gate: 0.42", "m.yaml:1:1: 'gate' needs names below it, such as '  outer_width_m: 0.42'"),
        (
            "gate: {outer_width_m: wide}",
            "m.yaml:1:23: outer_width_m of 'gate' is 'wide'; write metres, from 0.01 to 10",
        ),
        (
            "gate: {bar_m: 0.2}",
            "m.yaml:1:15: bar_m 0.2 of 'gate' leaves no opening; make it thinner or the frame larger",
        ),
        (
            "gate: {outer_with_m: 0.5}",
            "m.yaml:1:8: a mission's 'gate' has no 'outer_with_m'; did you mean 'outer_width_m'?",
        ),
    ],
)
def test_an_unknown_class_or_vision_is_one_problem(tmp_path, line, expected):
    assert problems(tmp_path, f"{line}\n{MINIMAL}") == expected


def test_numbers_in_the_file_are_limited_in_the_class_contest_only(tmp_path):
    fast = MINIMAL.replace("- hover", "- cmd.vel_x = 1.5")
    assert "at most 1 m/s" in problems(tmp_path, fast)
    assert load(tmp_path, f"class: open\n{fast}").mission_class == "open"


def test_a_mission_flies_within_the_limits_of_its_class_and_can_read_them(tmp_path):
    text = MINIMAL.replace(
        "- hover", "- cmd.vel_x = 3 * limits.forward_m_s\n      - cmd.vel_y = -9\n      - cmd.vel_z = -9"
    )
    mission = load(tmp_path, "class: open\n" + text.replace("- fly_to_goal", "- cmd.rot_z = 9"))
    limits = CommandLimits(2.0, 1.5, 1.4, 0.7, 1.2, level_m_s=2.0)
    engine = MissionEngine(mission, limits=limits)
    assert engine.pilot.limits is limits
    engine.tick(Imu(), Detections(), 0)
    sent = limits.limited(engine.tick(Imu(), Detections(), 50_000))
    assert hypot(sent.forward_m_s, sent.left_m_s) == pytest.approx(2.0)
    assert sent.left_m_s / sent.forward_m_s == pytest.approx(-1.5 / 2.0)
    assert (sent.up_m_s, sent.yaw_rate_rad_s) == (-0.7, 1.2)
    contest = MissionEngine(mission)
    contest.tick(Imu(), Detections(), 0)
    assert CONTEST.limited(contest.tick(Imu(), Detections(), 50_000)) == VelocityFluCommand(
        1.0, -1.0, -1.0, 1.0
    )


def test_the_minimal_mission_is_fine(tmp_path):
    assert load(tmp_path, MINIMAL).finishes == {"done"}


GUARD = "seconds_in_state > 1"
BAD_GUARDS = [
    (
        "cam.red.q < 1",
        "m.yaml:11:15: when 'cam.red.q < 1': 'cam.red' has no 'q'; it has n s e w d a signed_a seen",
    ),
    ("cam.rde.d < 1", "'cam' has no 'rde'; did you mean 'cam.red'?"),
    ("secondsinstate > 4", "unknown name 'secondsinstate'; did you mean 'seconds_in_state'?"),
    ("hover", "'hover' is an action, not a value"),
    ("memory.speed > 1", "no variable 'speed'; declared under 'variables': count word"),
    ("imu.x.real > 1", "'imu.x' has no 'real'; it is a plain value"),
    ("cam.red.__class__ == 1", "'cam.red' has no '__class__'"),
    ("__import__('os')", "calls are not possible"),
    ("(lambda:1)", "Lambda is not possible"),
    ("goal_m[0] > 1", "[...] is not possible"),
    ("9 ** 9 ** 9 > 1", "** is not possible"),
    ("1 + 'a'.upper == 1", "must follow a name"),
]


@pytest.mark.parametrize(("guard", "message"), BAD_GUARDS)
def test_a_bad_guard_is_refused_at_its_line(tmp_path, guard, message):
    said = problems(tmp_path, MINIMAL.replace(GUARD, guard))
    assert message in said
    assert said.startswith("m.yaml:11:")
    assert f": when '{guard}': " in said
    assert said.count("\n") == 0


BAD_ACTIONS = [
    ("hoover", "m.yaml:7:9: unknown action 'hoover'; did you mean 'hover'?"),
    ("imu", "'imu' is a value, not an action"),
    ("cmd = 1", "'cmd' cannot be set as a whole; set cmd.on cmd.vel_x"),
    ("hover = 1", "'hover' is an action"),
    ("cmd.vel_x = open", "unknown name 'open'"),
    ("cmd.__class__ = 1", "has no '__class__'"),
]


@pytest.mark.parametrize(("action", "message"), BAD_ACTIONS)
def test_a_bad_action_is_refused_at_its_line(tmp_path, action, message):
    said = problems(tmp_path, MINIMAL.replace("- hover", f"- {action}"))
    assert message in said
    assert said.startswith("m.yaml:7:")


BAD_CHARTS = [
    ("initial: up\n", "", "has no 'initial'; name the state it starts in, such as 'up'"),
    (
        "initial: up",
        "initial: landing",
        "m.yaml:2:10: 'initial' of the mission is 'landing'; it has the states up, done",
    ),
    ("  done:\n", "  up:\n", "m.yaml:13:3: 'up' is written twice (first in line 5); rename one"),
    ("transitions:", "transition:", "state 'up' has no 'transition'; did you mean 'transitions'?"),
    ("name: little", "nam: little", "a mission has no 'nam'; did you mean 'name'?"),
    ("final: true", "final: maybe", "'final' is true or false, not 'maybe'"),
    ("  - hover", "  hover", "m.yaml"),
    ("states:", "states: {a: &x 1, b: *x}\nrest:", "alias '*x' is not allowed"),
    ("{count: 0,", "{count: open(),", "variable 'count' needs a number"),
    ("    during:", "    use: circle\n    during:", "unknown template 'circle'"),
    ("    during:", "    then: done\n    during:", "has 'then' or 'initial' but no states of its own"),
    (
        "    during:",
        "    resume: upp\n    during:",
        "m.yaml:8:13: 'resume' 'upp' of state 'up' is not a state; did you mean 'up'?",
    ),
    ("    during:", "    resume:\n    during:", "m.yaml:8:5: 'resume' is empty; name the state to go on in"),
    ("    during:", "    resume: [up]\n    during:", "m.yaml:8:5: 'resume' must be one line of text"),
    (
        "    final: true",
        "    final: true\n    resume: up",
        "m.yaml:17:13: state 'done' is final; there is nothing to continue, remove 'resume'",
    ),
    ("        to: done", "        to: done\n        resume: up", "a transition has no 'resume'"),
    ("name: little", "resume: up", "a mission has no 'resume'"),
    ("  done:", "  alone: {resume: alone}\n  done:", "state 'alone' is never reached"),
    ("        to: done", "        to: up\n    resume: done", "m.yaml:5:3: state 'up' has no way out"),
    ("  done:", "  alone:\n    transitions:\n      - to: done\n  done:", "state 'alone' is never reached"),
    ("name: little", "name: [little", "YAML syntax"),
    (
        "name: little",
        "name: !!python/object:os.system little\nextends: none_such",
        "unknown mission 'none_such'",
    ),
]


@pytest.mark.parametrize(("old", "new", "message"), BAD_CHARTS)
def test_a_bad_chart_is_refused(tmp_path, old, new, message):
    assert old in MINIMAL
    assert message in problems(tmp_path, MINIMAL.replace(old, new, 1))


@pytest.mark.parametrize("text", ["", "- a\n- b\n", "just words", "{}", "a: " + "[" * 5000, "\0"])
def test_what_is_no_mission_is_refused(tmp_path, text):
    assert "m.yaml" in problems(tmp_path, text)


def test_a_huge_file_is_refused(tmp_path):
    assert "larger than 1 MB" in problems(tmp_path, MINIMAL + "#" * 1_000_001)


def test_unknown_name_and_missing_file():
    with pytest.raises(MissionError, match="did you mean 'frame_challenge'"):
        load_mission("frame_chalenge")
    with pytest.raises(MissionError, match="does not exist"):
        load_mission("no/such/file.yaml")
    with pytest.raises(MissionError, match="'/dev/zero' is not a regular file"):
        load_mission("/dev/zero")


def test_a_link_to_itself_is_no_mission(tmp_path):
    path = tmp_path / "loop.yaml"
    path.symlink_to(path)
    with pytest.raises(MissionError, match="does not exist"):
        load_mission(str(path))


def test_a_mission_cannot_extend_itself(tmp_path):
    assert "circle" in problems(tmp_path, "name: a\nextends: m.yaml\n")


@pytest.mark.parametrize("name", ["../base.yaml", "{folder}/base.yaml", "link.yaml"])
def test_a_mission_reads_no_file_outside_its_folder(tmp_path, name):
    (tmp_path / "base.yaml").write_text(MINIMAL)
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "link.yaml").symlink_to(tmp_path / "base.yaml")
    path = inner / "mine.yaml"
    path.write_text(f"name: mine\nextends: {name.format(folder=tmp_path)}\n")
    with pytest.raises(MissionError, match="is in another folder"):
        load_mission(path)
    (inner / "base.yaml").write_text(MINIMAL)
    path.write_text("name: mine\nextends: base.yaml\n")
    assert load_mission(path).name == "mine"


def test_a_template_used_twice_keeps_names_apart(tmp_path):
    text = dedent("""\
        initial: a
        templates:
          leg:
            initial: go
            states:
              go:
                transitions:
                  - to: end
              end:
                final: true
        states:
          a: {use: leg, then: b}
          b: {use: leg}
        """)
    mission = load(tmp_path, text)
    assert set(mission.leaves) == {"a.go", "a.end", "b.go", "b.end"}
    assert mission.finishes == {"b.end"}
    engine = MissionEngine(mission)
    states = []
    for tick in range(4):
        engine.tick(Imu(), Detections(), tick * 50_000)
        states.append(engine.state)
    assert states == ["a.go", "b.go", "b.end", "b.end"]


def test_a_superstate_s_transitions_come_after_those_of_its_states(tmp_path):
    text = dedent("""\
        initial: out
        states:
          out:
            initial: a
            transitions:
              - when: seconds_in_state > 1
                to: late
            states:
              a:
                during:
                  - fly_to_goal
                transitions:
                  - when: imu.x > 0
                    to: b
              b: {}
          late:
            final: true
        """)
    mission = load(tmp_path, text)
    for x, expected in ((1.0, "out.b"), (0.0, "late")):
        engine = MissionEngine(mission)
        engine.tick(Imu(), Detections(), 0)
        engine.tick(Imu(x=x), Detections(), 2_000_000)
        assert engine.state == expected


def test_actions_are_done_in_the_order_written(tmp_path):
    text = MINIMAL.replace(
        "      - hover\n", "      - cmd.rot_z = 0.5\n      - hover\n      - cmd.vel_z = 0.25\n"
    )
    command = MissionEngine(load(tmp_path, text)).tick(Imu(), Detections(), 0)
    assert (command.yaw_rate_rad_s, command.up_m_s) == (0.0, 0.25)


class Counting(Pilot):
    """A contestant's pilot that counts."""

    counted = 0

    def count(self) -> None:
        """One more."""
        self.counted += 1


def test_an_action_that_is_written_twice_is_done_twice(tmp_path):
    engine = MissionEngine(load(tmp_path, MINIMAL.replace("- hover\n", "- count\n      - count\n"), Counting))
    engine.tick(Imu(), Detections(), 0)
    assert engine.pilot.counted == 2


class Acrobat(Pilot):
    """A contestant's pilot with a primitive of its own."""

    def spin(self) -> None:
        """Turn as fast as allowed."""
        self.cmd.rot_z = 9.0

    def fail(self) -> None:
        """Always breaks."""
        raise ZeroDivisionError("no spin")


def test_a_subclass_adds_primitives(tmp_path):
    engine = MissionEngine(load(tmp_path, MINIMAL.replace("- hover", "- spin"), Acrobat))
    assert CONTEST.limited(engine.tick(Imu(), Detections(), 0)).yaw_rate_rad_s == 1.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("- hover", "- fail", "ZeroDivisionError: no spin"),
        ("- fly_to_goal", "- fail", "state 'up': ZeroDivisionError: no spin"),
        ("- fly_to_goal", "- cmd.vel_x = 1 / memory.count", "ZeroDivisionError"),
        (GUARD, "1 / memory.count > 1", "state 'up': ZeroDivisionError"),
        (GUARD, "memory.word < 1", "state 'up': TypeError"),
        ("- fly_to_goal", "- memory.word = memory.word + memory.word", "TypeError: 'x' is no number"),
        ("- fly_to_goal", "- memory.word = (memory.word, 1, 2)", "TypeError: 'x' is no number"),
        ("- fly_to_goal", "- cmd.vel_x = frame.d - frame.d", "cmd.vel_x is not a number"),
    ],
)
def test_an_error_while_flying_is_raised_with_the_state(tmp_path, old, new, message):
    engine = MissionEngine(load(tmp_path, MINIMAL.replace(old, new), Acrobat))

    def fly():
        for tick in range(3):
            engine.tick(Imu(), Detections(), tick * 50_000)

    with pytest.raises(MissionRunError, match=message):
        fly()


RESUMING = dedent("""\
    initial: out
    templates:
      leg:
        initial: a
        resume: b
        states:
          a:
            transitions:
              - when: seconds_in_state > 1
                to: c
              - when: imu.x > 5
                to: b
          b:
            enter:
              - cmd.vel_y = 0.25
            transitions:
              - when: seconds_in_state > 1
                to: c
          c:
            resume: home
            transitions:
              - when: seconds_in_state > 1
                to: end
          end:
            final: true
    states:
      out:
        use: leg
        then: back
        enter:
          - cmd.vel_x = 0.5
      back:
        use: leg
        resume: a
        enter:
          - cmd.vel_x = cmd.vel_x + 0.125
        then: home
      home:
        final: true
    """)


@pytest.mark.parametrize(
    ("state", "expected", "command"),
    [
        ("out.a", "out.b", (0.0, 0.25)),  # the template's, and `out` is not entered again
        ("out.c", "home", (0.0, 0.0)),  # its own goes before, and may lead outside
        ("back.a", "back.a", (0.0, 0.0)),  # who uses a template may choose otherwise
    ],
)
def test_after_a_pause_a_mission_goes_on_where_it_says(tmp_path, state, expected, command):
    engine = MissionEngine(load(tmp_path, RESUMING))
    time_us = 0
    while engine.state != state:
        engine.tick(Imu(), Detections(), time_us)
        time_us += 1_100_000
    engine.pause(time_us)
    engine.pause(time_us + 1_000_000)
    assert engine.state == state
    flown = engine.tick(Imu(), Detections(), time_us + 5_000_000)
    assert engine.state == expected
    assert (flown.forward_m_s, flown.left_m_s) == command
    taken = engine.transition
    assert (taken.source, taken.target, taken.when, taken.values) == (state, expected, "resume", ())
    assert taken.seconds_in_source == pytest.approx(1.1)
    engine.tick(Imu(), Detections(), time_us + 5_050_000)
    assert engine.transition is None
    assert engine.pilot.seconds_in_state == pytest.approx(0.0 if expected == "home" else 0.05)


def test_a_superstate_may_be_begun_anew_after_a_pause(tmp_path):
    engine = MissionEngine(load(tmp_path, RESUMING.replace("resume: a", "resume: back")))
    time_us = 0
    while engine.state != "back.a":
        forward_m_s = engine.tick(Imu(), Detections(), time_us).forward_m_s
        time_us += 1_100_000
    assert forward_m_s == 0.625
    engine.pause(time_us)
    assert engine.tick(Imu(), Detections(), time_us).forward_m_s == 0.125  # from a stand, entered again
    assert engine.state == "back.a"


def test_a_pause_before_the_first_tick_is_none(tmp_path):
    engine = MissionEngine(load(tmp_path, RESUMING))
    engine.pause(1_000_000)
    engine.tick(Imu(), Detections(), 2_000_000)
    assert (engine.state, engine.transition) == ("out.a", None)


def test_the_diagram_tells_where_a_mission_goes_on_after_a_pause(tmp_path):
    drawn = mermaid(load(tmp_path, RESUMING))
    assert "        [*] --> out.a\n        [*] --> out.b : after a pause\n" in drawn
    assert "        out.c --> home : after a pause\n" in drawn
    assert "        [*] --> back.a : also after a pause\n" in drawn
    assert drawn.count("after a pause") == 4
    assert "    back --> back : after a pause\n" in mermaid(
        load(tmp_path, RESUMING.replace("resume: a", "resume: back"))
    )


def test_the_diagram_shows_every_state_and_transition_with_priority():
    mission = load_mission("frame_challenge")
    drawn = mermaid(mission, "red.turning")
    assert drawn.startswith("stateDiagram-v2\n    [*] --> take_off\n")
    for leaf_id, leaf in mission.leaves.items():
        assert f" as {leaf_id}\n" in drawn
        for transition in leaf.state.transitions:
            assert f"{leaf_id} --> {transition.to}" in drawn
    assert "red.go_to_center --> red.turning : 2 [distance_to_goal_m < 0.2]" in drawn
    assert "class red.turning active" in drawn
    assert "red --> green" in drawn
