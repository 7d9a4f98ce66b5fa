"""YAML's syntax errors in words for people who do not know YAML.

The parser of YAML says what it expected, often lines behind the fault. The text itself mostly shows what was
meant, so it is looked at.
"""

from __future__ import annotations

import re

import yaml

_KEY = re.compile(r"\s*(?:-\s+)?([\w.]+)\s*:(?:\s|$)")
_TWO_COLONS = re.compile(r"\s*(?:-\s+)?[\w.]+\s*:\s+[^\s'\"#][^'\"#]*:(?:\s|$)")
_NO_SPACE = re.compile(r"\s*(?:-\s+)?(\w+):([^\s:]+)\s*(?:#.*)?$")
_SPECIAL_SPACE = re.compile(r"[ ]*[\u00a0\u2000-\u200b\u202f\u3000]")

Fault = tuple[int, int, str]
"""Line and column, counted from 1 (0 if not known), and what to do."""


def explain(text: str, error: yaml.YAMLError, top_keys: tuple[str, ...]) -> Fault:
    """Say what is wrong with a text that is no YAML.

    Args:
        text: all of it.
        error: what PyYAML raised.
        top_keys: keys that may stand at the beginning of a line.
    """
    lines = text.split("\n")
    mark = getattr(error, "problem_mark", None)
    begun = getattr(error, "context_mark", None)
    what = getattr(error, "problem", None) or getattr(error, "reason", None) or "cannot be read"
    if mark is None:
        return 0, 0, f"YAML syntax: {what}"
    spaces = _spaces(lines, mark)
    if spaces is not None:
        return spaces
    if "mapping values" in what or "expected <block end>" in what:
        return _misplaced(lines, mark, what, top_keys)
    if what == "could not find expected ':'" and begun is not None:
        return _no_colon(lines, begun.line)
    place, mend = mark, f"YAML syntax: {what}"
    if "found unexpected end of stream" in what and begun is not None:
        place, mend = begun, "this quotation mark is never closed; write another at the end"
    elif "cannot start any token" in what:
        sign = _line(lines, mark.line)[mark.column : mark.column + 1]
        mend = f"'{sign}' cannot stand here; put the text in \"quotation marks\""
    return place.line + 1, place.column + 1, mend


def _spaces(lines: list[str], mark: yaml.Mark) -> Fault | None:
    """A tab, or a space that only looks like one."""
    line = _line(lines, mark.line)
    if line[mark.column : mark.column + 1] == "\t" or "\t" in line[: indent_of(line) + 1]:
        return mark.line + 1, line.index("\t") + 1, "there is a tab; write spaces instead"
    for number, each in enumerate(lines[: mark.line + 1]):
        if _SPECIAL_SPACE.match(each):
            text = "this line begins with special spaces, as copied from a web page; write plain ones"
            return number + 1, 1, text
    return None


def _misplaced(lines: list[str], mark: yaml.Mark, what: str, top_keys: tuple[str, ...]) -> Fault:
    """A line, or a part of one, that YAML did not expect there."""
    if "mapping values" in what and _TWO_COLONS.match(_line(lines, mark.line)):
        text = "a second ':' in this line; write what follows it in the next line"
        return mark.line + 1, mark.column + 1, text
    return _indentation(lines, mark.line, top_keys)


def indent_of(line: str) -> int:
    """Number of spaces before the first word of a line, a dash before it included."""
    found = re.match(r"[ ]*(?:-[ ]+)*", line)
    return found.end() if found else 0


def _line(lines: list[str], index: int) -> str:
    return lines[index] if index < len(lines) else ""


def _no_colon(lines: list[str], index: int) -> Fault:
    line = _line(lines, index)
    found = _NO_SPACE.match(line)
    if found:
        key, value = found.groups()
        return index + 1, found.start(2) + 1, f"a space is missing after ':'; write '{key}: {value}'"
    word = line.strip()
    if line.lstrip().startswith("-"):
        return index + 1, indent_of(line) + 1, "begin each line of a list with '- ', under the line above it"
    return index + 1, len(line.rstrip()) + 1, f"a ':' is missing; write '{word[:40]}:'"


def _indentation(lines: list[str], index: int, top_keys: tuple[str, ...]) -> Fault:
    """A line that stands neither under nor beside the ones above it."""
    for number, line in enumerate(lines[: index + 1]):  # the fault may be far above, where a block was ended
        found = re.match(r"([\w.]+)\s*:", line)
        if found and found.group(1) not in top_keys and number > 0:
            text = f"'{found.group(1)}' must be indented, to stand under the line it belongs to"
            return number + 1, 1, text
    line = _line(lines, index)
    own, fitting = indent_of(line), _open_indents(lines[:index])
    if own in fitting and _KEY.match(line):
        return index + 1, own + 1, "lines with and without '- ' are mixed here; write all of them alike"
    if own in fitting:
        return index + 1, own + 1, "this line does not fit under the one above; is a ':' or a '- ' missing?"
    known = " or ".join(
        filter(None, (", ".join(map(str, fitting[:-1])), str(fitting[-1]) if fitting else "0"))
    )
    spaces = "no space" if own == 0 else "1 space" if own == 1 else f"{own} spaces"
    return index + 1, own + 1, f"wrong indentation: {spaces}; the lines above have {known}"


def _open_indents(lines: list[str]) -> list[int]:
    """Indentations of the blocks that are open after some lines, the outermost first."""
    found: list[int] = []
    for line in reversed(lines):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        for indent in (indent_of(line), len(line) - len(line.lstrip(" "))):
            if not found or indent < found[-1]:
                found.append(indent)
    return found[:4][::-1]
