"""YAML text to nodes with their lines, and YAML's syntax errors in words for people who do not know YAML.

No tags, no aliases, bounded in depth. YAML's parser reports what it expected, often lines after the fault.
The text mostly shows what was meant, so the messages are made from the text.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import cast

import yaml
from yaml.error import MarkedYAMLError

from offboard.chart.messages import Message
from offboard.chart.problems import Place, ProblemList, mission_error

MAX_DEPTH = 40
MAX_NODES = 20_000
MAX_EXPLAINED_CHARACTERS = 100_000
_FAST_LOADER: type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_KEY = re.compile(r"\s*(?:-\s+)?([\w.]+)\s*:(?:\s|$)")
_TWO_COLONS = re.compile(r"\s*(?:-\s+)?[\w.]+\s*:\s+[^\s'\"#][^'\"#]*:(?:\s|$)")
_NO_SPACE = re.compile(r"\s*(?:-\s+)?(\w+):([^\s:]+)\s*(?:#.*)?$")
_SPECIAL_SPACE = re.compile(r"[ ]*[\u00a0\u2000-\u200b\u202f\u3000]")

Fault = tuple[int, int, Message]
"""Line and column, counted from 1 (0 if not known), and what to do."""


@dataclass(frozen=True, slots=True)
class Scalar:
    """A text as written, not converted to YAML's types (so that `on` stays `on`).

    Attributes:
        place: of its first character.
        quoted: it stands in quotation marks, which are not part of the text.
        start, end: offsets in the document, quotation marks included.
        block: it is written with `|` or `>`.
    """

    place: Place
    text: str
    quoted: bool = False
    start: int = 0
    end: int = 0
    block: bool = False


@dataclass(frozen=True, slots=True)
class ListNode:
    """A YAML list; `end` is that of its last item or, of a list in brackets, after the bracket."""

    place: Place
    items: tuple[Node, ...]
    start: int = 0
    end: int = 0
    flow: bool = False


@dataclass(frozen=True, slots=True)
class MapNode:
    """A YAML mapping; `keys` has the place of each key, `key_nodes` the key itself."""

    place: Place
    items: dict[str, Node]
    keys: dict[str, Place]
    key_nodes: dict[str, Scalar] = field(default_factory=dict)
    start: int = 0
    end: int = 0
    flow: bool = False


Node = Scalar | ListNode | MapNode


def parse_yaml(text: str, file: str, keys: tuple[str, ...]) -> MapNode:
    """Read YAML text whose outermost node is a mapping.

    Args:
        text: the document, its lines ended by a line feed.
        file: the name for problems.
        keys: that the outermost mapping may have.

    Raises:
        MissionError: bad syntax, an alias, a key written twice, too deep, not a mapping.
    """
    problems = ProblemList()
    try:
        tree = _Composer(text, file, problems, _loader_for(text)).document()
    except yaml.YAMLError as error:
        line, column, what = _syntax_fault(text, _explained(text, error), keys)
        raise mission_error(Place(file, line, column), what) from None
    if tree is None:
        raise mission_error(Place(file, 1), Message("yaml.empty"))
    if not isinstance(tree, MapNode):
        raise mission_error(Place(file, 1), Message("yaml.no_mapping"))
    problems.raise_if_any()
    return tree


def _loader_for(text: str) -> type[yaml.SafeLoader]:
    """Libyaml's parser, which is ten times faster; it takes a tab for a space, where PyYAML's refuses it."""
    return yaml.SafeLoader if "\t" in text and len(text) <= MAX_EXPLAINED_CHARACTERS else _FAST_LOADER


def _explained(text: str, error: yaml.YAMLError) -> yaml.YAMLError:
    """The error of the parser written in Python, which says more; it is too slow for a long text."""
    if len(text) <= MAX_EXPLAINED_CHARACTERS:
        try:
            for _ in yaml.parse(text, Loader=yaml.SafeLoader):
                pass
        except yaml.YAMLError as explained:
            return explained
    return error


class _Composer:
    """Makes nodes from the parser's events; it stops at the first alias and at the first node too deep."""

    def __init__(self, text: str, file: str, problems: ProblemList, loader: type[yaml.SafeLoader]) -> None:
        self._text = text
        self._file = file
        self._problems = problems
        self._events = yaml.parse(text, Loader=loader)
        self._depth = 0
        self._nodes = 0

    def document(self) -> Node | None:
        """The outermost node; None if the text has none."""
        root: Node | None = None
        for event in self._events:
            if isinstance(event, yaml.DocumentStartEvent):
                if root is not None:
                    mark = cast("yaml.Mark", event.start_mark)
                    raise MarkedYAMLError(problem="but found another document", problem_mark=mark)
                root = self._node(next(self._events))
        empty = isinstance(root, Scalar) and not root.text and not root.quoted
        return None if empty else root

    def _node(self, event: yaml.Event) -> Node:
        place = self._place(event)
        self._nodes += 1
        if self._nodes > MAX_NODES:
            raise mission_error(Place(self._file), Message("yaml.too_many", limit=MAX_NODES))
        if isinstance(event, yaml.AliasEvent):
            raise mission_error(place, Message("yaml.alias", name=event.anchor))
        if isinstance(event, yaml.ScalarEvent):
            return self._scalar(event, place)
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise mission_error(place, Message("yaml.depth", limit=MAX_DEPTH))
        is_list = isinstance(event, yaml.SequenceStartEvent)
        node = self._list(event, place) if is_list else self._map(event, place)
        self._depth -= 1
        return node

    def _scalar(self, event: yaml.ScalarEvent, place: Place) -> Scalar:
        start, end, text = _start(event), _end(event), event.value
        block, quoted = event.style in ("|", ">"), event.style in ("'", '"')
        if block:
            end = start + len(self._text[start:end].rstrip())
        if event.tag and event.tag.startswith("!"):  # a word after a '!' is a type in YAML; here it is text
            return Scalar(place, f"{event.tag} {text}".strip(), start=start, end=end, block=block)
        if "\n" in self._text[start:end]:
            place = replace(place, column=0)  # characters cannot be counted over several lines
        return Scalar(place.moved(quoted), text, quoted, start, end, block)

    def _list(self, event: yaml.Event, place: Place) -> ListNode:
        items: list[Node] = []
        start = end = _start(event)
        while not isinstance(inner := next(self._events), yaml.SequenceEndEvent):
            items.append(self._node(inner))
            end = items[-1].end
        flow = _is_flow(event)
        return ListNode(place, tuple(items), start, _end(inner) if flow else end, flow)

    def _map(self, event: yaml.Event, place: Place) -> MapNode:
        items: dict[str, Node] = {}
        keys: dict[str, Scalar] = {}
        start = end = _start(event)
        while not isinstance(inner := next(self._events), yaml.MappingEndEvent):
            key_place = self._place(inner)
            key_node, value = self._node(inner), self._node(next(self._events))
            if isinstance(value, Scalar) and value.start == value.end:
                after_colon = self._text.find(":", key_node.end, value.start + 1) + 1
                value = replace(value, start=after_colon or key_node.end, end=after_colon or key_node.end)
            end = max(end, key_node.end, value.end)
            if not isinstance(key_node, Scalar):
                self._problems.add(key_place, Message("yaml.key_no_word"))
                continue
            key = key_node.text
            if self._problems.full:
                self._problems.raise_if_any()
            if key in items:
                self._problems.add(key_place, Message("yaml.key_twice", key=key, line=keys[key].place.line))
            items[key] = value
            keys[key] = key_node if key_node.place == key_place else replace(key_node, place=key_place)
        flow = _is_flow(event)
        end = _end(inner) if flow else end
        return MapNode(place, items, {key: node.place for key, node in keys.items()}, keys, start, end, flow)

    def _place(self, event: yaml.Event) -> Place:
        mark = event.start_mark
        return Place(self._file, mark.line + 1, mark.column + 1) if mark else Place(self._file)


def _start(event: yaml.Event) -> int:
    return cast("yaml.Mark", event.start_mark).index


def _end(event: yaml.Event) -> int:
    return cast("yaml.Mark", event.end_mark).index


def _is_flow(event: yaml.Event) -> bool:
    """Whether a list or mapping is written in brackets."""
    return bool(getattr(event, "flow_style", False))


def _syntax_fault(text: str, error: yaml.YAMLError, top_keys: tuple[str, ...]) -> Fault:
    """What is wrong with a text that is not YAML; `top_keys` may stand at the beginning of a line."""
    lines = text.split("\n")
    mark = getattr(error, "problem_mark", None)
    context = getattr(error, "context_mark", None)
    what = getattr(error, "problem", None) or getattr(error, "reason", None) or "cannot be read"
    if mark is None:
        return 0, 0, Message("yaml.syntax", what=what)
    spaces = _wrong_space(lines, mark)
    if spaces is not None:
        return spaces
    if "mapping values" in what and _TWO_COLONS.match(_line(lines, mark.line)):
        return mark.line + 1, mark.column + 1, Message("yaml.second_colon")
    if "mapping values" in what or "expected <block end>" in what:
        return _wrong_indentation(lines, mark.line, top_keys)
    if what == "could not find expected ':'" and context is not None:
        return _missing_colon(lines, context.line)
    place, advice = mark, Message("yaml.syntax", what=what)
    if "found unexpected end of stream" in what and context is not None:
        place, advice = context, Message("yaml.open_quote")
    elif "cannot start any token" in what:
        sign = _line(lines, mark.line)[mark.column : mark.column + 1]
        advice = Message("yaml.sign", sign=sign)
    return place.line + 1, place.column + 1, advice


def _wrong_space(lines: list[str], mark: yaml.Mark) -> Fault | None:
    """A tab, or a character that only looks like a space."""
    line = _line(lines, mark.line)
    if line[mark.column : mark.column + 1] == "\t" or "\t" in line[: _indent_of(line) + 1]:
        return mark.line + 1, line.index("\t") + 1, Message("yaml.tab")
    for number, each in enumerate(lines[: mark.line + 1]):
        if _SPECIAL_SPACE.match(each):
            return number + 1, 1, Message("yaml.special_space")
    return None


def _missing_colon(lines: list[str], index: int) -> Fault:
    line = _line(lines, index)
    found = _NO_SPACE.match(line)
    if found:
        key, value = found.groups()
        return index + 1, found.start(2) + 1, Message("yaml.no_space", key=key, value=value)
    if line.lstrip().startswith("-"):
        return index + 1, _indent_of(line) + 1, Message("yaml.no_dash")
    return index + 1, len(line.rstrip()) + 1, Message("yaml.no_colon", line=line.strip()[:40])


def _wrong_indentation(lines: list[str], index: int, top_keys: tuple[str, ...]) -> Fault:
    """A line that stands neither under nor beside the ones above it."""
    for number, line in enumerate(lines[: index + 1]):  # the fault may be far above, where a block was ended
        found = re.match(r"([\w.]+)\s*:", line)
        if found and found.group(1) not in top_keys and number > 0:
            return number + 1, 1, Message("yaml.not_indented", key=found.group(1))
    line = _line(lines, index)
    own, fitting = _indent_of(line), _open_indents(lines[:index])
    if own in fitting and _KEY.match(line):
        return index + 1, own + 1, Message("yaml.mixed")
    if own in fitting:
        return index + 1, own + 1, Message("yaml.does_not_fit")
    *others, last = map(str, fitting or [0])
    known = f"{', '.join(others)} or {last}" if others else last
    spaces = "no space" if own == 0 else "1 space" if own == 1 else f"{own} spaces"
    return index + 1, own + 1, Message("yaml.indentation", spaces=spaces, known=known)


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
