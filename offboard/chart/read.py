"""From YAML nodes to a `MissionFile`: structure, keys and names. `check` checks expressions."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import TypeVar, get_args

from offboard.chart.problems import Place, ProblemList, cut, did_you_mean
from offboard.chart.spec import Action, MissionFile, State, Transition
from offboard.chart.yaml_nodes import ListNode, MapNode, Node, Scalar, parse_yaml
from scenarios.models import MissionClass
from vision.types import Vision

Choice = TypeVar("Choice", bound=str)

_MISSION_KEYS = (
    *("name", "description", "class", "vision", "extends"),
    *("initial", "variables", "templates", "states"),
)
_CLASSES: tuple[MissionClass, ...] = get_args(MissionClass)
_VISIONS: tuple[Vision, ...] = get_args(Vision)
_STATE_KEYS = (
    *("initial", "final", "then", "use", "resume"),
    *("enter", "during", "exit", "transitions", "states"),
)
_TEMPLATE_KEYS = ("initial", "states", "resume", "transitions", "enter", "during", "exit")
_TRANSITION_KEYS = ("when", "to")
_SYNONYMS = {
    **dict.fromkeys(("while", "loop", "do", "tick", "always"), "during"),
    **dict.fromkeys(("on_enter", "entry", "begin", "on_start"), "enter"),
    **dict.fromkeys(("on_exit", "leave", "on_leave"), "exit"),
    **dict.fromkeys(("if", "condition", "guard", "cond"), "when"),
    **dict.fromkeys(("target", "next", "state"), "to"),
    **dict.fromkeys(("end", "stop", "finish", "last"), "final"),
    **dict.fromkeys(("template", "extends"), "use"),
    **dict.fromkeys(("first", "start"), "initial"),
}
_NAME = re.compile(r"[a-z][a-z0-9_]*\Z")
_MISSION_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,79}\Z")  # as a scenario's: folders are named by it
_SETTING = re.compile(r"[a-z][\w.]*\Z")
_ASSIGNMENT = re.compile(r"\s*([A-Za-z_][\w.]*)\s*=(?!=)\s*(.*)\Z", re.DOTALL)


def read_mission_file(text: str, path: Path) -> MissionFile:
    """Read the text of one mission file, without what it extends.

    Raises:
        MissionError: with every problem of its structure.
    """
    root = parse_yaml(text, path.name, _MISSION_KEYS)
    problems = ProblemList()
    mission = _Reader(problems).mission(root, path)
    problems.raise_if_any()
    return mission


class _Reader:
    """Converts nodes to data and collects problems."""

    def __init__(self, problems: ProblemList) -> None:
        self._problems = problems

    def mission(self, root: MapNode, path: Path) -> MissionFile:
        self._check_keys(root, _MISSION_KEYS, "a mission")
        variables = self._variables(root)
        return MissionFile(
            place=Place(root.place.file, root.place.line),
            path=path,
            name=self._mission_name(root, path),
            description=self._text(root, "description"),
            mission_class=self._choice(root, "class", _CLASSES),
            vision=self._choice(root, "vision", _VISIONS),
            extends=self._text(root, "extends"),
            initial=self._text(root, "initial"),
            initial_place=_value_place(root, "initial"),
            variables={key: self._constant(key, node) for key, node in variables.items()},
            templates=self._states(root, "templates", _TEMPLATE_KEYS),
            states=tuple(self._states(root, "states", _STATE_KEYS).values()),
        )

    def _states(self, parent: MapNode, key: str, allowed: tuple[str, ...]) -> dict[str, State]:
        """States or templates by name; none if a key of one of them is not indented."""
        children = self._children(parent, key)
        names = list(children)
        for number, (name, node) in enumerate(children.items()):
            if name in _STATE_KEYS and (name == "states" or not isinstance(node, MapNode)):
                under = f", under '{names[number - 1]}:'" if number else ""
                place = self._key_place(parent.items[key], name)
                self._problems.add(place, f"'{name}' stands beside the {key}; indent it more{under}")
                return {}
        return {name: self._state(name, node, allowed, parent.items[key]) for name, node in children.items()}

    def _state(self, name: str, node: Node, keys: tuple[str, ...], around: Node) -> State:
        place = self._key_place(around, name)
        if isinstance(node, Scalar) and not node.text:  # "end:" with nothing below
            node = MapNode(node.place, {}, {})
        if not isinstance(node, MapNode):
            text = f"state '{name}' needs lines below it, such as 'enter:' and 'transitions:'"
            self._problems.add(node.place, text)
            return State(place, name)
        self._check_keys(node, keys, f"state '{name}'")
        return State(
            place=place,
            id=name,
            initial=self._text(node, "initial"),
            initial_place=_value_place(node, "initial"),
            final=self._flag(node, "final"),
            then=self._text(node, "then"),
            then_place=_value_place(node, "then"),
            use=self._text(node, "use"),
            resume=self._resume(node),
            enter=self._actions(node, "enter"),
            during=self._actions(node, "during"),
            exit=self._actions(node, "exit"),
            transitions=self._transitions(node),
            states=tuple(self._states(node, "states", _STATE_KEYS).values()),
        )

    def _resume(self, state: MapNode) -> Transition | None:
        if "resume" not in state.items:
            return None
        place, to = _value_place(state, "resume"), self._text(state, "resume")
        if not to and isinstance(state.items["resume"], Scalar):
            text = "'resume' is empty; name the state to go on in after a pause"
            self._problems.add(state.keys["resume"], text)
        return Transition(place, to)

    def _transitions(self, state: MapNode) -> tuple[Transition, ...]:
        found: list[Transition] = []
        incomplete: Place | None = None  # where the one before begins, if it has no target
        for node in self._list(state, "transitions"):
            if not isinstance(node, MapNode):
                self._problems.add(node.place, "a transition has 'when: ...' and, under it, 'to: ...'")
                continue
            if incomplete is not None and set(node.keys) == {"to"}:
                text = "take the '-' before 'to' away, and put 'to' under the 'when' above it"
                self._problems.remove(incomplete)
                self._problems.add(node.place, text)
                incomplete = None
                continue
            transition = self._transition(node)
            incomplete = node.place if not transition.to and set(node.keys) == {"when"} else None
            found.append(transition)
        return tuple(found)

    def _transition(self, node: MapNode) -> Transition:
        known = self._check_keys(node, _TRANSITION_KEYS, "a transition")
        to, when = self._text(node, "to"), self._text(node, "when")
        if not to and known:
            self._problems.add(node.place, "transition without 'to'; name the state it leads to")
        if "when" in node.items and not when:
            text = "'when' is empty; leave it out for a transition at the next tick"
            self._problems.add(node.keys["when"], text)
        when_place = _value_place(node, "when") if "when" in node.items else node.place
        return Transition(_value_place(node, "to"), to, when, when_place)

    def _actions(self, state: MapNode, key: str) -> tuple[Action, ...]:
        return tuple(filter(None, (self._action(key, node) for node in self._list(state, key))))

    def _action(self, key: str, node: Node) -> Action | None:
        if isinstance(node, MapNode) and len(node.items) == 1:
            (name, value), place = next(iter(node.items.items())), next(iter(node.keys.values()))
            if name in _TRANSITION_KEYS:
                self._problems.add(place, f"'{name}' does not belong here; write it under 'transitions:'")
                return None
            if isinstance(value, Scalar) and _SETTING.match(name):
                self._problems.add(place, f"to set a value write '=': {name} = {cut(value.text, 30)}")
                return None
        if not isinstance(node, Scalar) or not node.text.strip():
            text = f"'{key}' lists primitives and assignments, such as '- hover' and '- cmd.vel_x = 0.3'"
            self._problems.add(node.place, text)
            return None
        assignment = _ASSIGNMENT.match(node.text)
        if not assignment:
            return Action(node.place, name=node.text.strip())
        location, expression = assignment.groups()
        return Action(
            node.place,
            location=location,
            expression=expression.strip(),
            expression_place=node.place.moved(assignment.start(2)),
        )

    def _variables(self, root: MapNode) -> dict[str, Node]:
        variables = self._children(root, "variables")
        for name, node in variables.items():
            if isinstance(node, MapNode):
                text = f"'{name}' looks like a state, but stands under 'variables:'; put 'states:' above it"
                self._problems.add(self._key_place(root.items["variables"], name), text)
                return {}
        return variables

    def _constant(self, name: str, node: Node) -> object:
        text = node.text.strip() if isinstance(node, Scalar) else ""
        try:
            value: object = ast.literal_eval(text)
        except (ValueError, SyntaxError, MemoryError, RecursionError):
            value = text if isinstance(node, Scalar) and node.quoted else None
        is_place = isinstance(value, tuple) and len(value) == 3 and all(map(_is_number, value))
        if not is_place and not isinstance(value, (bool, int, float, str)):
            what = f"variable '{name}' needs a number, a (x, y, z), True, False or 'text'"
            if re.fullmatch(r"[+-]?\d+,\d+", text):
                what = f"{text} is two numbers; write it with a point: {text.replace(',', '.')}"
            elif re.fullmatch(r"[A-Za-z_]\w*", text):
                word = text.capitalize()
                what = f"write {word}" if word in ("True", "False") else f"write a text in quotes: '{text}'"
            self._problems.add(node.place, what)
        return value

    def _mission_name(self, root: MapNode, path: Path) -> str:
        """The name in the file or, without one, the file's own name in the form of a mission's."""
        name = self._text(root, "name")
        if not name:
            words = re.sub(r"[^a-z0-9_-]+", "-", path.stem.lower()).strip("-_")
            return words[:80] or "mission"
        if not _MISSION_NAME.match(name):
            text = f"name '{cut(name, 40)}': use small letters, digits, - and _, a letter or digit first"
            limit = "; at most 80" if len(name) > 80 else ""
            self._problems.add(_value_place(root, "name"), text + limit)
        return name

    def _children(self, node: MapNode, key: str) -> dict[str, Node]:
        child = node.items.get(key)
        if child is None:
            return {}
        if not isinstance(child, MapNode):
            if not (isinstance(child, Scalar) and not child.text):
                example = "such as '  start_x: 0'" if key == "variables" else f"such as '  {key[:-1]}_1:'"
                self._problems.add(node.keys[key], f"'{key}' needs names below it, {example}")
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
        if isinstance(child, Scalar) and not child.text:
            return ()
        example = "- when: ..." if key == "transitions" else "- hover"
        text = f"'{key}' must be a list; start its lines with '- ', such as '{example}'"
        self._problems.add(child.place, text)
        return ()

    @staticmethod
    def _key_place(node: Node, key: str) -> Place:
        return node.keys[key] if isinstance(node, MapNode) and key in node.keys else node.place

    def _text(self, node: MapNode, key: str) -> str:
        child = node.items.get(key)
        if child is None:
            return ""
        if isinstance(child, Scalar):
            return child.text.strip()
        self._problems.add(node.keys[key], f"'{key}' must be one line of text")
        return ""

    def _choice(self, node: MapNode, key: str, choices: tuple[Choice, ...]) -> Choice | None:
        """The one of some words that a key has; None if it has none."""
        if key not in node.items:
            return None
        text = self._text(node, key)
        for choice in choices:
            if text == choice:
                return choice
        if isinstance(node.items[key], Scalar):
            advice = did_you_mean(text.lower(), choices, f"it is {' or '.join(choices)}")
            self._problems.add(node.items[key].place, f"unknown {key} '{cut(text, 40)}'; {advice}")
        return None

    def _flag(self, node: MapNode, key: str) -> bool:
        text = self._text(node, key).lower()
        if text not in ("", "true", "false"):
            self._problems.add(node.items[key].place, f"'{key}' is true or false, not '{cut(text, 30)}'")
        return text == "true"

    def _check_keys(self, node: MapNode, allowed: tuple[str, ...], what: str) -> bool:
        """Whether all keys are known."""
        unknown = [key for key in node.keys if key not in allowed]
        if "when" in unknown and "to" in unknown:
            unknown.remove("to")  # it belongs to the same transition
        if len(unknown) > 2:
            del unknown[1:]  # they all stand in the wrong place, for one reason
        for key in unknown:
            self._unknown_key(node, key, allowed, what)
        return not unknown

    def _unknown_key(self, node: MapNode, key: str, allowed: tuple[str, ...], what: str) -> None:
        synonym = _SYNONYMS.get(key.lower(), "")
        advice = f"did you mean '{synonym}'?" if synonym in allowed else ""
        advice = did_you_mean(key.lower(), allowed, advice)
        if not advice and allowed == _MISSION_KEYS and isinstance(node.items[key], MapNode):
            advice = "if it is a state, indent it to stand under 'states:'"
        elif key in _TRANSITION_KEYS:
            advice = f"write it into a list under 'transitions:', such as '- {key}: ...'"
        elif key in _MISSION_KEYS and key not in (*allowed, *_STATE_KEYS):
            advice = "it belongs to the mission; write it at the beginning of a line"
        advice = advice or f"it has {', '.join(allowed)}"
        self._problems.add(node.keys[key], f"{what} has no '{cut(key, 30)}'; {advice}")


def _value_place(node: MapNode, key: str) -> Place:
    """Where the value of a key stands; without it, where the mapping begins."""
    return node.items[key].place if key in node.items else node.place


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
