"""From YAML nodes to a `MissionFile`: structure, keys and names. Expressions are checked later."""

from __future__ import annotations

import ast
import re
from difflib import get_close_matches
from pathlib import Path

from offboard.chart.problems import Place, ProblemList
from offboard.chart.source import ListNode, MapNode, Node, Scalar, parse
from offboard.chart.spec import Action, MissionFile, State, Transition

_MISSION_KEYS = ("name", "description", "extends", "initial", "variables", "templates", "states")
_STATE_KEYS = (
    *("initial", "final", "then", "use", "resume"),
    *("enter", "during", "exit", "transitions", "states"),
)
_TEMPLATE_KEYS = ("initial", "states", "resume", "transitions", "enter", "during", "exit")
_TRANSITION_KEYS = ("when", "to")
_NAME = re.compile(r"[a-z][a-z0-9_]*\Z")
_ASSIGNMENT = re.compile(r"\s*([A-Za-z_][\w.]*)\s*=(?!=)\s*(.*)\Z", re.DOTALL)


def read_mission_file(text: str, path: Path) -> MissionFile:
    """Read one mission file, without what it extends.

    Args:
        text: its content.
        path: where it stands; its name is used in problems.

    Raises:
        MissionError: with every problem of its structure.
    """
    root = parse(text, path.name)
    problems = ProblemList()
    mission = _Reader(problems).mission(root, path)
    problems.raise_if_any()
    return mission


class _Reader:
    """Turns nodes into data and notes what does not fit."""

    def __init__(self, problems: ProblemList) -> None:
        self._problems = problems

    def mission(self, root: MapNode, path: Path) -> MissionFile:
        self._check_keys(root, _MISSION_KEYS, "a mission")
        variables = self._children(root, "variables")
        templates = self._children(root, "templates")
        return MissionFile(
            place=root.place,
            path=path,
            name=self._text(root, "name") or path.stem,
            description=self._text(root, "description"),
            extends=self._text(root, "extends"),
            initial=self._text(root, "initial"),
            variables={key: self._constant(key, node) for key, node in variables.items()},
            templates={key: self._state(key, node, _TEMPLATE_KEYS) for key, node in templates.items()},
            states=self._states(root),
        )

    def _states(self, parent: MapNode) -> tuple[State, ...]:
        children = self._children(parent, "states")
        return tuple(self._state(key, node, _STATE_KEYS) for key, node in children.items())

    def _state(self, name: str, node: Node, keys: tuple[str, ...]) -> State:
        if isinstance(node, Scalar) and not node.text:  # "end:" with nothing below
            node = MapNode(node.place, {}, {})
        if not isinstance(node, MapNode):
            self._problems.add(node.place, f"state '{name}' must be a mapping of {_listing(keys)}")
            return State(node.place, name)
        self._check_keys(node, keys, f"state '{name}'")
        return State(
            place=node.place,
            id=name,
            initial=self._text(node, "initial"),
            final=self._flag(node, "final"),
            then=self._text(node, "then"),
            use=self._text(node, "use"),
            resume=self._resume(node),
            enter=self._actions(node, "enter"),
            during=self._actions(node, "during"),
            exit=self._actions(node, "exit"),
            transitions=self._transitions(node),
            states=self._states(node),
        )

    def _resume(self, state: MapNode) -> Transition | None:
        if "resume" not in state.items:
            return None
        place, to = state.keys["resume"], self._text(state, "resume")
        if not to and isinstance(state.items["resume"], Scalar):
            self._problems.add(place, "'resume' is empty; name the state to go on in after a pause")
        return Transition(place, to)

    def _transitions(self, state: MapNode) -> tuple[Transition, ...]:
        found = []
        for node in self._list(state, "transitions"):
            if not isinstance(node, MapNode):
                self._problems.add(node.place, "a transition is a mapping with 'to' and, mostly, 'when'")
                continue
            self._check_keys(node, _TRANSITION_KEYS, "a transition")
            to, when = self._text(node, "to"), self._text(node, "when")
            if not to:
                self._problems.add(node.place, "transition without 'to'; name the state it leads to")
            if "when" in node.items and not when:
                self._problems.add(
                    node.place, "'when' is empty; leave it out for a transition at the next tick"
                )
            place = node.keys.get("when", node.place)
            found.append(Transition(place, to, when))
        return tuple(found)

    def _actions(self, state: MapNode, key: str) -> tuple[Action, ...]:
        found = []
        for node in self._list(state, key):
            if not isinstance(node, Scalar) or not node.text.strip():
                self._problems.add(node.place, f"'{key}' lists primitives and assignments, one a line")
                continue
            assignment = _ASSIGNMENT.match(node.text)
            if assignment:
                location, expression = assignment.groups()
                found.append(Action(node.place, location=location, expression=expression.strip()))
            else:
                found.append(Action(node.place, name=node.text.strip()))
        return tuple(found)

    def _constant(self, name: str, node: Node) -> object:
        text = node.text if isinstance(node, Scalar) else ""
        try:
            value: object = ast.literal_eval(text)
        except (ValueError, SyntaxError):
            value = None
        if not isinstance(value, (bool, int, float, str, tuple)):
            self._problems.add(
                node.place, f"variable '{name}' needs a number, a (x, y, z), True, False or 'text'"
            )
        return value

    def _children(self, node: MapNode, key: str) -> dict[str, Node]:
        child = node.items.get(key)
        if child is None:
            return {}
        if not isinstance(child, MapNode):
            self._problems.add(node.keys[key], f"'{key}' must be a mapping of names")
            return {}
        for name, place in child.keys.items():
            if not _NAME.match(name):
                text = f"'{name}' is not a name; use small letters, digits and _, a letter first"
                self._problems.add(place, text)
        return child.items

    def _list(self, node: MapNode, key: str) -> tuple[Node, ...]:
        child = node.items.get(key)
        if child is None:
            return ()
        if isinstance(child, ListNode):
            return child.items
        self._problems.add(node.keys[key], f"'{key}' must be a list; start its lines with '- '")
        return ()

    def _text(self, node: MapNode, key: str) -> str:
        child = node.items.get(key)
        if child is None:
            return ""
        if isinstance(child, Scalar):
            return child.text.strip()
        self._problems.add(node.keys[key], f"'{key}' must be one line of text")
        return ""

    def _flag(self, node: MapNode, key: str) -> bool:
        text = self._text(node, key).lower()
        if text not in ("", "true", "false"):
            self._problems.add(node.keys[key], f"'{key}' is true or false, not '{text}'")
        return text == "true"

    def _check_keys(self, node: MapNode, allowed: tuple[str, ...], what: str) -> None:
        for key, place in node.keys.items():
            if key not in allowed:
                self._unknown_key(place, key, allowed, what)

    def _unknown_key(self, place: Place, key: str, allowed: tuple[str, ...], what: str) -> None:
        near = get_close_matches(key, allowed, 1)
        mend = f"did you mean '{near[0]}'?" if near else f"it has {_listing(allowed)}"
        self._problems.add(place, f"{what} has no '{key}'; {mend}")


def _listing(words: tuple[str, ...]) -> str:
    return ", ".join(words)
