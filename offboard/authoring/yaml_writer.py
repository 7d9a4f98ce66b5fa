"""Writes values as YAML: on lines of their own, or in braces and brackets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import yaml

from offboard.authoring.messages import EditError
from offboard.chart.yaml_nodes import ListNode, MapNode

Value = str | Sequence["Value"] | Mapping[str, "Value"]
"""What is written: a text, a list, or a mapping."""


@dataclass(frozen=True, slots=True)
class Style:
    """How a document is indented.

    Attributes:
        step: spaces before what stands below a key.
        dash: spaces before the dash of a list below one.
    """

    step: int = 2
    dash: int = 2

    def entry(self, key: str, value: Value, indent: int) -> list[str]:
        """The lines of an entry of a mapping."""
        space = " " * indent
        if isinstance(value, str):
            return [f"{space}{key}: {written(value)}" if value else f"{space}{key}:"]
        lines = [f"{space}{key}:"]
        if isinstance(value, Mapping):
            for name, inner in value.items():
                lines += self.entry(name, inner, indent + self.step)
        else:
            for inner in value:
                lines += self.item(inner, indent + self.dash)
        return lines

    def item(self, value: Value, indent: int) -> list[str]:
        """The lines of an item of a list."""
        space = " " * indent
        if isinstance(value, str):
            return [f"{space}- {written(value)}"]
        assert isinstance(value, Mapping)
        lines = [line for name, inner in value.items() for line in self.entry(name, inner, indent + 2)]
        return [f"{space}- {lines[0].lstrip()}", *lines[1:]]


def written(text: str, *, in_braces: bool = False) -> str:
    """A text as YAML reads it back: plain if possible, otherwise in quotation marks. Raises `EditError`."""
    text = text.strip()
    if not text.isprintable():
        raise EditError("edit.control", text=repr(text[:40]))
    around = "[{}]\n" if in_braces else "- {}\n- a: {}\n"
    try:
        events = list(yaml.parse(around.replace("{}", text), Loader=yaml.SafeLoader))
    except yaml.YAMLError:
        events = []
    values = [(e.value, e.tag, e.anchor, e.style) for e in events if isinstance(e, yaml.ScalarEvent)]
    plain = (text, None, None)
    wanted = [plain] if in_braces else [plain, ("a", None, None), plain]
    if text and [value[:3] for value in values] == wanted and values[0][3] in (None, ""):
        return text
    return "'" + text.replace("'", "''") + "'"


def flow(value: Value) -> str:
    """A value in braces and brackets, in one line."""
    if isinstance(value, str):
        return written(value, in_braces=True) if value else ""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {flow(inner)}".strip() for key, inner in value.items()) + "}"
    return "[" + ", ".join(flow(inner) for inner in value) + "]"


def style_of(root: MapNode | None) -> Style:
    """How a document is indented, by its first mapping and its first list below keys."""
    step = dash = None
    pending: list[MapNode] = [root] if root is not None else []
    while pending and (step is None or dash is None):
        node = pending.pop(0)
        for name, key in node.key_nodes.items():
            value = node.items[name]
            if isinstance(value, MapNode) and value.key_nodes and not value.flow:
                first = next(iter(value.keys.values()))
                step = first.column - key.place.column if step is None else step
                pending.append(value)
            elif isinstance(value, ListNode) and not value.flow and dash is None:
                dash = value.place.column - key.place.column
    return Style(step or 2, 2 if dash is None else dash)
