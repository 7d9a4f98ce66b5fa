"""YAML texts that anyone may have written: read with limits to nodes or plain data, and written again.

Only the plain part of YAML is read: one document of mappings with unique text keys, lists and scalars.
Aliases and deep nesting are refused, so a text cannot grow when it is read. Scalars follow YAML 1.2 (`yes`
and `on` are text, `1e-3` is a number).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import NoReturn, cast

import yaml

from framerunner.errors import UserError

Path = tuple[str | int, ...]
Value = str | int | float | bool | None | dict[str, "Value"] | tuple["Value", ...]

MAX_DEPTH = 40
MAX_NODES = 20_000  # keys, values, lists and mappings
MAX_EXPLAINED_CHARACTERS = 100_000
MAX_MESSAGE_LENGTH = 200
MAX_INTEGER_LENGTH = 20  # characters; a longer one is read as a float, which has a range

_FAST_LOADER: type[yaml.SafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_TEXTS = {
    "alias": "alias *{name} is not allowed; write the value out",
    "anchor": "anchor &{name} is not allowed; write values out",
    "character": "character {name} is not allowed in YAML",
    "depth": "nested deeper than {limit} levels",
    "key_no_word": "a field's name must be plain text",
    "key_twice": "{key} is given twice, first on line {line}; keep one",
    "second_document": "a second document starts; keep one per file",
    "syntax": "not valid YAML: {what}",
    "tag": "tag {name} is not allowed; write a plain value",
    "too_many": "more than {limit} values; a file this large is a mistake",
}

_NUMBER = r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
_SCALARS = (  # tag, pattern, its first characters; the first match counts
    ("tag:yaml.org,2002:bool", r"true|True|TRUE|false|False|FALSE", "tTfF"),
    ("tag:yaml.org,2002:int", r"[-+]?[0-9]+", "-+0123456789"),
    ("tag:yaml.org,2002:float", rf"{_NUMBER}|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)", "-+.0123456789"),
    ("tag:yaml.org,2002:null", r"~|null|Null|NULL|", ("~", "n", "N", "")),
)
_UNUSUAL_BREAK = re.compile(r"[\x85\u2028\u2029]")
_PATTERNS = tuple((tag, re.compile(rf"(?:{shape})\Z"), tuple(first)) for tag, shape, first in _SCALARS)


@dataclass(frozen=True, slots=True)
class Place:
    """A place in a file."""

    file: str
    line: int = 0  # counted from 1; 0 for the whole file
    column: int = 0  # counted from 1; 0 for the whole line

    def __str__(self) -> str:
        numbers = (number for number in (self.line, self.column) if number)
        return ":".join((self.file, *map(str, numbers)))

    def moved(self, characters: int) -> Place:
        """The place some characters further on in the line; the same if the column is not known."""
        if not (self.column and characters):
            return self
        return Place(self.file, self.line, self.column + characters)


class YamlError(UserError):
    """YAML that cannot be read; the message is one line for people, without the place.

    Attributes:
        code: what is wrong, such as "alias".
        place: where.
        values: what the message names.
        cause: of bad syntax, as the parser reports it.
    """

    def __init__(
        self, code: str, place: Place, *, cause: yaml.MarkedYAMLError | None = None, **values: object
    ) -> None:
        text = " ".join(_TEXTS[code].format(**values).split())
        is_short = len(text) <= MAX_MESSAGE_LENGTH
        super().__init__(text if is_short else text[: MAX_MESSAGE_LENGTH - 1] + "…")
        self.code, self.place, self.values, self.cause = code, place, values, cause


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


def read_yaml(text: str) -> Value:
    """The plain data of a text; lists are tuples. Raises `YamlError`."""
    return plain(compose(text))


def to_yaml(value: object) -> str:
    """Write plain data (dicts, lists, scalars) so that `read_yaml` reads the same values."""
    text: str = yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)
    return text


def plain(node: Node | None) -> Value:
    """The data of a node; None of no node."""
    if isinstance(node, MapNode):
        return {key: plain(each) for key, each in node.items.items()}
    if isinstance(node, ListNode):
        return tuple(map(plain, node.items))
    if node is None:
        return None
    return node.text if node.quoted or node.block else _scalar(node.text)


def follow(node: Node, path: Path) -> list[tuple[Place, Node]]:
    """The nodes along a path, as far as there are any: each with the place of its key or list item."""
    found = [(node.place, node)]
    for step in path:
        if isinstance(node, MapNode) and isinstance(step, str) and step in node.items:
            place, node = node.keys[step], node.items[step]
            found.append((place, node))
        elif isinstance(node, ListNode) and isinstance(step, int) and step < len(node.items):
            node = node.items[step]
            found.append((node.place, node))
        else:
            break
    return found


def _refuse(error: YamlError) -> NoReturn:
    raise error


def compose(
    text: str, file: str = "", *, tags_are_text: bool = False, note: Callable[[YamlError], None] = _refuse
) -> Node | None:
    """Read one YAML document.

    Args:
        text: the document, its lines ended by a line feed.
        file: the name for places.
        tags_are_text: a word after a `!` is part of the text, and anchors are left out; by default both are
            refused.
        note: is told of keys that are no words, which are left out, and of keys written twice, of which the
            last counts; by default they are refused.

    Returns:
        The outermost node; None if the text has none.

    Raises:
        YamlError: bad syntax, or what is refused.
    """
    odd = yaml.reader.Reader.NON_PRINTABLE.search(text)
    if odd:
        line = text.count("\n", 0, odd.start()) + 1
        raise YamlError("character", Place(file, line), name=f"U+{ord(odd[0]):04X}")
    cause: yaml.MarkedYAMLError | None = None
    for loader in _loaders(text):
        try:
            return _Composer(text, file, tags_are_text, note, loader).document()
        except yaml.MarkedYAMLError as error:
            cause = error
    mark = cause and (cause.problem_mark or cause.context_mark)
    place = Place(file, mark.line + 1, mark.column + 1) if mark else Place(file, 1)
    what = cause and (cause.problem or cause.context)
    raise YamlError("syntax", place, cause=cause, what=what or "cannot be read")


def _loaders(text: str) -> tuple[type[yaml.SafeLoader], ...]:
    """Parsers to try in turn: libyaml's is ten times faster, PyYAML's own explains its errors better.

    Libyaml's takes a tab for a space, where PyYAML's refuses it.
    """
    if len(text) > MAX_EXPLAINED_CHARACTERS:
        return (_FAST_LOADER,)
    return (yaml.SafeLoader,) if "\t" in text else (_FAST_LOADER, yaml.SafeLoader)


class _Composer:
    """Makes nodes from the parser's events; it stops at the first alias and at the first node too deep."""

    def __init__(
        self,
        text: str,
        file: str,
        tags_are_text: bool,
        note: Callable[[YamlError], None],
        loader: type[yaml.SafeLoader],
    ) -> None:
        self._text = text
        self._file = file
        self._tags_are_text = tags_are_text
        self._note = note
        self._events = yaml.parse(text, Loader=loader)
        self._depth = 0
        self._nodes = 0

    def document(self) -> Node | None:
        """The outermost node; None if the text has none."""
        root: Node | None = None
        for event in self._events:
            if isinstance(event, yaml.DocumentStartEvent):
                if root is not None:
                    raise YamlError("second_document", self._place(event))
                root = self._node(next(self._events))
        empty = isinstance(root, Scalar) and not root.text and not root.quoted
        return None if empty else root

    def _node(self, event: yaml.Event) -> Node:
        place = self._place(event)
        self._nodes += 1
        if self._nodes > MAX_NODES:
            raise YamlError("too_many", place, limit=MAX_NODES)
        if isinstance(event, yaml.AliasEvent):
            raise YamlError("alias", place, name=event.anchor)
        if not self._tags_are_text:
            for code in ("anchor", "tag"):
                if (name := getattr(event, code)) is not None:
                    raise YamlError(code, place, name=name)
        if isinstance(event, yaml.ScalarEvent):
            return self._scalar(event, place)
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise YamlError("depth", place, limit=MAX_DEPTH)
        is_list = isinstance(event, yaml.SequenceStartEvent)
        node = self._list(event, place) if is_list else self._map(event, place)
        self._depth -= 1
        return node

    def _scalar(self, event: yaml.ScalarEvent, place: Place) -> Scalar:
        start, end, text = _start(event), _end(event), event.value
        block, quoted = event.style in ("|", ">"), event.style in ("'", '"')
        if block:
            end = start + len(self._text[start:end].rstrip())
        if event.tag and event.tag.startswith("!"):
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
                self._note(YamlError("key_no_word", key_place))
                continue
            key = key_node.text
            if key in items:
                self._note(YamlError("key_twice", key_place, key=key, line=keys[key].place.line))
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


def _scalar(text: str) -> Value:
    kind = next((tag.rpartition(":")[2] for tag, pattern, _ in _PATTERNS if pattern.match(text)), "str")
    if kind == "str":
        return text
    if kind == "null":
        return None
    if kind == "bool":
        return text.lower() == "true"
    if kind == "int" and len(text) <= MAX_INTEGER_LENGTH:
        return int(text)
    return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))


class _Dumper(yaml.SafeDumper):
    """Quotes texts that would be read as another type."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012 (PyYAML's form)

    def ignore_aliases(self, data: object) -> bool:
        """Repeat equal values: aliases are refused when reading."""
        return True


def _represent_text(dumper: _Dumper, text: str) -> yaml.ScalarNode:
    """Double-quote a text with unusual line breaks, so that they are escaped and not changed by readers.

    U+0085, U+2028 and U+2029 are line breaks of YAML 1.1.
    """
    style = '"' if _UNUSUAL_BREAK.search(text) else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style)


_Dumper.add_representer(str, _represent_text)
for _tag, _pattern, _first in _PATTERNS:
    _Dumper.add_implicit_resolver(_tag, _pattern, list(_first))
