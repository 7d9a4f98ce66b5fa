"""Single edits: what becomes of the text, to the character; and what is refused."""

from __future__ import annotations

import re
from pathlib import Path
from textwrap import dedent

import pytest

from offboard.authoring import (
    Document,
    EditError,
    EditSession,
    apply,
    check_document,
    edit_schema,
    parse_edit,
)
from offboard.authoring.references import instances
from offboard.mission import MISSIONS, list_missions, load_mission

TEXT = dedent("""\
    # A mission.
    name: little
    initial: rise

    templates:
      leg: # twice
        initial: go
        states:
          # flies
          go:
            during:
              - fly_to_goal # straight
            transitions:
              - to: end # at once
          end:
            final: true

    states:
      rise:
        enter:
          - hover # motors on
          # the height
          - goal_m = (0, 0, 1)
        transitions:
          - when: distance_to_goal_m < 0.1 # near
            to: red
          # in the end
          - when: seconds_in_state > 20
            to: down

      red: # the first
        use: leg
        enter:
          - colour = 'red'
        then: down

      down:
        enter: [land, 'cmd.vel_x = 0'] # both
        final: true
    """)


def edited(text: str, *edits: dict[str, object]) -> str:
    session = EditSession(Document.from_text(text))
    for edit in edits:
        session.apply(parse_edit(edit))
    after = session.document.text
    while session.can_undo:
        session.undo()
    assert session.document.text == text
    return after


def at(state: str, index: int = 0, event: str = "tick") -> dict[str, object]:
    return {"state": state, "index": index, "event": event}


@pytest.mark.parametrize(
    ("edit", "old", "new"),
    [
        (
            {"kind": "set_guard", "transition": at("rise"), "when": "frame_seen"},
            "- when: distance_to_goal_m < 0.1 # near",
            "- when: frame_seen # near",
        ),
        (
            {"kind": "set_guard", "transition": at("rise"), "when": ""},
            "- when: distance_to_goal_m < 0.1 # near\n        to: red",
            "- to: red",
        ),
        (
            {"kind": "set_guard", "transition": at("@leg.go"), "when": "colour == 'red'"},
            "- to: end # at once",
            "- when: colour == 'red'\n            to: end # at once",
        ),
        (
            {"kind": "set_guard", "transition": at("rise"), "when": "frame_seen: now"},
            "- when: distance_to_goal_m < 0.1 # near",
            "- when: 'frame_seen: now' # near",
        ),
        (
            {"kind": "redirect_transition", "transition": at("rise", 1), "to": "red"},
            "> 20\n        to: down",
            "> 20\n        to: red",
        ),
        (
            {"kind": "redirect_transition", "transition": at("red", 0, "done"), "to": "rise"},
            "then: down",
            "then: rise",
        ),
        (
            {
                "kind": "set_transition_actions",
                "transition": at("rise"),
                "actions": ["hover", "goal_m = (0, 0, 3)"],
            },
            "to: red\n",
            "to: red\n        do:\n          - hover\n          - goal_m = (0, 0, 3)\n",
        ),
        (
            {"kind": "add_transition", "state": "rise", "to": "red", "when": "frame_seen", "index": 1},
            "      # in the end\n",
            "      - when: frame_seen\n        to: red\n      # in the end\n",
        ),
        (
            {"kind": "add_transition", "state": "red", "to": "red", "event": "resume"},
            "use: leg\n",
            "use: leg\n    resume: red\n",
        ),
        (
            {"kind": "delete_transition", "transition": at("rise", 1)},
            "      # in the end\n      - when: seconds_in_state > 20\n        to: down\n",
            "",
        ),
        (
            {"kind": "delete_transition", "transition": at("@leg.go")},
            "        transitions:\n          - to: end # at once\n",
            "",
        ),
        (
            {
                "kind": "set_actions",
                "state": "rise",
                "section": "enter",
                "actions": ["hover", "look_to_frame", "goal_m = (0, 0, 1)"],
            },
            "      # the height\n",
            "      - look_to_frame\n      # the height\n",
        ),
        (
            {
                "kind": "set_actions",
                "state": "down",
                "section": "enter",
                "actions": ["land", "goal_m = (0, 0, 0)"],
            },
            "[land, 'cmd.vel_x = 0'] # both",
            "[land, 'goal_m = (0, 0, 0)'] # both",
        ),
        (
            {"kind": "set_actions", "state": "red", "section": "exit", "actions": ["hover"]},
            "- colour = 'red'\n",
            "- colour = 'red'\n    exit:\n      - hover\n",
        ),
        (
            {"kind": "set_actions", "state": "@leg.go", "section": "during", "actions": []},
            "        during:\n          - fly_to_goal # straight\n",
            "",
        ),
        (
            {"kind": "set_parameter", "state": "red", "name": "colour", "value": "'blue'"},
            "colour = 'red'",
            "colour = 'blue'",
        ),
        ({"kind": "set_initial", "state": "@leg", "name": "end"}, "initial: go", "initial: end"),
        ({"kind": "set_final", "state": "down", "final": False}, "# both\n    final: true\n", "# both\n"),
        (
            {"kind": "set_variable", "name": "x0", "value": "(0, 0, 1)"},
            "initial: rise\n",
            "initial: rise\nvariables:\n  x0: (0, 0, 1)\n",
        ),
        (
            {"kind": "set_mission", "key": "class", "value": "open"},
            "name: little\n",
            "name: little\nclass: open\n",
        ),
        (
            {"kind": "add_state", "name": "wait", "index": 1},
            "  red: # the first\n",
            "  wait:\n\n  red: # the first\n",
        ),
        (
            {"kind": "add_state", "name": "wait", "parent": "@leg", "final": True},
            "      end:\n",
            "      end:\n        final: true\n      wait:\n",
        ),
        ({"kind": "rename_state", "state": "@leg.go", "name": "fly"}, "initial: go", "initial: fly"),
        ({"kind": "rename_state", "state": "@leg", "name": "way"}, "use: leg", "use: way"),
    ],
)
def test_an_edit_changes_few_characters(edit, old, new):
    assert TEXT.count(old) == 1
    expected = TEXT.replace(old, new)
    if edit["kind"] == "rename_state":
        key = new.partition(": ")[2]
        expected = expected.replace(
            "go:\n" if key == "fly" else "leg:", f"{key}:\n" if key == "fly" else "way:"
        )
    assert edited(TEXT, edit) == expected


def test_a_rename_reaches_all_that_names_the_state():
    after = edited(TEXT, {"kind": "rename_state", "state": "down", "name": "landing"})
    assert after == TEXT.replace("to: down", "to: landing").replace("then: down", "then: landing").replace(
        "  down:", "  landing:"
    )


def test_green_is_red_with_another_parameter():
    after = edited(
        TEXT,
        {"kind": "duplicate_state", "state": "red", "name": "green", "parameters": {"colour": "'green'"}},
        {"kind": "redirect_transition", "transition": at("red", 0, "done"), "to": "green"},
    )
    green = "  green: # the first\n    use: leg\n    enter:\n      - colour = 'green'\n    then: down\n\n"
    expected = TEXT.replace("then: down", "then: green").replace("  down:\n", green + "  down:\n")
    assert after == expected


def test_a_state_moves_with_its_comments_and_is_still_found():
    after = edited(
        TEXT,
        {"kind": "add_state", "name": "flight", "states": ["begin"], "index": 0},
        {"kind": "move_state", "state": "rise", "parent": "flight"},
    )
    moved = [
        "states:",
        "  begin:",
        "  rise:",
        "    enter:",
        "      - hover # motors on",
        "      # the height",
    ]
    assert "\n".join(f"    {line}" for line in moved) in after
    again = edited(after, {"kind": "move_state", "state": "flight.rise", "parent": "", "index": 1})
    assert "\n  rise:\n    enter:\n      - hover # motors on\n      # the height\n" in again
    chart = Document.from_text(after).chart
    assert [each.to for each in chart.states[0].states[1].transitions] == ["red", "down"]


def test_a_name_that_would_catch_transitions_to_another_state():
    text = TEXT.replace("to: end # at once", "to: down # at once")
    with pytest.raises(EditError, match="choose another name"):
        edited(text, {"kind": "rename_state", "state": "@leg.end", "name": "down"})
    after = edited(
        text.replace(
            "  down:", "  last:\n    initial: down\n    states:\n      down: {final: true}\n  down:"
        ),
        {"kind": "add_state", "name": "down", "parent": "last.down"},
    )
    assert "down: {final: true, initial: down, states: {down: {}}}" in after or "down:" in after


def test_lines_are_ended_as_in_the_file():
    document = Document.from_bytes(TEXT.replace("\n", "\r\n").encode(), "m.yaml")
    edit = parse_edit({"kind": "add_transition", "state": "rise", "to": "red"})
    after = apply(document, edit).document.data
    assert b"        to: red\r\n" in after
    assert after.count(b"\n") == after.count(b"\r\n")


def test_a_template_of_the_mission_that_is_extended(tmp_path):
    document = Document.open(MISSIONS / "careful_crossing.yaml")
    state = document.outline.get("@cross_frame.turning")
    assert instances(document, state) == ("red.turning", "green.turning", "blue.turning")
    after = apply(
        document, parse_edit({"kind": "rename_state", "state": state.path, "name": "rotating"})
    ).document
    path = tmp_path / "careful_crossing.yaml"
    path.write_bytes(after.data)
    before, renamed = load_mission("careful_crossing"), load_mission(path)
    assert renamed.chart_text == before.chart_text.replace("turning", "rotating")


REFUSED = [
    (
        {"kind": "set_guard", "transition": at("none"), "when": ""},
        "there is no state 'none' in this document",
    ),
    (
        {"kind": "set_guard", "transition": at("rise", 7), "when": ""},
        "state 'rise' has no transition 7 of 'tick'; it has 2",
    ),
    (
        {"kind": "set_guard", "transition": at("red.go"), "when": ""},
        "'red.go' is written in a template; edit '@leg.go'",
    ),
    (
        {"kind": "set_guard", "transition": at("red", 0, "done"), "when": "frame_seen"},
        "a transition of 'done' has no guard",
    ),
    ({"kind": "add_state", "name": "red"}, "there is a state 'red' already; choose another name"),
    (
        {"kind": "add_state", "name": "x", "parent": "red"},
        "state 'red' has the states of a template; edit '@leg'",
    ),
    ({"kind": "add_state", "name": "Red"}, "name 'Red': "),
    ({"kind": "add_state", "name": "x\n"}, r"name 'x\\n': "),
    ({"kind": "rename_state", "state": "red", "name": "down"}, "there is a state 'down' already"),
    (
        {"kind": "move_state", "state": "red", "parent": "@leg"},
        "a state is not moved into or out of a template",
    ),
    ({"kind": "move_state", "state": "rise", "parent": "rise"}, "cannot be moved into itself"),
    ({"kind": "add_transition", "state": "rise", "to": "nowhere"}, "state 'rise' cannot lead to 'nowhere'"),
    (
        {"kind": "add_transition", "state": "down", "to": "rise"},
        "state 'down' is final; no transition leaves it",
    ),
    (
        {"kind": "set_parameter", "state": "red", "name": "goal_m", "value": "1"},
        "state 'red' does not set 'goal_m'",
    ),
    ({"kind": "set_actions", "state": "rise", "section": "enter", "actions": ["a\nb"]}, "actions.0"),
    ({"kind": "replace_text", "start": 5, "end": 100_000, "text": ""}, "the text has"),
    ({"kind": "format_disk"}, "edit "),
    ([], "edit "),
]


@pytest.mark.parametrize(("edit", "reason"), REFUSED)
def test_what_cannot_be_applied_is_refused_in_one_line(edit, reason):
    session = EditSession(Document.from_text(TEXT))
    with pytest.raises(EditError, match=reason) as caught:
        session.apply(parse_edit(edit))
    assert "\n" not in str(caught.value)
    assert session.document.text == TEXT
    assert not session.can_undo


def test_a_text_that_is_not_yaml_can_only_be_typed():
    session = EditSession(Document.from_text(TEXT))
    end = len(TEXT)
    session.apply(parse_edit({"kind": "replace_text", "start": end, "end": end, "text": "  broken: [\r\n"}))
    assert session.document.text.endswith("  broken: [\n")
    with pytest.raises(
        EditError, match=r"the text cannot be read as YAML \(line \d+: .*\); correct it first"
    ):
        session.apply(parse_edit({"kind": "add_state", "name": "x"}))
    session.apply(parse_edit({"kind": "replace_text", "start": end, "end": end + 12, "text": ""}))
    session.apply(parse_edit({"kind": "add_state", "name": "x"}))


def test_a_mission_is_built_from_nothing():
    after = edited(
        "",
        {"kind": "set_mission", "key": "name", "value": "first"},
        {"kind": "add_state", "name": "up"},
        {"kind": "add_state", "name": "down", "final": True},
        {"kind": "set_actions", "state": "up", "section": "enter", "actions": ["hover", "cmd.vel_z = 0.5"]},
        {"kind": "add_transition", "state": "up", "to": "down", "when": "seconds_in_state > 2"},
        {"kind": "set_actions", "state": "down", "section": "enter", "actions": ["land"]},
    )
    assert after == dedent("""\
        name: first
        initial: up
        states:
          up:
            enter:
              - hover
              - cmd.vel_z = 0.5
            transitions:
              - when: seconds_in_state > 2
                to: down

          down:
            enter:
              - land
            final: true
        """)


def test_the_schema_of_edits_names_all_kinds():
    assert len(edit_schema()["oneOf"]) == 22


def building(shipped: Document) -> list[dict[str, object]]:
    """Edits that make a mission from nothing: first all states, then what they do and lead to."""
    outline = shipped.outline
    edits: list[dict[str, object]] = []
    for key in ("name", "description", "class", "vision", "extends"):
        if outline.text(key):
            edits.append({"kind": "set_mission", "key": key, "value": outline.text(key)})
    edits += [{"kind": "set_variable", "name": n, "value": v.text} for n, v in outline.variables.items()]
    for template in outline.templates:
        names = [state.name for state in template.states]
        edits.append({"kind": "add_template", "name": template.name, "states": names})
    for state in outline:
        if state.is_template or state.parent.startswith("@"):
            continue
        edit = {"kind": "add_state", "name": state.name, "parent": state.parent}
        edits.append({**edit, "use": state.text("use")} if state.text("use") else edit)
    for state in outline:
        for section in ("enter", "during", "exit"):
            actions = [action.text for action in state.actions(section)]
            edits.append({"kind": "set_actions", "state": state.path, "section": section, "actions": actions})
        if state.text("final"):
            edits.append({"kind": "set_final", "state": state.path, "final": True})
        for each in state.transitions:
            to = each.to.text
            beside = f"{state.parent}.{to}".lstrip(".")
            inside = f"{state.path}.{to}"
            known = [path for path in (inside, beside, to) if outline.get(path) is not None]
            edit = {
                "kind": "add_transition",
                "state": state.path,
                "event": each.event,
                "to": (known or [to])[0],
            }
            edits.append({**edit, "when": each.when.text if each.when else ""})
    return edits


@pytest.mark.parametrize("name", list_missions())
def test_a_shipped_mission_is_built_by_edits_from_an_empty_text(tmp_path, name):
    shipped = Document.open(MISSIONS / f"{name}.yaml")
    path = tmp_path / f"{name}.yaml"
    session = EditSession(Document.from_text("", path))
    for edit in building(shipped):
        session.apply(parse_edit(edit))
    path.write_bytes(session.document.data)
    assert load_mission(path).chart_text == load_mission(name).chart_text
    assert not [each for each in check_document(session.document) if each.severity != "advice"]


def test_the_example_of_the_documents_works(capsys):
    text = (Path(__file__).parents[3] / "docs" / "missions.md").read_text(encoding="utf-8")
    (example,) = [each for each in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "authoring" in each]
    exec(compile(example, "missions.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "error state.no_way_out state 'up' has no way out" in printed
    assert printed.endswith("  down:\n    final: true\n\n")
