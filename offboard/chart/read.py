"""From YAML nodes to a `MissionFile`: structure, keys and names. `check` checks expressions."""

from __future__ import annotations

import ast
import re
from math import nan
from pathlib import Path
from typing import TypeVar, get_args

from framerunner.files.yaml_text import ListNode, MapNode, Node, Place, Scalar
from framerunner.geometry.gate_shape import BAR_LIMITS_M, PAPER_GATE, SIZE_LIMITS_M, GateShape
from offboard.chart.mission_texts import Message
from offboard.chart.problems import ProblemList, cut, did_you_mean
from offboard.chart.spec import Action, MissionFile, State, Transition
from offboard.chart.yaml_syntax import parse_yaml
from scenarios.models import MissionClass
from vision.types import Vision

Choice = TypeVar("Choice", bound=str)

MISSION_KEYS = (
    *("name", "description", "class", "vision", "detector", "gate", "extends"),
    *("initial", "variables", "templates", "states"),
)
_CLASSES: tuple[MissionClass, ...] = get_args(MissionClass)
_VISIONS: tuple[Vision, ...] = get_args(Vision)
_STATE_KEYS = (
    *("initial", "final", "then", "use", "resume"),
    *("enter", "during", "exit", "transitions", "states"),
)
_TEMPLATE_KEYS = ("initial", "states", "resume", "transitions", "enter", "during", "exit")
TRANSITION_KEYS = ("when", "to", "do")
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
MAX_CONSTANT_CHARACTERS = 500
_GATE_LIMITS_M = {
    "outer_width_m": SIZE_LIMITS_M,
    "outer_height_m": SIZE_LIMITS_M,
    "bar_m": BAR_LIMITS_M,
    "depth_m": BAR_LIMITS_M,
}
_EXAMPLES = {"variables": "  start_x: 0", "gate": "  outer_width_m: 0.42"}
_NAME = re.compile(r"[a-z][a-z0-9_]*\Z")
_MISSION_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,79}\Z")  # as a scenario's: folders are named by it
_SETTING = re.compile(r"[a-z][\w.]*\Z")
_ASSIGNMENT = re.compile(r"\s*([A-Za-z_][\w.]*)\s*=(?!=)\s*(.*)\Z", re.DOTALL)


def read_mission_file(text: str, path: Path, label: str = "") -> MissionFile:
    """Read the text of one mission file, without what it extends.

    Args:
        text: its content, lines ended by a line feed.
        path: where it is.
        label: its name in problems; by default that of the path.

    Raises:
        MissionError: with every problem of its structure.
    """
    problems = ProblemList()
    mission = read_nodes(parse_mission_yaml(text, label or path.name), path, problems)
    problems.raise_if_any()
    return mission


def parse_mission_yaml(text: str, label: str) -> MapNode:
    """The nodes of a mission's text. Raises `MissionError` if it is not YAML."""
    return parse_yaml(text, label, MISSION_KEYS)


def read_nodes(root: MapNode, path: Path, problems: ProblemList) -> MissionFile:
    """Convert nodes to a mission; what cannot be understood is left out and noted in `problems`."""
    return _Reader(problems).mission(root, path)


class _Reader:
    """Converts nodes to data and collects problems."""

    def __init__(self, problems: ProblemList) -> None:
        self._problems = problems

    def mission(self, root: MapNode, path: Path) -> MissionFile:
        self._check_keys(root, MISSION_KEYS, Message("what.a_mission"))
        variables = self._variables(root)
        return MissionFile(
            place=Place(root.place.file, root.place.line),
            path=path,
            name=self._mission_name(root, path),
            description=self._text(root, "description"),
            mission_class=self._choice(root, "class", _CLASSES),
            vision=self._choice(root, "vision", _VISIONS),
            detector=self._text(root, "detector"),
            detector_place=_value_place(root, "detector"),
            gate=self._gate(root),
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
                message = Message("key.beside", name=name, key=key)
                if number:
                    message = Message("key.beside_under", name=name, key=key, under=names[number - 1])
                self._problems.add(_key_place(parent.items[key], name), message)
                return {}
        return {name: self._state(name, node, allowed, parent.items[key]) for name, node in children.items()}

    def _state(self, name: str, node: Node, keys: tuple[str, ...], around: Node) -> State:
        place = _key_place(around, name)
        if isinstance(node, Scalar) and not node.text:  # "end:" with nothing below
            node = MapNode(node.place, {}, {})
        if not isinstance(node, MapNode):
            self._problems.add(node.place, Message("state.no_lines", state=name))
            return State(place, name)
        self._check_keys(node, keys, Message("what.state", state=name))
        then = self._text(node, "then")
        return State(
            place=place,
            id=name,
            initial=self._text(node, "initial"),
            initial_place=_value_place(node, "initial"),
            final=self._flag(node, "final"),
            then=Transition(_value_place(node, "then"), then) if then else None,
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
            self._problems.add(state.keys["resume"], Message("state.resume_empty"))
        return Transition(place, to)

    def _transitions(self, state: MapNode) -> tuple[Transition, ...]:
        found: list[Transition] = []
        incomplete: Place | None = None  # where the one before begins, if it has no target
        for node in self._list(state, "transitions"):
            if not isinstance(node, MapNode):
                self._problems.add(node.place, Message("transition.form"))
                continue
            if incomplete is not None and set(node.keys) == {"to"}:
                self._problems.remove(incomplete)
                self._problems.add(node.place, Message("transition.dash"))
                incomplete = None
                continue
            transition = self._transition(node)
            incomplete = node.place if not transition.to and set(node.keys) == {"when"} else None
            found.append(transition)
        return tuple(found)

    def _transition(self, node: MapNode) -> Transition:
        known = self._check_keys(node, TRANSITION_KEYS, Message("what.a_transition"))
        to, when = self._text(node, "to"), self._text(node, "when")
        if not to and known:
            self._problems.add(node.place, Message("transition.no_target"))
        if "when" in node.items and not when:
            self._problems.add(node.keys["when"], Message("transition.when_empty"))
        when_place = _value_place(node, "when") if "when" in node.items else node.place
        return Transition(_value_place(node, "to"), to, when, when_place, self._actions(node, "do"))

    def _actions(self, state: MapNode, key: str) -> tuple[Action, ...]:
        return tuple(filter(None, (self._action(key, node) for node in self._list(state, key))))

    def _action(self, key: str, node: Node) -> Action | None:
        if isinstance(node, MapNode) and len(node.items) == 1:
            (name, value), place = next(iter(node.items.items())), next(iter(node.keys.values()))
            if name in TRANSITION_KEYS:
                self._problems.add(place, Message("action.misplaced", name=name))
                return None
            if isinstance(value, Scalar) and _SETTING.match(name):
                self._problems.add(place, Message("action.colon", name=name, value=cut(value.text, 30)))
                return None
        if not isinstance(node, Scalar) or not node.text.strip():
            self._problems.add(node.place, Message("action.form", key=key))
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
                place = _key_place(root.items["variables"], name)
                self._problems.add(place, Message("variable.state", name=name))
                return {}
        return variables

    def _constant(self, name: str, node: Node) -> object:
        text = node.text.strip() if isinstance(node, Scalar) else ""
        try:
            value: object = ast.literal_eval(text) if len(text) <= MAX_CONSTANT_CHARACTERS else None
        except (ValueError, SyntaxError, MemoryError, RecursionError):
            value = text if isinstance(node, Scalar) and node.quoted else None
        is_place = isinstance(value, tuple) and len(value) == 3 and all(map(_is_number, value))
        if not is_place and not isinstance(value, (bool, int, float, str)):
            what = Message("variable.value", name=name)
            if re.fullmatch(r"[+-]?\d+,\d+", text):
                what = Message("variable.comma", text=text, point=text.replace(",", "."))
            elif re.fullmatch(r"[A-Za-z_]\w*", text):
                word = text.capitalize()
                what = Message("variable.text", text=cut(text))
                if word in ("True", "False"):
                    what = Message("variable.word", word=word)
            self._problems.add(node.place, what)
        return value

    def _gate(self, root: MapNode) -> GateShape | None:
        """The shape of the gates; None if the mission has none. A depth is that of the bars' width."""
        node = root.items.get("gate")
        if not isinstance(node, MapNode):
            self._children(root, "gate")
            return None
        self._check_keys(node, tuple(_GATE_LIMITS_M), Message("what.gate"))
        sizes_m: dict[str, float] = {}
        for key, (low, high) in _GATE_LIMITS_M.items():
            if key in node.items:
                text = self._text(node, key)
                try:
                    size_m = float(text)
                except ValueError:
                    size_m = nan
                if not low <= size_m <= high:
                    message = Message("gate.size", key=key, text=cut(text, 30), low=low, high=high)
                    self._problems.add(node.items[key].place, message)
                    return None
                sizes_m[key] = size_m
        sizes_m.setdefault("depth_m", sizes_m.get("bar_m", PAPER_GATE.depth_m))
        shape = GateShape(**sizes_m)
        if min(shape.opening_m) <= 0.0:
            self._problems.add(_value_place(node, "bar_m"), Message("gate.opening", bar=shape.bar_m))
        return shape

    def _mission_name(self, root: MapNode, path: Path) -> str:
        """The name in the file or, without one, the file's own name in the form of a mission's."""
        name = self._text(root, "name")
        if not name:
            words = re.sub(r"[^a-z0-9_-]+", "-", path.stem.lower()).strip("-_")
            return words[:80] or "mission"
        if not _MISSION_NAME.match(name):
            code = "mission.name_long" if len(name) > 80 else "mission.name"
            self._problems.add(_value_place(root, "name"), Message(code, name=cut(name, 40)))
        return name

    def _children(self, node: MapNode, key: str) -> dict[str, Node]:
        child = node.items.get(key)
        if child is None:
            return {}
        if not isinstance(child, MapNode):
            if not (isinstance(child, Scalar) and not child.text):
                example = _EXAMPLES.get(key, f"  {key[:-1]}_1:")
                self._problems.add(node.keys[key], Message("key.names_below", key=key, example=example))
            return {}
        for name, place in child.keys.items():
            if not _NAME.match(name):
                self._problems.add(place, Message("key.name", name=cut(name)))
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
        self._problems.add(child.place, Message("key.list", key=key, example=example))
        return ()

    def _text(self, node: MapNode, key: str) -> str:
        child = node.items.get(key)
        if child is None:
            return ""
        if isinstance(child, Scalar):
            return child.text.strip()
        self._problems.add(node.keys[key], Message("key.one_line", key=key))
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
            known = Message("key.choices", choices=" or ".join(choices))
            advice = did_you_mean(text.lower(), choices, known)
            message = Message("key.choice", key=key, text=cut(text, 40), advice=advice)
            self._problems.add(node.items[key].place, message)
        return None

    def _flag(self, node: MapNode, key: str) -> bool:
        text = self._text(node, key).lower()
        if text not in ("", "true", "false"):
            self._problems.add(node.items[key].place, Message("key.flag", key=key, text=cut(text, 30)))
        return text == "true"

    def _check_keys(self, node: MapNode, allowed: tuple[str, ...], what: Message) -> bool:
        """Whether all keys are known."""
        unknown = [key for key in node.keys if key not in allowed]
        if "when" in unknown and "to" in unknown:
            unknown.remove("to")  # it belongs to the same transition
        if len(unknown) > 2:
            del unknown[1:]  # they all stand in the wrong place, for one reason
        for key in unknown:
            self._unknown_key(node, key, allowed, what)
        return not unknown

    def _unknown_key(self, node: MapNode, key: str, allowed: tuple[str, ...], what: Message) -> None:
        synonym = _SYNONYMS.get(key.lower(), "")
        nothing = Message("plain", text="")
        advice = Message("did_you_mean", name=synonym) if synonym in allowed else nothing
        advice = did_you_mean(key.lower(), allowed, advice)
        if advice is nothing and allowed == MISSION_KEYS and isinstance(node.items[key], MapNode):
            advice = Message("key.indent_state")
        elif key in TRANSITION_KEYS:
            advice = Message("key.of_transition", key=key)
        elif key in MISSION_KEYS and key not in (*allowed, *_STATE_KEYS):
            advice = Message("key.of_mission")
        if advice is nothing:
            advice = Message("key.listed", names=", ".join(allowed))
        self._problems.add(node.keys[key], Message("key.unknown", what=what, key=cut(key, 30), advice=advice))


def _key_place(node: Node, key: str) -> Place:
    """Where a key stands; without it, where its node begins."""
    return node.keys[key] if isinstance(node, MapNode) and key in node.keys else node.place


def _value_place(node: MapNode, key: str) -> Place:
    """Where the value of a key stands; without it, where the mapping begins."""
    return node.items[key].place if key in node.items else node.place


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
