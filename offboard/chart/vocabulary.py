"""The names a mission may use, read off the Pilot class: attributes, properties, methods, and their types."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from difflib import get_close_matches
from typing import get_args, get_origin, get_type_hints

from offboard.pilot import Memory, Pilot

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
        raise UnknownNameError(f"unknown action '{name}'; {self._mend(name, list(self.primitives))}")

    def type_of(self, path: tuple[str, ...]) -> object:
        """Type at the end of a dotted path such as ("cam", "red", "d"); `object` where nothing is declared.

        Raises:
            UnknownNameError: with what the class before the unknown part has.
        """
        kind: object = self._pilot_class
        for name in path:
            names = self._names_of(kind)
            if name not in names:
                raise UnknownNameError(self._unknown(kind, name, list(names)))
            kind = names[name]
        return kind

    def check_assignable(self, path: tuple[str, ...]) -> None:
        """Refuse an assignment to what the mission does not own.

        Raises:
            UnknownNameError: unknown, or known but not the mission's to set.
        """
        self.type_of(path)
        if path[0] not in WRITABLE or path in (("cmd",), ("memory",)):
            text = "cmd.<rate>, goal_m, colour and memory.<variable>"
            raise UnknownNameError(f"'{'.'.join(path)}' cannot be set; a mission sets {text}")

    def _names_of(self, kind: object) -> dict[str, object]:
        if kind is self._pilot_class:
            return self.values
        if kind is Memory:
            return {name: type(value) for name, value in self._variables.items()}
        return _typed_names(kind) if isinstance(kind, type) and get_origin(kind) is None else {}

    def _unknown(self, kind: object, name: str, names: list[str]) -> str:
        if kind is self._pilot_class:
            if name in self.primitives:
                return f"'{name}' is an action, not a value"
            return f"unknown name '{name}'; {self._mend(name, names)}"
        if kind is Memory:
            listed = " ".join(names) or "none"
            return f"no variable '{name}'; declared under 'variables': {listed}"
        owner = getattr(kind, "__name__", str(kind))
        if not names:
            return f"'{owner}' has no '{name}'; it is a plain value"
        return f"'{owner}' has no '{name}'; it has {' '.join(names)}"

    def _mend(self, name: str, names: list[str]) -> str:
        near = get_close_matches(name, names, 1)
        if near:
            return f"did you mean '{near[0]}'?"
        adds = "; what a Python file adds needs --pilot FILE.py" if self._pilot_class is Pilot else ""
        return f"there are {' '.join(names)}{adds}"


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
