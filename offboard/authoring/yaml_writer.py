"""Writes values as YAML: on lines of their own, or in braces and brackets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from framerunner.files.yaml_text import ListNode, MapNode, Scalar, YamlError, compose
from offboard.authoring.edit_texts import EditError

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
    return text if _is_plain(text, in_braces) else "'" + text.replace("'", "''") + "'"


def _is_plain(text: str, in_braces: bool) -> bool:
    """Whether a text needs no quotation marks as an item of a list and, not in braces, as a key's value."""
    try:
        root = compose(f"[{text}]\n" if in_braces else f"- {text}\n- a: {text}\n")
    except YamlError:
        return False
    nodes = list(root.items) if isinstance(root, ListNode) else []
    if not in_braces and len(nodes) == 2 and isinstance(nodes[1], MapNode):
        nodes[1:] = nodes[1].items.values()
    texts = [node.text for node in nodes if isinstance(node, Scalar) and not (node.quoted or node.block)]
    return bool(text) and len(nodes) == len(texts) and texts == [text] * (1 if in_braces else 2)


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
