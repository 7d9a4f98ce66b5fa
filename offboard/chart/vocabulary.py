"""The names a mission may use, read off the Pilot class: attributes, properties, methods, and their types."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Mapping
from difflib import get_close_matches
from typing import get_args, get_origin, get_type_hints

from offboard.chart.hints import hint_for_action
from offboard.chart.problems import cut
from offboard.pilot import Memory, Pilot
from scenarios.models import COLOURS

WRITABLE = ("cmd", "colour", "goal_m", "memory")
"""What of the pilot a mission may assign to; all else is the world's or the engine's."""


class UnknownNameError(Exception):
    """A name that does not exist, with what does, in one line."""


class Vocabulary:
    """Names and types reachable from a pilot."""

    def __init__(self, pilot_class: type[Pilot], variables: Mapping[str, object]) -> None:
        """Read a pilot class.

        Args:
            pilot_class: `Pilot` or a subclass with more primitives.
            variables: the mission's own variables.
        """
        self._pilot_class = pilot_class
        self._variables = variables
        self.primitives = {
            name: inspect.getdoc(member) or ""
            for name, member in inspect.getmembers(pilot_class, inspect.isfunction)
            if not name.startswith("_")
        }
        self.values = _plain_attributes(pilot_class) | _typed_names(pilot_class)

    def check_primitive(self, name: str) -> None:
        """Refuse an action that is no method of the pilot.

        Raises:
            UnknownNameError: with the nearest name or all of them.
        """
        if name in self.primitives:
            needed = _needed_values(self._pilot_class, name)
            if needed:
                raise UnknownNameError(f"'{name}' needs {needed}, but an action is called without values")
            return
        if name in self.values:
            raise UnknownNameError(f"'{name}' is a value, not an action; write 'location = expression'")
        mend = hint_for_action(name, tuple(self.primitives)) or self._mend(name, list(self.primitives))
        raise UnknownNameError(f"unknown action '{cut(name)}'; {mend}")

    def type_of(self, path: tuple[str, ...]) -> object:
        """Type at the end of a dotted path such as ("cam", "red", "d"); `object` where nothing is declared.

        Raises:
            UnknownNameError: with what the class before the unknown part has.
        """
        kind: object = self._pilot_class
        for name in path:
            names = self._names_of(kind)
            if name not in names:
                raise UnknownNameError(self._unknown(path[: path.index(name)], kind, name, list(names)))
            kind = names[name]
        return kind

    def parts_of(self, path: tuple[str, ...]) -> list[str]:
        """Names of what a value consists of; none of a plain value.

        Raises:
            UnknownNameError: it does not exist.
        """
        return list(self._names_of(self.type_of(path)))

    def check_assignable(self, path: tuple[str, ...]) -> None:
        """Refuse an assignment to what the mission does not own.

        Raises:
            UnknownNameError: unknown, or known but not the mission's to set.
        """
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
            return f"unknown name '{cut(name)}'; {self._likely(name) or self._mend(name, names)}"
        if kind is Memory:
            listed = " ".join(names) or "none"
            near = get_close_matches(name, names, 1)
            mend = f"did you mean 'memory.{near[0]}'?" if near else f"declared under 'variables': {listed}"
            return f"no variable '{cut(name)}'; {mend}"
        shown = ".".join(owner)
        if not names:
            return f"'{shown}' has no '{name}'; it is a plain value"
        near = get_close_matches(name.lower(), names, 1)
        mend = f"did you mean '{shown}.{near[0]}'?" if near else f"it has {' '.join(names)}"
        return f"'{shown}' has no '{name}'; {mend}"

    def _likely(self, name: str) -> str:
        """What is meant by an unknown name that is another language's, a colour's or only a part of one."""
        if name.lower() in ("true", "false"):
            return f"write {name.capitalize()}"
        if name.lower() in COLOURS:
            return f"texts stand in quotes: '{name.lower()}'"
        if name in self._variables:
            return f"write memory.{name}"
        whole = [
            f"{owner}.{name}"
            for owner in ("cmd", "imu", "frame")
            if owner in self.values and name in self._names_of(self.values[owner])
        ]
        return f"did you mean {' or '.join(map(repr, whole))}?" if whole else ""

    def _mend(self, name: str, names: list[str]) -> str:
        plain = re.sub(r"[^a-z0-9]+", "_", name.lower())
        near = get_close_matches(plain, names, 1) or get_close_matches(name, names, 1)
        if near:
            return f"did you mean '{near[0]}'?"
        adds = "; what a Python file adds needs --pilot FILE.py" if self._pilot_class is Pilot else ""
        return f"there are {' '.join(names)}{adds}"


def path_of(node: ast.AST) -> tuple[str, ...]:
    """The parts of a dotted name; of what is none, the parts behind its last dot."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    if isinstance(node, ast.Name):
        parts.append(node.id)
    return tuple(reversed(parts))


def choices_of(kind: object) -> tuple[object, ...]:
    """Values a type allows, if it is a Literal; else none."""
    return get_args(kind) if str(get_origin(kind)).endswith("Literal") else ()


def _plain_attributes(pilot_class: type[Pilot]) -> dict[str, object]:
    """Class attributes that a contestant wrote without a type (`gain = 0.5`), with the type they have."""
    members = inspect.getmembers(
        pilot_class, lambda member: isinstance(member, bool | int | float | str | tuple)
    )
    return {name: type(member) for name, member in members if not name.startswith("_")}


def _needed_values(pilot_class: type[Pilot], name: str) -> str:
    """Names of the parameters that a method cannot do without, but for `self`."""
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
