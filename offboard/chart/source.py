"""YAML text to a tree of plain nodes that remember their lines. No tags, no aliases, bounded in size."""

from __future__ import annotations

from dataclasses import dataclass

import yaml

from offboard.chart.problems import MissionError, Place, Problem, ProblemList

MAX_FILE_BYTES = 1_000_000
MAX_DEPTH = 40


@dataclass(frozen=True, slots=True)
class Scalar:
    """A text as written, without YAML's guess at its type (so that `on` stays `on`)."""

    place: Place
    text: str


@dataclass(frozen=True, slots=True)
class ListNode:
    """A YAML list."""

    place: Place
    items: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class MapNode:
    """A YAML mapping; `keys` has the line of each key."""

    place: Place
    items: dict[str, Node]
    keys: dict[str, Place]


Node = Scalar | ListNode | MapNode


def parse(text: str, file: str) -> MapNode:
    """Read YAML text whose outermost node is a mapping.

    Args:
        text: the document.
        file: the name to report problems with.

    Raises:
        MissionError: bad syntax, an alias, a key written twice, too deep, too large, not a mapping.
    """
    if len(text.encode()) > MAX_FILE_BYTES:
        raise _error(
            Place(file), f"is larger than {MAX_FILE_BYTES // 1_000_000} MB; a mission is a page or two"
        )
    _refuse_aliases_and_depth(text, file)
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        raise _syntax_error(error, file) from None
    if not isinstance(root, yaml.MappingNode):
        raise _error(Place(file, 1), "a mission is a mapping: name, initial, states, ...")
    problems = ProblemList()
    tree = _convert(root, file, problems)
    problems.raise_if_any()
    assert isinstance(tree, MapNode)
    return tree


def _refuse_aliases_and_depth(text: str, file: str) -> None:
    depth = 0
    try:
        for event in yaml.parse(text, Loader=yaml.SafeLoader):
            place = Place(file, event.start_mark.line + 1 if event.start_mark else 0)
            if isinstance(event, yaml.AliasEvent):
                raise _error(place, f"alias '*{event.anchor}' is not allowed; use a template instead")
            if isinstance(event, yaml.CollectionStartEvent):
                depth += 1
                if depth > MAX_DEPTH:
                    raise _error(place, f"nested deeper than {MAX_DEPTH} levels")
            elif isinstance(event, yaml.CollectionEndEvent):
                depth -= 1
    except yaml.YAMLError as error:
        raise _syntax_error(error, file) from None


def _convert(node: yaml.Node, file: str, problems: ProblemList) -> Node:
    place = Place(file, node.start_mark.line + 1)
    if isinstance(node, yaml.ScalarNode):
        return Scalar(place, node.value)
    if isinstance(node, yaml.SequenceNode):
        return ListNode(place, tuple(_convert(item, file, problems) for item in node.value))
    items: dict[str, Node] = {}
    keys: dict[str, Place] = {}
    for key_node, value_node in node.value:
        key_place = Place(file, key_node.start_mark.line + 1)
        if not isinstance(key_node, yaml.ScalarNode):
            problems.add(key_place, "a key must be a plain word")
            continue
        key = key_node.value
        if key in items:
            problems.add(key_place, f"'{key}' stands twice (first in line {keys[key].line}); rename one")
        items[key] = _convert(value_node, file, problems)
        keys[key] = key_place
    return MapNode(place, items, keys)


def _syntax_error(error: yaml.YAMLError, file: str) -> MissionError:
    mark = getattr(error, "problem_mark", None)
    line = mark.line + 1 if mark else 0
    what = getattr(error, "problem", None) or getattr(error, "reason", None) or "cannot be read"
    return _error(Place(file, line), f"YAML syntax: {what}")


def _error(place: Place, text: str) -> MissionError:
    return MissionError([Problem(place, text)])
