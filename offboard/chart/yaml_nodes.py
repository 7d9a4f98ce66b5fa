"""YAML text to nodes with their lines, and YAML's syntax errors in words for people who do not know YAML.

No tags, no aliases, bounded in depth. YAML's parser reports what it expected, often lines after the fault.
The text mostly shows what was meant, so the messages are made from the text.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import yaml

from offboard.chart.problems import Place, ProblemList, mission_error

MAX_DEPTH = 40
_KEY = re.compile(r"\s*(?:-\s+)?([\w.]+)\s*:(?:\s|$)")
_TWO_COLONS = re.compile(r"\s*(?:-\s+)?[\w.]+\s*:\s+[^\s'\"#][^'\"#]*:(?:\s|$)")
_NO_SPACE = re.compile(r"\s*(?:-\s+)?(\w+):([^\s:]+)\s*(?:#.*)?$")
_SPECIAL_SPACE = re.compile(r"[ ]*[\u00a0\u2000-\u200b\u202f\u3000]")

Fault = tuple[int, int, str]
"""Line and column, counted from 1 (0 if not known), and what to do."""


@dataclass(frozen=True, slots=True)
class Scalar:
    """A text as written, not converted to YAML's types (so that `on` stays `on`).

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


def parse_yaml(text: str, file: str, keys: tuple[str, ...]) -> MapNode:
    """Read YAML text whose outermost node is a mapping.

    Args:
        text: the document.
        file: the name for problems.
        keys: that the outermost mapping may have.

    Raises:
        MissionError: bad syntax, an alias, a key written twice, too deep, not a mapping.
    """
    try:
        _refuse_aliases_and_depth(text, file)
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        line, column, what = _syntax_fault(text, error, keys)
        raise mission_error(Place(file, line, column), what) from None
    if root is None:
        raise mission_error(Place(file, 1), "is empty; `framerunner mission new NAME` writes a first one")
    if not isinstance(root, yaml.MappingNode):
        advice = "a mission begins with 'name: ...', then 'initial: ...' and 'states:'"
        raise mission_error(Place(file, 1), advice)
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
            raise mission_error(place, f"alias '*{event.anchor}' is not allowed; use a template instead")
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > MAX_DEPTH:
                raise mission_error(place, f"nested deeper than {MAX_DEPTH} levels")
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
            problems.add(key_place, f"'{key}' is written twice (first in line {keys[key].line}); rename one")
        items[key] = _convert(value_node, file, problems)
        keys[key] = key_place
    return MapNode(place, items, keys)


def _place(part: yaml.Node | yaml.Event, file: str) -> Place:
    mark = part.start_mark
    return Place(file, mark.line + 1, mark.column + 1) if mark else Place(file)


def _syntax_fault(text: str, error: yaml.YAMLError, top_keys: tuple[str, ...]) -> Fault:
    """What is wrong with a text that is not YAML; `top_keys` may stand at the beginning of a line."""
    lines = text.split("\n")
    mark = getattr(error, "problem_mark", None)
    context = getattr(error, "context_mark", None)
    what = getattr(error, "problem", None) or getattr(error, "reason", None) or "cannot be read"
    if mark is None:
        return 0, 0, f"YAML syntax: {what}"
    spaces = _wrong_space(lines, mark)
    if spaces is not None:
        return spaces
    if "mapping values" in what and _TWO_COLONS.match(_line(lines, mark.line)):
        advice = "a second ':' in this line; write what follows it in the next line"
        return mark.line + 1, mark.column + 1, advice
    if "mapping values" in what or "expected <block end>" in what:
        return _wrong_indentation(lines, mark.line, top_keys)
    if what == "could not find expected ':'" and context is not None:
        return _missing_colon(lines, context.line)
    place, advice = mark, f"YAML syntax: {what}"
    if "found unexpected end of stream" in what and context is not None:
        place, advice = context, "this quotation mark is never closed; write another at the end"
    elif "cannot start any token" in what:
        sign = _line(lines, mark.line)[mark.column : mark.column + 1]
        advice = f"'{sign}' cannot stand here; put the text in \"quotation marks\""
    return place.line + 1, place.column + 1, advice


def _wrong_space(lines: list[str], mark: yaml.Mark) -> Fault | None:
    """A tab, or a character that only looks like a space."""
    line = _line(lines, mark.line)
    if line[mark.column : mark.column + 1] == "\t" or "\t" in line[: _indent_of(line) + 1]:
        return mark.line + 1, line.index("\t") + 1, "there is a tab; write spaces instead"
    for number, each in enumerate(lines[: mark.line + 1]):
        if _SPECIAL_SPACE.match(each):
            text = "this line begins with special spaces, as copied from a web page; write plain ones"
            return number + 1, 1, text
    return None


def _missing_colon(lines: list[str], index: int) -> Fault:
    line = _line(lines, index)
    found = _NO_SPACE.match(line)
    if found:
        key, value = found.groups()
        return index + 1, found.start(2) + 1, f"a space is missing after ':'; write '{key}: {value}'"
    if line.lstrip().startswith("-"):
        return index + 1, _indent_of(line) + 1, "begin each line of a list with '- ', under the line above it"
    return index + 1, len(line.rstrip()) + 1, f"a ':' is missing; write '{line.strip()[:40]}:'"


def _wrong_indentation(lines: list[str], index: int, top_keys: tuple[str, ...]) -> Fault:
    """A line that stands neither under nor beside the ones above it."""
    for number, line in enumerate(lines[: index + 1]):  # the fault may be far above, where a block was ended
        found = re.match(r"([\w.]+)\s*:", line)
        if found and found.group(1) not in top_keys and number > 0:
            text = f"'{found.group(1)}' must be indented, to stand under the line it belongs to"
            return number + 1, 1, text
    line = _line(lines, index)
    own, fitting = _indent_of(line), _open_indents(lines[:index])
    if own in fitting and _KEY.match(line):
        return index + 1, own + 1, "lines with and without '- ' are mixed here; write all of them alike"
    if own in fitting:
        return index + 1, own + 1, "this line does not fit under the one above; is a ':' or a '- ' missing?"
    *others, last = map(str, fitting or [0])
    known = f"{', '.join(others)} or {last}" if others else last
    spaces = "no space" if own == 0 else "1 space" if own == 1 else f"{own} spaces"
    return index + 1, own + 1, f"wrong indentation: {spaces}; the lines above have {known}"


def _open_indents(lines: list[str]) -> list[int]:
    """Indentations of the blocks that are open after some lines, the outermost first."""
    found: list[int] = []
    for line in reversed(lines):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        for indent in (_indent_of(line), len(line) - len(line.lstrip(" "))):
            if not found or indent < found[-1]:
                found.append(indent)
    return found[:4][::-1]


def _indent_of(line: str) -> int:
    """Number of spaces before the first word of a line, including a dash before it."""
    found = re.match(r"[ ]*(?:-[ ]+)*", line)
    return found.end() if found else 0


def _line(lines: list[str], index: int) -> str:
    return lines[index] if index < len(lines) else ""
