"""A mission as SCXML (W3C State Chart XML), for editors and interpreters of statecharts.

The chart is the expanded one, as it is flown: templates are written out for each use. What the formats do
not share is written so:

- a transition is one of the event `tick`, which comes twenty times a second; `during` is a last one without a
  target; `then` is one of `done.state.ID`; after a pause the event `resume` comes;
- a superstate's transitions and `during` are written at each of its states, because in SCXML a state that
  takes an event keeps it from the states around it;
- an action is a `<script>` that calls the primitive, or an `<assign>`; expressions are Python's;
- description, class, vision, detector and gate (its four sizes) are attributes of the namespace `NAMESPACE`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import astuple
from xml.etree import ElementTree as ET

from offboard.chart.spec import RESUME, Action, Leaf, MissionFile, State, leaves

SCXML = "http://www.w3.org/2005/07/scxml"
NAMESPACE = "urn:framerunner:mission:1"
DATAMODEL = "python"
TICK = "tick"
_NOT_IN_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def export_scxml(mission: MissionFile) -> str:
    """An expanded and checked mission as an SCXML document."""
    ET.register_namespace("", SCXML)
    ET.register_namespace("framerunner", NAMESPACE)
    root = ET.Element(f"{{{SCXML}}}scxml", version="1.0", name=mission.name, initial=mission.initial)
    root.set("datamodel", DATAMODEL)
    own = {
        "description": mission.description,
        "class": mission.mission_class,
        "vision": mission.vision,
        "detector": mission.detector,
        "gate": "" if mission.gate is None else " ".join(f"{size:g}" for size in astuple(mission.gate)),
    }
    for key, value in own.items():
        if value:
            root.set(f"{{{NAMESPACE}}}{key}", _text(value))
    if mission.variables:
        model = _add(root, "datamodel")
        for name, first in mission.variables.items():
            _add(model, "data", id=f"memory.{name}", expr=repr(first))
    by_leaf = {leaf.state.id: leaf for leaf in leaves(mission.states)}
    for state in mission.states:
        _add_state(root, state, by_leaf)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _add(parent: ET.Element, name: str, **attributes: str) -> ET.Element:
    return ET.SubElement(parent, f"{{{SCXML}}}{name}", {key: _text(text) for key, text in attributes.items()})


def _text(text: str) -> str:
    return _NOT_IN_XML.sub("\ufffd", text)


def _add_state(parent: ET.Element, state: State, by_leaf: dict[str, Leaf]) -> None:
    element = _add(parent, "final" if state.final else "state", id=state.id)
    if state.states:
        element.set("initial", f"{state.id}.{state.initial}")
    for name, actions in (("onentry", state.enter), ("onexit", state.exit)):
        if actions:
            _add_actions(_add(element, name), actions)
    if state.states:
        if state.then:
            _add(element, "transition", event=f"done.state.{state.id}", target=state.then.to)
        for child in state.states:
            _add_state(element, child, by_leaf)
    elif not state.final:
        _add_transitions(element, by_leaf[state.id])


def _add_transitions(element: ET.Element, leaf: Leaf) -> None:
    for transition in leaf.transitions:
        guard = {"cond": transition.when} if transition.when else {}
        written = _add(element, "transition", event=TICK, **guard, target=transition.to)
        _add_actions(written, transition.actions)
    if leaf.during:
        _add_actions(_add(element, "transition", event=TICK), leaf.during)
    if leaf.resume is not None:
        _add(element, "transition", event=RESUME, target=leaf.resume.to)


def _add_actions(parent: ET.Element, actions: Iterable[Action]) -> None:
    for action in actions:
        if action.location:
            _add(parent, "assign", location=action.location, expr=action.expression)
        else:
            _add(parent, "script").text = f"{action.name}()"
