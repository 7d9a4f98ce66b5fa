"""YAML to plain data with the line of each value, and back.

Only the plain part of YAML is read: mappings with unique text keys, lists and scalars. Anchors, aliases,
tags, several documents and deep nesting are refused, so a file cannot grow when it is read. Scalars follow
YAML 1.2 (`yes` and `on` are text, `1e-3` is a number).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import yaml

Path = tuple[str | int, ...]
Value = str | int | float | bool | None | dict[str, "Value"] | tuple["Value", ...]

MAX_DEPTH = 12
MAX_VALUES = 20_000
MAX_MESSAGE_LENGTH = 200
MAX_INTEGER_LENGTH = 20  # characters; a longer one is read as a float, which has a range

_NUMBER = r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"
_SCALARS = (  # tag, pattern, its first characters; the first match counts
    ("tag:yaml.org,2002:bool", r"true|True|TRUE|false|False|FALSE", "tTfF"),
    ("tag:yaml.org,2002:int", r"[-+]?[0-9]+", "-+0123456789"),
    ("tag:yaml.org,2002:float", rf"{_NUMBER}|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)", "-+.0123456789"),
    ("tag:yaml.org,2002:null", r"~|null|Null|NULL|", ("~", "n", "N", "")),
)
_UNUSUAL_BREAK = re.compile(r"[\x85\u2028\u2029]")
_PATTERNS = tuple((tag, re.compile(rf"(?:{shape})\Z"), tuple(first)) for tag, shape, first in _SCALARS)


class YamlError(ValueError):
    """YAML that cannot be read, with its line and, where it helps, its column, counted from 1."""

    def __init__(self, message: str, line: int, column: int | None = None) -> None:
        is_short = len(message) <= MAX_MESSAGE_LENGTH
        super().__init__(message if is_short else message[: MAX_MESSAGE_LENGTH - 1] + "…")
        self.line = line
        self.column = column


@dataclass(slots=True)
class YamlTree:
    """The content of a YAML text."""

    value: Value = None  # lists are tuples; None when the text is empty
    lines: dict[Path, int] = field(default_factory=dict)  # of each value's key or list item, from 1

    def line(self, path: Path) -> int:
        """Line of a value or, where it is missing, of the part in which it should be."""
        while path not in self.lines and path:
            path = path[:-1]
        return self.lines.get(path, 1)


def parse_yaml(text: str) -> YamlTree:
    """Read one YAML document.

    Raises:
        YamlError: the text is not YAML, or uses what is refused (see the module).
    """
    try:
        return _Builder(yaml.parse(text, Loader=yaml.SafeLoader)).build()
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise YamlError(f"character U+{ord(text[error.position]):04X} is not allowed in YAML", line) from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = (1,) if mark is None else (mark.line + 1, mark.column + 1)
        raise YamlError(f"not valid YAML: {error.problem or error.context}", *place) from None


def to_yaml(value: object) -> str:
    """Write plain data (dicts, lists, scalars) so that `parse_yaml` reads the same values."""
    text: str = yaml.dump(value, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)
    return text


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


class _Builder:
    """Builds the tree from parser events, so that a file is refused before it takes memory."""

    def __init__(self, events: Iterator[yaml.Event]) -> None:
        self._events = events
        self._lines: dict[Path, int] = {}
        self._count = 0

    def build(self) -> YamlTree:
        """Build the tree of the only document."""
        value: Value = None
        documents = 0
        for event in self._events:
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents > 1:
                    raise YamlError("a second document starts; keep one per file", _line(event))
                first = next(self._events)
                self._lines[()] = _line(first)
                value = self._value(first, ())
        return YamlTree(value, self._lines)

    def _value(self, event: yaml.Event, path: Path) -> Value:
        self._check(event, path)
        if isinstance(event, yaml.MappingStartEvent):
            return self._mapping(path)
        if isinstance(event, yaml.SequenceStartEvent):
            return self._sequence(path)
        if not isinstance(event, yaml.ScalarEvent):
            raise YamlError("not valid YAML", _line(event))
        text = str(event.value)
        return _scalar(text) if event.implicit[0] else text

    def _check(self, event: yaml.Event, path: Path) -> None:
        self._count += 1
        if isinstance(event, yaml.AliasEvent):
            raise YamlError(f"alias *{event.anchor} is not allowed; write the value out", _line(event))
        if isinstance(event, yaml.NodeEvent) and event.anchor is not None:
            raise YamlError(f"anchor &{event.anchor} is not allowed; write values out", _line(event))
        if isinstance(event, yaml.ScalarEvent | yaml.CollectionStartEvent) and event.tag is not None:
            raise YamlError(f"tag {event.tag} is not allowed; write a plain value", _line(event))
        if len(path) > MAX_DEPTH:
            raise YamlError(f"nested deeper than {MAX_DEPTH} levels", _line(event))
        if self._count > MAX_VALUES:
            raise YamlError(f"more than {MAX_VALUES} values; a file this large is a mistake", _line(event))

    def _mapping(self, path: Path) -> Value:
        data: dict[str, Value] = {}
        while not isinstance(event := next(self._events), yaml.MappingEndEvent):
            self._check(event, path)
            if not isinstance(event, yaml.ScalarEvent):
                raise YamlError("a field's name must be plain text", _line(event))
            key = str(event.value)
            at = (*path, key)
            if key in data:
                message = f"{key} is given twice, first on line {self._lines[at]}; keep one"
                raise YamlError(message, _line(event))
            self._lines[at] = _line(event)
            data[key] = self._value(next(self._events), at)
        return data

    def _sequence(self, path: Path) -> Value:
        items: list[Value] = []
        while not isinstance(event := next(self._events), yaml.SequenceEndEvent):
            at = (*path, len(items))
            self._lines[at] = _line(event)
            items.append(self._value(event, at))
        return tuple(items)


def _line(event: yaml.Event) -> int:
    mark = event.start_mark
    return 1 if mark is None else int(mark.line) + 1


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
