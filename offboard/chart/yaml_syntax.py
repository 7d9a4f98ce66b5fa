"""A mission's text to YAML nodes, and YAML's syntax errors in words for people who do not know YAML.

YAML's parser reports what it expected, often lines after the fault. The text mostly shows what was meant, so
the messages are made from the text.
"""

from __future__ import annotations

import re

import yaml

from framerunner.files.yaml_text import MapNode, Place, YamlError, compose
from offboard.chart.mission_texts import Message
from offboard.chart.problems import ProblemList, mission_error

_KEY = re.compile(r"\s*(?:-\s+)?([\w.]+)\s*:(?:\s|$)")
_TWO_COLONS = re.compile(r"\s*(?:-\s+)?[\w.]+\s*:\s+[^\s'\"#][^'\"#]*:(?:\s|$)")
_NO_SPACE = re.compile(r"\s*(?:-\s+)?(\w+):([^\s:]+)\s*(?:#.*)?$")
_SPECIAL_SPACE = re.compile(r"[ ]*[\u00a0\u2000-\u200b\u202f\u3000]")

Fault = tuple[int, int, Message]
"""Line and column, counted from 1, and what to do."""


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

    def note(fault: YamlError) -> None:
        problems.add(fault.place, Message(f"yaml.{fault.code}", **fault.values))
        if problems.full:
            problems.raise_if_any()

    try:
        root = compose(text, file, tags_are_text=True, note=note)
    except YamlError as error:
        place, what = error.place, Message(f"yaml.{error.code}", **error.values)
        if error.cause is not None and error.cause.problem_mark is not None:
            line, column, what = _syntax_fault(text, error.cause, error.cause.problem_mark, keys)
            place = Place(file, line, column)
        raise mission_error(place, what) from None
    if root is None:
        raise mission_error(Place(file, 1), Message("yaml.empty"))
    if not isinstance(root, MapNode):
        raise mission_error(Place(file, 1), Message("yaml.no_mapping"))
    problems.raise_if_any()
    return root


def _syntax_fault(
    text: str, error: yaml.MarkedYAMLError, mark: yaml.Mark, top_keys: tuple[str, ...]
) -> Fault:
    """What is wrong with a text that is not YAML; `top_keys` may stand at the beginning of a line."""
    lines = text.split("\n")
    context, what = error.context_mark, error.problem or "cannot be read"
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
