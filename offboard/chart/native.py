"""The expanded chart as a document of python-statemachine, loaded by its secure loader.

Four properties of the library (3.2.2, tested) determine the document:
- in one list of actions it runs the assignments first, whatever their order; a primitive before an assignment
  is therefore written as a condition without a consequence, which is called in the right order;
- a superstate gets an event only if the inner state took none, so `during` as a last transition of the inner
  state would hide the outer ones; hence each leaf has the transitions of the superstates around it;
- an "internal" transition of a state to itself runs its `enter` again; one without a target does not, so
  `during` is written as that;
- an error in a guard is taken as "false" and an event; here it is raised.
"""

from __future__ import annotations

import json
from typing import Any

from statemachine import StateChart
from statemachine.exceptions import InvalidDefinition
from statemachine.io import load

from offboard.chart.problems import mission_error
from offboard.chart.spec import Action, Leaf, MissionFile, State, leaves

TICK = "tick"
RESUME = "resume"


def native_document(mission: MissionFile) -> dict[str, Any]:
    """A mission that is expanded and checked, as a document of python-statemachine.

    `mission check` and tests compare it with the library's JSON Schema; that takes too long at every start.
    """
    by_leaf = {leaf.state.id: leaf for leaf in leaves(mission.states)}
    states = {s.id: _state(s, s.name == mission.initial, by_leaf) for s in mission.states}
    return {"name": mission.name, "states": states}


def load_chart(mission: MissionFile, *, validate: bool = False) -> type[StateChart]:
    """Build the chart's class; `MissionError` if the library refuses what the checker accepts.

    Args:
        mission: expanded and checked.
        validate: compare the document with the library's JSON Schema, too.
    """
    try:
        chart: type[StateChart] = load(json.dumps(native_document(mission)), format="json", validate=validate)
    except (InvalidDefinition, ValueError) as error:
        raise mission_error(mission.place, " ".join(str(error).split())) from None
    chart.catch_errors_as_events = False
    return chart


def _state(state: State, initial: bool, by_leaf: dict[str, Leaf]) -> dict[str, Any]:
    native: dict[str, Any] = {}
    if initial:
        native["initial"] = True
    if state.final:
        native["final"] = True
    if state.enter:
        native["enter"] = _actions(state.enter)
    if state.exit:
        native["exit"] = _actions(state.exit)
    if state.states:
        native["states"] = {s.id: _state(s, s.name == state.initial, by_leaf) for s in state.states}
        if state.then:
            native["transitions"] = [{"event": f"done.state.{state.id}", "target": state.then}]
    elif not state.final:
        native["transitions"] = _transitions(by_leaf[state.id])
    return native


def _transitions(leaf: Leaf) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    for transition in leaf.transitions:
        guard = {"cond": transition.when} if transition.when else {}
        actions = {"on": _actions(transition.actions)} if transition.actions else {}
        found.append({"event": TICK, "target": transition.to, **guard, **actions})
    if leaf.during:
        found.append({"event": TICK, "on": _actions(leaf.during)})  # without a target no state is left
    if leaf.resume:
        found.append({"event": RESUME, "target": leaf.resume.to})
    return found


def _actions(actions: tuple[Action, ...]) -> list[Any]:
    last = max((index for index, action in enumerate(actions) if action.location), default=-1)
    native: list[Any] = []
    for index, action in enumerate(actions):
        if action.location:
            native.append({"assign": {"location": action.location, "expr": action.expression}})
        else:
            native.append({"if": {"cond": action.name}} if index < last else action.name)
    return native
