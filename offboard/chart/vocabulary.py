"""The names a mission may use: attributes, properties and methods of the Pilot class, and their types."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Mapping
from typing import get_args, get_origin

from offboard.chart.described import ValueDescription, descriptions
from offboard.chart.mission_texts import Message
from offboard.chart.problems import cut, did_you_mean
from offboard.pilot import Memory, Pilot
from scenarios.models import COLOURS

WRITABLE = ("cmd", "colour", "goal_m", "memory")
"""What a mission may assign to; all else of the pilot is set by the engine."""
MAX_ACTION_CHARACTERS = 200
"""Of an unknown action that is searched for what was meant."""
_MISTAKES_IN_ACTIONS = (
    (":=", "action.walrus"),
    ("==", "action.equal"),
    (r"^[a-z][\w.]*\s*:", "action.colon_sign"),
    (r"[,;]|\band\b|\s-\s", "action.one_a_line"),
)


class UnknownNameError(Exception):
    """A name that does not exist or cannot be used so; the message says in one line what to write."""

    def __init__(self, message: Message) -> None:
        super().__init__(str(message))
        self.message = message


class Vocabulary:
    """Names and types reachable from a pilot.

    Args:
        pilot_class: `Pilot` or a subclass with more primitives.
        variables: the mission's own variables.
        contest: the mission flies by the limits of the class `contest`.

    Attributes:
        primitives: docstrings of the methods by name.
        values: types of the attributes and properties by name.
    """

    def __init__(
        self, pilot_class: type[Pilot], variables: Mapping[str, object], *, contest: bool = True
    ) -> None:
        self.contest = contest
        self._pilot_class = pilot_class
        self._variables = variables
        self.primitives = {
            name: inspect.getdoc(member) or ""
            for name, member in inspect.getmembers(pilot_class, inspect.isfunction)
            if not name.startswith("_")
        }
        self.values = _typed_names(pilot_class)

    def check_primitive(self, name: str) -> None:
        """Refuse an action that is no method of the pilot. Raises `UnknownNameError`."""
        if name in self.primitives:
            needed = _needed_values(self._pilot_class, name)
            if needed:
                raise UnknownNameError(Message("name.needs_values", name=name, needed=needed))
            return
        if name in self.values:
            raise UnknownNameError(Message("name.value_as_action", name=name))
        advice = self._mistake_in(name[:MAX_ACTION_CHARACTERS]) or self._similar(name, list(self.primitives))
        raise UnknownNameError(Message("name.unknown_action", name=cut(name), advice=advice))

    def type_of(self, path: tuple[str, ...]) -> object:
        """Type of a name such as ("cam", "red", "d"), `object` if not declared. Raises `UnknownNameError`."""
        kind: object = self._pilot_class
        for name in path:
            names = self._names_of(kind)
            if name not in names:
                raise UnknownNameError(self._unknown(path[: path.index(name)], kind, name, list(names)))
            kind = names[name]
        return kind

    def described(self, path: tuple[str, ...]) -> ValueDescription:
        """What is known of a name; the least if it is a variable's. Raises `UnknownNameError`."""
        kind = self.type_of(path)
        owner = self.type_of(path[:-1]) if len(path) > 1 else self._pilot_class
        if not isinstance(owner, type) or owner is Memory:
            return ValueDescription(kind)
        return descriptions(owner).get(path[-1], ValueDescription(kind))

    def parts_of(self, path: tuple[str, ...]) -> list[str]:
        """Names of a value's parts; none of a plain value. Raises `UnknownNameError`."""
        return list(self._names_of(self.type_of(path)))

    def check_assignable(self, path: tuple[str, ...]) -> None:
        """Refuse an assignment to a name that is unknown or can only be read. Raises `UnknownNameError`."""
        name = ".".join(path)
        if path[0] == "goal_m" and len(path) > 1:
            raise UnknownNameError(Message("name.goal_whole"))
        kind = self.type_of(path)
        if path in (("cmd",), ("memory",)):
            parts = " ".join(f"{name}.{part}" for part in self._names_of(kind)) or "its variables"
            raise UnknownNameError(Message("name.not_whole", name=name, parts=parts))
        if path[0] not in WRITABLE:
            raise UnknownNameError(Message("name.read_only", name=name))

    def _names_of(self, kind: object) -> dict[str, object]:
        if kind is self._pilot_class:
            return self.values
        if kind is Memory:
            return {name: type(value) for name, value in self._variables.items()}
        return _typed_names(kind) if isinstance(kind, type) and get_origin(kind) is None else {}

    def _unknown(self, owner: tuple[str, ...], kind: object, name: str, names: list[str]) -> Message:
        if kind is self._pilot_class:
            if name in self.primitives:
                return Message("name.action_as_value", name=name)
            advice = self._likely(name) or self._similar(name, names)
            return Message("name.unknown", name=cut(name), advice=advice)
        if kind is Memory:
            declared = Message("name.declared", names=" ".join(names) or "none")
            advice = did_you_mean(name, names, declared, "memory.")
            return Message("name.no_variable", name=cut(name), advice=advice)
        shown = ".".join(owner)
        advice = Message("name.plain")
        if names:
            parts = Message("name.parts", names=" ".join(names))
            advice = did_you_mean(name.lower(), names, parts, f"{shown}.")
        return Message("name.no_part", owner=cut(shown), name=cut(name), advice=advice)

    def _mistake_in(self, action: str) -> Message | None:
        """What to write instead of an action that does not exist; None if that cannot be seen."""
        changed = re.match(r"([a-z][\w.]*)\s*([-+*/])=\s*(.+)", action)
        if changed:
            name, sign, value = changed.groups()
            return Message("action.in_full", name=name, sign=sign, value=cut(value))
        called = re.match(r"(\w+)\s*\((.*)\)?\s*$", action)
        if called and called.group(1) in self.primitives:
            if not called.group(2).strip(" )"):
                return Message("action.parentheses", name=called.group(1))
            goal = "_goal" if called.group(1) == "fly_to_goal" else ""
            return Message(f"action.no_values{goal}", name=called.group(1))
        codes = (code for pattern, code in _MISTAKES_IN_ACTIONS if re.search(pattern, action))
        code = next(codes, None)
        return None if code is None else Message(code)

    def _likely(self, name: str) -> Message | None:
        """What to write instead of an unknown name of another language, of a colour or without its owner."""
        if name.lower() in ("true", "false"):
            return Message("name.capital", name=name.capitalize())
        if name.lower() in COLOURS:
            return Message("name.quotes", name=name.lower())
        if name in self._variables:
            return Message("name.memory", name=name)
        whole = [
            f"{owner}.{name}"
            for owner in ("cmd", "imu", "frame")
            if owner in self.values and name in self._names_of(self.values[owner])
        ]
        return Message("did_you_mean_one_of", names=" or ".join(map(repr, whole))) if whole else None

    def _similar(self, name: str, names: list[str]) -> Message:
        code = "name.known_pilot" if self._pilot_class is Pilot else "name.known"
        otherwise = did_you_mean(name, names, Message(code, names=" ".join(names)))
        return did_you_mean(re.sub(r"[^a-z0-9]+", "_", name.lower()), names, otherwise)


def path_of(node: ast.AST) -> tuple[str, ...]:
    """The parts of a dotted name; of another expression, the parts after its last dot."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    if isinstance(node, ast.Name):
        parts.append(node.id)
    return tuple(reversed(parts))


def choices_of(kind: object) -> tuple[object, ...]:
    """Values that a type allows, if it is a Literal; otherwise none."""
    return get_args(kind) if str(get_origin(kind)).endswith("Literal") else ()


def _needed_values(pilot_class: type[Pilot], name: str) -> str:
    """Names of the parameters that a method requires, without `self`."""
    is_static = isinstance(inspect.getattr_static(pilot_class, name), staticmethod)
    parameters = list(inspect.signature(getattr(pilot_class, name)).parameters.values())
    kinds = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    own = parameters if is_static else parameters[1:]
    return ", ".join(each.name for each in own if each.default is each.empty and each.kind not in kinds)


def _typed_names(kind: type) -> dict[str, object]:
    """Public attributes and properties of a class with their declared types, attributes first."""
    return {name: value.type for name, value in descriptions(kind).items()}
