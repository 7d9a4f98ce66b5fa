"""SCXML: what is exported means the same when it is imported; what a mission cannot express is refused."""

from __future__ import annotations

from dataclasses import replace
from random import Random
from time import process_time
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given

from framerunner.cli import run
from offboard.authoring import Document, XmlError, export_scxml, import_scxml
from offboard.chart.spec import all_states, leaves
from offboard.mission import list_missions, load_mission
from tests.offboard.authoring.random_missions import random_mission
from tests.offboard.authoring.test_documents import CAREFUL, SEEDS

HEAD = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="Foreign Chart"'


def flown(chart):
    """What a chart does, wherever it is written; SCXML has the transitions of superstates at each state."""
    inner = {
        leaf.state.id: (
            [(each.when, each.to, each.actions) for each in leaf.transitions],
            leaf.during,
            leaf.resume and leaf.resume.to,
        )
        for leaf in leaves(chart.states)
    }
    shape = [(s.id, s.initial, s.final, s.then, s.enter, s.exit) for s in all_states(chart.states)]
    return chart.name, chart.initial, shape, inner


@pytest.mark.parametrize("name", list_missions())
def test_a_shipped_mission_means_the_same_after_export_and_import(tmp_path, name):
    mission = load_mission(name)
    path = tmp_path / "imported.yaml"
    path.write_text(import_scxml(export_scxml(mission.spec).encode()), encoding="utf-8")
    again = load_mission(path)
    assert flown(again.spec) == flown(mission.spec)
    assert again.spec.variables == mission.spec.variables
    assert (again.name, again.description, again.rules) == (mission.name, mission.description, mission.rules)


@CAREFUL
@given(SEEDS)
def test_a_generated_mission_means_the_same_after_export_and_import(seed):
    chart = Document.from_text(random_mission(Random(seed))).chart
    refused = ""
    try:
        again = Document.from_text(import_scxml(export_scxml(chart).encode())).chart
    except XmlError as error:  # a superstate's target whose name is one of a state within it, too
        refused = str(error)
    if refused:
        assert all("cannot be named" in line for line in refused.split("\n"))
        return
    states = tuple(replace(state, exit=() if state.final else state.exit) for state in chart.states)
    assert flown(again) == flown(replace(chart, states=states))


def test_the_export_is_scxml():
    root = ET.fromstring(export_scxml(load_mission("frame_challenge").spec))
    assert root.tag == "{http://www.w3.org/2005/07/scxml}scxml"
    ids = [each.get("id") for each in root.iter() if each.get("id")]
    assert len(ids) == len(set(ids))
    assert {each.get("target") for each in root.iter() if each.get("target")} <= set(ids)


def test_a_chart_of_another_editor_is_imported():
    data = (
        HEAD
        + """ initial="Up" datamodel="ecmascript" xmlns:qt="http://www.qt.io/2015/02/scxml-ext">
      <qt:editorinfo initialGeometry="1;2;3;4"/>
      <datamodel><data id="count" expr="1"/></datamodel>
      <state id="Up" qt:place="9">
        <onentry><script>hover(); cmd.vel_z = 0.5</script></onentry>
        <transition event="tick" target="Go-On"
                    cond="imu.z &gt; 1 &amp;&amp; !frame_seen || colour != 'a &amp;&amp; b'">
          <assign location="memory.count" expr="memory.count + 1"/>
        </transition>
        <transition event="tick"><script>fly_to_goal()</script></transition>
      </state>
      <state id="Go-On">
        <initial><transition target="B"/></initial>
        <transition event="done.state.Go-On" target="End"/>
        <final id="A"/>
        <state id="B"><transition event="tick" target="A"/></state>
      </state>
      <final id="End"><onentry><script>land()</script></onentry></final>
    </scxml>"""
    )
    assert (
        import_scxml(data.encode())
        == """\
name: foreign-chart
initial: up
variables:
  count: 1

states:
  up:
    enter:
      - hover
      - cmd.vel_z = 0.5
    during:
      - fly_to_goal
    transitions:
      - when: imu.z > 1 and not frame_seen or colour != 'a && b'
        to: go_on
        do:
          - memory.count = memory.count + 1

  go_on:
    initial: b
    states:
      a:
        final: true
      b:
        transitions:
          - to: a
    then: end

  end:
    enter:
      - land
    final: true
"""
    )


REFUSED = [
    ("<parallel id='p'/>", "line 2: <parallel> in <scxml> cannot be expressed"),
    ("<script>x = 1</script>", "line 2: <script> in <scxml>"),
    ("<state id='a'><history id='h'/></state>", "<history> in <state>"),
    ("<state id='a'><invoke type='x'/></state>", "<invoke> in <state>"),
    ("<state id='a'><onentry><send event='x'/></onentry></state>", "<send> in <onentry>"),
    ("<state id='a'><onentry><if cond='x'/></onentry></state>", "<if> in <onentry>"),
    ("<state id='a'><onentry><script>while (1) {}</script></onentry></state>", "no primitive"),
    ("<state id='a'><transition event='go' target='a'/></state>", 'event "go" cannot be expressed'),
    ("<state id='a'><transition target='a'/></state>", 'event "" cannot be expressed'),
    ("<state id='a'><transition event='tick' target='b'/></state>", "there is no state 'b'"),
    ("<state id='a'><transition event='tick' target='a a'/></state>", "several targets"),
    ("<state id='a'><transition event='tick' cond='x'/></state>", "has no condition"),
    ("<state id='a'><transition event='tick'/><transition event='tick' target='a'/></state>", "hides it"),
    ("<state id='a'/><state id='a'/>", "the id 'a' is there twice"),
    ("<state id='a' src='x'/>", "'src' of <state>"),
    ("<datamodel><data id='x' src='file:///etc/passwd'/></datamodel><state id='a'/>", "'src' of <data>"),
    ("<datamodel><data id='x' expr='open()'/></datamodel><state id='a'/>", "is no number"),
    ("<xi:include xmlns:xi='http://www.w3.org/2001/XInclude' href='/etc/passwd'/>", "<include> in <scxml>"),
    (
        "<state id='a'><transition event='tick' target='a'/>"
        "<state id='b'><transition event='tick'/></state></state>",
        "hides those of <state> 'a'",
    ),
    ("", "there is no <state>"),
    (
        "<state id='a'><transition event='tick' cond=\"In('a') &amp;&amp; true\" target='a'/></state>",
        "line 2: 'In('a') and True': calls are not possible",
    ),
    ("<state id='a'><onentry><script>goal_m = f(1)</script></onentry></state>", "calls are not possible"),
    ("<state id='a'><onentry><assign location='goal_m' expr='x[0]'/></onentry></state>", "line 2: 'x[0]': "),
]


@pytest.mark.parametrize(("inside", "reason"), REFUSED)
def test_what_a_mission_cannot_express_is_refused_with_its_line(inside, reason):
    with pytest.raises(XmlError) as caught:
        import_scxml(f"{HEAD}>\n{inside}\n</scxml>".encode())
    assert reason in str(caught.value)
    assert all(line.startswith("line ") for line in str(caught.value).split("\n"))


ENTITIES = "".join(f'<!ENTITY e{n} "{f"&e{n - 1};" * 10}">' for n in range(1, 10))
BOMBS = [
    f'<!DOCTYPE scxml [<!ENTITY e0 "x">{ENTITIES}]>{HEAD}>&e9;</scxml>',
    f'<!DOCTYPE scxml [<!ENTITY e SYSTEM "file:///etc/passwd">]>{HEAD}>&e;</scxml>',
    f'<!DOCTYPE scxml SYSTEM "http://127.0.0.1:9/x.dtd">{HEAD}/>',
    HEAD + ">" + "<state>" * 100_000,
    HEAD + ">" + "<state/>" * 100_000 + "</scxml>",
    "<a>" + "x" * 1_000_000 + "</a>",
    HEAD + ' x="' + "y" * 900_000 + '">',
    HEAD + "><state id='a'><onentry><script>x" + " " * 900_000 + "y</script></onentry></state></scxml>",
    HEAD + f"><state id='a'><transition event='tick' cond='{' ' * 900_000}&lt;' target='b'/></state></scxml>",
    HEAD + ">" + ("x" * 40 + "<state/>") * 19_000 + "</scxml>",
    "not XML",
    "",
    '<?xml version="1.0" encoding="none"?><a/>',
    "<html/>",
]


@pytest.mark.parametrize("text", BOMBS, ids=range(len(BOMBS)))
def test_hostile_xml_is_refused_soon(text):
    started_s = process_time()
    with pytest.raises(XmlError):
        import_scxml(text.encode())
    assert process_time() - started_s < 3


def test_the_commands(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(["mission", "export", "explorer", "--out", "e.scxml"]) == 0
    assert run(["mission", "import", "e.scxml", "--out", "e.yaml"]) == 0
    assert run(["mission", "check", "e.yaml"]) == 0
    said = capsys.readouterr()
    assert "e.yaml: good, mission 'explorer' with 15 states" in said.out
    assert "e.yaml:28:7: advice: state 'red.search' waits" in said.out
    assert run(["mission", "export", "explorer", "--format", "mermaid"]) == 0
    assert capsys.readouterr().out.startswith("stateDiagram-v2\n")
    assert run(["mission", "import", "e.scxml", "--out", "e.yaml"]) == 2
    assert "is there already" in capsys.readouterr().err
    assert run(["mission", "import", "none.scxml"]) == 2


def test_nothing_is_written_of_what_the_checker_refuses(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    action = "<onentry><script>hoover()</script></onentry>"
    (tmp_path / "e.scxml").write_text(f"{HEAD}><state id='a'>{action}</state></scxml>")
    assert run(["mission", "import", "e.scxml", "--out", "e.yaml"]) == 2
    assert run(["mission", "import", "e.scxml"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "unknown action 'hoover'; did you mean 'hover'?" in said.err
    assert "e.scxml: nothing was written; correct it there, or give --pilot" in said.err
    assert not (tmp_path / "e.yaml").exists()
