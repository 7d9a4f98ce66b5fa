"""The names a mission may use: attributes, properties and methods of the Pilot class, and their types."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Mapping
from typing import get_args, get_origin, get_type_hints

from offboard.chart.problems import cut, did_you_mean
from offboard.pilot import Memory, Pilot
from scenarios.models import COLOURS

WRITABLE = ("cmd", "colour", "goal_m", "memory")
"""What a mission may assign to; all else of the pilot is set by the engine."""
_MISTAKES_IN_ACTIONS = (
    (":=", "to set a value write '=' instead of ':='"),
    ("==", "'==' compares; to set a value write one '='"),
    (r"^[a-z][\w.]*\s*:", "to set a value write '=' instead of ':'"),
    (r"[,;]|\band\b|\s-\s", "one action a line; begin each line with '- '"),
)


class UnknownNameError(Exception):
    """A name that does not exist or cannot be used so; the message says in one line what to write."""


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
        plain = (bool, int, float, str, tuple)
        untyped = inspect.getmembers(pilot_class, lambda member: isinstance(member, plain))
        self.values: dict[str, object] = {name: type(value) for name, value in untyped if name[0] != "_"}
        self.values |= _typed_names(pilot_class)

    def check_primitive(self, name: str) -> None:
        """Refuse an action that is no method of the pilot. Raises `UnknownNameError`."""
        if name in self.primitives:
            needed = _needed_values(self._pilot_class, name)
            if needed:
                raise UnknownNameError(f"'{name}' needs {needed}, but an action is called without values")
            return
        if name in self.values:
            raise UnknownNameError(f"'{name}' is a value, not an action; write 'location = expression'")
        advice = self._mistake_in(name) or self._similar(name, list(self.primitives))
        raise UnknownNameError(f"unknown action '{cut(name)}'; {advice}")

    def type_of(self, path: tuple[str, ...]) -> object:
        """Type of a name such as ("cam", "red", "d"), `object` if not declared. Raises `UnknownNameError`."""
        kind: object = self._pilot_class
        for name in path:
            names = self._names_of(kind)
            if name not in names:
                raise UnknownNameError(self._unknown(path[: path.index(name)], kind, name, list(names)))
            kind = names[name]
        return kind

    def parts_of(self, path: tuple[str, ...]) -> list[str]:
        """Names of a value's parts; none of a plain value. Raises `UnknownNameError`."""
        return list(self._names_of(self.type_of(path)))

    def check_assignable(self, path: tuple[str, ...]) -> None:
        """Refuse an assignment to a name that is unknown or can only be read. Raises `UnknownNameError`."""
        name = ".".join(path)
        if path[0] == "goal_m" and len(path) > 1:
            raise UnknownNameError("goal_m is set as a whole: goal_m = (x, y, z)")
        kind = self.type_of(path)
        if path in (("cmd",), ("memory",)):
            parts = " ".join(f"{name}.{part}" for part in self._names_of(kind)) or "its variables"
            raise UnknownNameError(f"'{name}' cannot be set as a whole; set {parts}")
        if path[0] not in WRITABLE:
            text = "a mission sets cmd.vel_x and the like, goal_m, colour and memory.<variable>"
            raise UnknownNameError(f"'{name}' can only be read; {text}")

    def _names_of(self, kind: object) -> dict[str, object]:
        if kind is self._pilot_class:
            return self.values
        if kind is Memory:
            return {name: type(value) for name, value in self._variables.items()}
        return _typed_names(kind) if isinstance(kind, type) and get_origin(kind) is None else {}

    def _unknown(self, owner: tuple[str, ...], kind: object, name: str, names: list[str]) -> str:
        if kind is self._pilot_class:
            if name in self.primitives:
                return f"'{name}' is an action, not a value"
            return f"unknown name '{cut(name)}'; {self._likely(name) or self._similar(name, names)}"
        if kind is Memory:
            declared = f"declared under 'variables': {' '.join(names) or 'none'}"
            return f"no variable '{cut(name)}'; {did_you_mean(name, names, declared, 'memory.')}"
        shown = ".".join(owner)
        advice = "it is a plain value"
        if names:
            advice = did_you_mean(name.lower(), names, f"it has {' '.join(names)}", f"{shown}.")
        return f"'{shown}' has no '{name}'; {advice}"

    def _mistake_in(self, action: str) -> str:
        """What to write instead of an action that does not exist; empty if that cannot be seen."""
        changed = re.match(r"([a-z][\w.]*)\s*([-+*/])=\s*(.+)", action)
        if changed:
            name, sign, value = changed.groups()
            return f"write it in full: {name} = {name} {sign} {value}"
        called = re.match(r"(\w+)\s*\((.*)\)?\s*$", action)
        if called and called.group(1) in self.primitives:
            if not called.group(2).strip(" )"):
                return f"write it without parentheses: {called.group(1)}"
            before = "; set goal_m in a line before it" if called.group(1) == "fly_to_goal" else ""
            return f"'{called.group(1)}' takes no values{before}"
        return next((advice for pattern, advice in _MISTAKES_IN_ACTIONS if re.search(pattern, action)), "")

    def _likely(self, name: str) -> str:
        """What to write instead of an unknown name of another language, of a colour or without its owner."""
        if name.lower() in ("true", "false"):
            return f"write {name.capitalize()}"
        if name.lower() in COLOURS:
            return f"write a text in quotes: '{name.lower()}'"
        if name in self._variables:
            return f"write memory.{name}"
        whole = [
            f"{owner}.{name}"
            for owner in ("cmd", "imu", "frame")
            if owner in self.values and name in self._names_of(self.values[owner])
        ]
        return f"did you mean {' or '.join(map(repr, whole))}?" if whole else ""

    def _similar(self, name: str, names: list[str]) -> str:
        adds = "; what a Python file adds needs --pilot FILE.py" if self._pilot_class is Pilot else ""
        otherwise = did_you_mean(name, names, f"there are {' '.join(names)}{adds}")
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
    if kind.__module__ == "builtins":
        return {}
    names = {name: hint for name, hint in get_type_hints(kind).items() if not name.startswith("_")}
    for name, member in inspect.getmembers(kind, lambda member: isinstance(member, property)):
        if not name.startswith("_"):
            names[name] = get_type_hints(member.fget).get("return", object)
    return names
