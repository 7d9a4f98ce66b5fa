"""YAML text to a tree of plain nodes that remember their lines. No tags, no aliases, bounded in size."""

from __future__ import annotations

from dataclasses import dataclass, replace

import yaml

from offboard.chart.problems import MissionError, Place, Problem, ProblemList
from offboard.chart.yaml_faults import explain

MAX_FILE_BYTES = 1_000_000
MAX_DEPTH = 40


@dataclass(frozen=True, slots=True)
class Scalar:
    """A text as written, without YAML's guess at its type (so that `on` stays `on`).

    Attributes:
        place: of its first character.
        quoted: it stands in quotation marks, which are not part of the text.
    """

    place: Place
    text: str
    quoted: bool = False


@dataclass(frozen=True, slots=True)
class ListNode:
    """A YAML list."""

    place: Place
    items: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class MapNode:
    """A YAML mapping; `keys` has the place of each key."""

    place: Place
    items: dict[str, Node]
    keys: dict[str, Place]


Node = Scalar | ListNode | MapNode


def parse(text: str, file: str, keys: tuple[str, ...]) -> MapNode:
    """Read YAML text whose outermost node is a mapping.

    Args:
        text: the document.
        file: the name to report problems with.
        keys: that the outermost mapping may have.

    Raises:
        MissionError: bad syntax, an alias, a key written twice, too deep, too large, not a mapping.
    """
    if len(text.encode()) > MAX_FILE_BYTES:
        raise _error(
            Place(file), f"is larger than {MAX_FILE_BYTES // 1_000_000} MB; a mission is a page or two"
        )
    try:
        _refuse_aliases_and_depth(text, file)
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        line, column, what = explain(text, error, keys)
        raise _error(Place(file, line, column), what) from None
    if root is None:
        raise _error(Place(file, 1), "is empty; `framerunner mission new NAME` writes one to begin with")
    if not isinstance(root, yaml.MappingNode):
        raise _error(Place(file, 1), "a mission begins with 'name: ...', then 'initial: ...' and 'states:'")
    problems = ProblemList()
    tree = _convert(root, file, problems)
    problems.raise_if_any()
    assert isinstance(tree, MapNode)
    return tree


def _refuse_aliases_and_depth(text: str, file: str) -> None:
    depth = 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        place = _place(event, file)
        if isinstance(event, yaml.AliasEvent):
            raise _error(place, f"alias '*{event.anchor}' is not allowed; use a template instead")
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > MAX_DEPTH:
                raise _error(place, f"nested deeper than {MAX_DEPTH} levels")
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1


def _convert(node: yaml.Node, file: str, problems: ProblemList) -> Node:
    place = _place(node, file)
    if isinstance(node, yaml.ScalarNode):
        if node.tag.startswith("!"):  # YAML takes the word after a '!' for a type; it is meant as written
            return Scalar(place, f"{node.tag} {node.value}".strip())
        quoted = node.style in ("'", '"')
        if node.start_mark.line != node.end_mark.line:
            place = replace(place, column=0)  # characters cannot be counted over several lines
        return Scalar(place.moved(quoted), node.value, quoted)
    if isinstance(node, yaml.SequenceNode):
        return ListNode(place, tuple(_convert(item, file, problems) for item in node.value))
    items: dict[str, Node] = {}
    keys: dict[str, Place] = {}
    for key_node, value_node in node.value:
        key_place = _place(key_node, file)
        if not isinstance(key_node, yaml.ScalarNode):
            problems.add(key_place, "a key must be a plain word")
            continue
        key = key_node.value
        if key in items:
            problems.add(key_place, f"'{key}' stands twice (first in line {keys[key].line}); rename one")
        items[key] = _convert(value_node, file, problems)
        keys[key] = key_place
    return MapNode(place, items, keys)


def _place(part: yaml.Node | yaml.Event, file: str) -> Place:
    mark = part.start_mark
    return Place(file, mark.line + 1, mark.column + 1) if mark else Place(file)


def _error(place: Place, text: str) -> MissionError:
    return MissionError([Problem(place, text)])
