"""The diagram, its side file, and the catalogue of names."""

from __future__ import annotations

import json
from dataclasses import dataclass
from random import Random
from typing import Annotated, Literal

import pytest
from pydantic import Field

from offboard.authoring import (
    DiagramLayout,
    Document,
    EditError,
    EditSession,
    LayoutError,
    StateBox,
    apply,
    as_json,
    catalogue,
    catalogue_of,
    diagram,
    follow,
    layout_path,
    parse_edit,
    parse_layout,
    read_layout,
    write_layout,
)
from offboard.mission import MISSIONS, list_missions, load_mission
from offboard.pilot import Pilot
from tests.offboard.authoring.random_missions import random_mission


def opened(name: str) -> Document:
    return Document.open(MISSIONS / f"{name}.yaml")


@pytest.mark.parametrize("name", list_missions())
def test_the_diagram_shows_what_is_flown(name):
    mission, drawn = load_mission(name), diagram(opened(name))
    nodes = {node.id: node for node in drawn.nodes}
    assert {each for each, node in nodes.items() if not node.initial} == set(mission.leaves)
    assert {each for each, node in nodes.items() if node.finish} == mission.finishes
    for leaf_id, leaf in mission.leaves.items():
        own = [edge for edge in drawn.edges if edge.source == leaf_id and edge.event == "tick"]
        assert [(edge.order, edge.when, edge.target) for edge in own] == [
            (number, each.when, each.to) for number, each in enumerate(leaf.state.transitions)
        ]
    assert len({edge.id for edge in drawn.edges}) == len(drawn.edges)
    json.dumps(as_json(drawn))


def test_nodes_and_edges_know_where_they_are_written():
    document = opened("frame_challenge")
    drawn = diagram(document)
    nodes = {node.id: node for node in drawn.nodes}
    turning = nodes["green.turning"]
    assert (turning.source, turning.parent) == ("@cross_frame.turning", "green")
    assert document.text[turning.name_span.start : turning.name_span.end] == "turning"
    assert document.text[turning.span.start : turning.span.end].endswith("to: frame_visible")
    assert (nodes["green"].template, nodes["green"].parameters) == ("cross_frame", (("colour", "'green'"),))
    edges = {edge.id: edge for edge in drawn.edges}
    edge = edges["green.shift_left/tick/1"]
    assert (edge.source_state, edge.source_index) == ("@cross_frame.shift_left", 1)
    assert document.text[edge.when_span.start : edge.when_span.end] == "frame.a > memory.alpha0"
    assert document.text[edge.to_span.start : edge.to_span.end] == "shift_right"
    assert edges["red/done/0"].target == "green"
    assert edges["red/resume/0"].target == "red.go_to_center"


def test_a_diagram_has_the_settings_and_variables():
    drawn = diagram(opened("frame_challenge"))
    assert drawn.settings["name"] == "frame_challenge"
    assert drawn.variables == {"x0": "0", "y0": "0", "alpha0": "0"}
    assert drawn.templates["cross_frame"][:2] == ("@cross_frame", "@cross_frame.go_to_center")


def test_states_of_another_file_cannot_be_edited_here():
    nodes = {node.id: node for node in diagram(opened("soft_landing")).nodes}
    assert (nodes["red.turning"].source, nodes["red.turning"].span) == ("", None)
    assert nodes["landing.touch_down"].source == "landing.touch_down"


@pytest.mark.parametrize("seed", range(20))
def test_every_edge_can_be_edited_by_its_source(seed):
    session = EditSession(Document.from_text(random_mission(Random(seed))))
    for edge in diagram(session.document).edges:
        transition = {"state": edge.source_state, "event": edge.event, "index": edge.source_index}
        session.apply(parse_edit({"kind": "delete_transition", "transition": transition}))
        session.undo()


def test_positions_are_beside_the_mission_and_follow_it(tmp_path):
    path = tmp_path / "mission.yaml"
    document = opened("frame_challenge")
    path.write_bytes(document.data)
    assert read_layout(path) == DiagramLayout()
    boxes = {node.id: StateBox(x=10.0 * number, y=5.5) for number, node in enumerate(diagram(document).nodes)}
    layout = DiagramLayout(states=boxes, corners={"red.turning/tick/0": ((1, 2), (3, 4))})
    assert write_layout(path, layout) == layout_path(path) == tmp_path / "mission.layout.json"
    assert read_layout(path) == layout
    assert path.read_bytes() == document.data
    later = layout_path(path).read_text().replace('"version": 1', '"version": 2')
    layout_path(path).write_text(later)
    with pytest.raises(LayoutError, match="version: "):
        write_layout(path, DiagramLayout())
    assert layout_path(path).read_text() == later
    layout_path(path).unlink()
    write_layout(path, layout)
    assert len(layout_path(path).read_text().splitlines()) == len(boxes) + 8

    rename = parse_edit({"kind": "rename_state", "state": "@cross_frame.turning", "name": "rotating"})
    followed = follow(layout, document, rename, apply(document, rename).document)
    assert followed.states["blue.rotating"] == boxes["blue.turning"]
    assert "blue.turning" not in followed.states
    assert list(followed.corners) == ["red.rotating/tick/0"]

    move = parse_edit({"kind": "move_state", "state": "landing", "parent": "take_off"})
    followed = follow(layout, document, move, apply(document, move).document)
    assert followed.states["take_off.landing.stop"] == boxes["landing.stop"]

    delete = parse_edit({"kind": "delete_state", "state": "landing"})
    followed = follow(layout, document, delete, apply(document, delete).document)
    assert set(boxes) - set(followed.states) == {"landing", "landing.go_to_base", "landing.stop"}


def test_places_come_back_with_what_is_undone():
    document = opened("frame_challenge")
    boxes = {node.id: StateBox(x=10.0 * number, y=0) for number, node in enumerate(diagram(document).nodes)}
    session = EditSession(document, DiagramLayout(states=boxes))
    session.apply(parse_edit({"kind": "rename_state", "state": "landing", "name": "home"}))
    session.apply(parse_edit({"kind": "delete_state", "state": "home"}))
    assert "home" not in session.layout.states
    session.undo()
    assert session.layout.states["home.stop"] == boxes["landing.stop"]
    session.undo()
    assert session.layout.states == boxes
    session.redo()
    assert session.layout.states["home.stop"] == boxes["landing.stop"]


def test_moves_of_boxes_are_undone_in_their_order_with_edits():
    session = EditSession(opened("frame_challenge"))
    text = session.document.text
    session.settle({"red": StateBox(x=0, y=0), "blue": StateBox(x=9, y=9)})
    assert not session.can_undo
    session.place({"red": StateBox(x=1, y=1)})
    session.apply(parse_edit({"kind": "rename_state", "state": "landing", "name": "home"}))
    session.settle({"home": StateBox(x=3, y=3), "blue": StateBox(x=10, y=9)})
    session.place({"red": StateBox(x=2, y=2)})
    places = []
    while session.can_undo:
        changes = session.undo()
        places.append((bool(changes), {name: box.x for name, box in session.layout.states.items()}))
    assert places == [
        (False, {"red": 1, "blue": 10, "home": 3}),
        (True, {"red": 1, "blue": 9}),
        (False, {"red": 0, "blue": 9}),
    ]
    assert session.document.text == text
    while session.can_redo:
        session.redo()
    assert {name: box.x for name, box in session.layout.states.items()} == {"red": 2, "blue": 10, "home": 3}
    assert "home" in session.document.text


def test_a_transition_to_no_state_is_there_and_says_so():
    document = Document.from_text(
        "name: x\ninitial: a\nstates:\n  a:\n    transitions:\n      - to: gone\n      - to: a\n"
    )
    drawn = diagram(document)
    assert [(edge.id, edge.target, edge.missing) for edge in drawn.edges] == [
        ("a/tick/0", "gone", True),
        ("a/tick/1", "a", False),
    ]


def test_a_transition_is_given_to_another_state_with_all_it_has():
    text = (
        "name: x\ninitial: a\nstates:\n  a:\n    transitions:\n      - when: imu.z > 1\n        to: b\n"
        "        do: [hover]\n  b:  # kept\n    enter: [hover]\n  c:\n    final: true\n"
    )
    session = EditSession(Document.from_text(text))
    edit = {"kind": "set_source", "transition": {"state": "a"}, "to": "b"}
    with pytest.raises(EditError, match="final"):
        session.apply(parse_edit({**edit, "state": "c"}))
    session.apply(parse_edit({**edit, "state": "b"}))
    (edge,) = diagram(session.document).edges
    assert (edge.source, edge.target, edge.when, edge.actions) == ("b", "b", "imu.z > 1", ("hover",))
    session.undo()
    assert session.document.text == text


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{",
        '{"states": {"a": {"x": 1}}}',
        '{"states": {"a": {"x": 1, "y": NaN}}}',
        '{"version": 2}',
        '{"more": 1}',
    ],
)
def test_a_bad_layout_is_refused_in_one_line(text):
    with pytest.raises(LayoutError, match=r"^m\.layout\.json: ") as caught:
        parse_layout(text, "m.layout.json")
    assert "\n" not in str(caught.value)


@dataclass
class Radar:
    """What the radar measures.

    Attributes:
        range_m: to what is ahead.
    """

    range_m: float = 0.0
    mode: Annotated[Literal["near", "far"], Field(description="of the antenna")] = "near"


class Contestant(Pilot):
    """A pilot with more."""

    careful_m_s = 0.2
    radar: Radar

    @property
    def tilt_rad(self) -> Annotated[float, Field(ge=0, le=1.5)]:
        """Of the drone."""
        return 0.0

    def creep(self) -> None:
        """Fly slowly.

        For as long as it is called.
        """


def test_the_catalogue_has_what_a_contestant_adds():
    made = catalogue(Contestant, {"home": 1.5})
    values = {value.name: value for value in made.values}
    primitives = {primitive.name: primitive for primitive in made.primitives}
    json.dumps(as_json(made))
    assert values["frame.d"].unit == "m"
    assert values["frame.d"].low == 0
    assert (values["cmd.vel_x"].low, values["cmd.vel_x"].high, values["cmd.vel_x"].assignable) == (
        -1,
        1,
        True,
    )
    assert values["colour"].choices == ("red", "green", "blue")
    assert values["memory.home"].assignable
    assert values["frame_known"].needs_map
    assert (values["careful_m_s"].unit, values["careful_m_s"].own) == ("m/s", True)
    assert values["radar.range_m"].text == "to what is ahead."
    assert (values["radar.mode"].choices, values["radar.mode"].text) == (("near", "far"), "of the antenna")
    tilt = values["tilt_rad"]
    assert (tilt.text, tilt.unit, tilt.low, tilt.high, tilt.type) == (
        "Of the drone.",
        "rad",
        0,
        1.5,
        "number",
    )
    assert (primitives["creep"].text, primitives["creep"].own) == ("Fly slowly.", True)
    assert primitives["creep"].help.endswith("For as long as it is called.")
    assert not primitives["hover"].own
    assert all(value.text for value in made.values if not value.own and not value.name.startswith("memory."))
    names = {value.name for value in catalogue_of(opened("careful_crossing")).values}
    assert {"memory.x0", "memory.alpha0"} <= names
    assert {value.name: value for value in catalogue_of(opened("racer")).values}["cmd.vel_x"].high is None
    assert {value.name: value for value in catalogue(contest=False).values}["cmd.vel_x"].high is None
