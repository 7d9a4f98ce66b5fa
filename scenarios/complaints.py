"""Validation faults in words: which line, which field, what it is, what to do."""

from __future__ import annotations

import difflib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

from pydantic import BaseModel

from scenarios.models import Scenario, field_path
from scenarios.yaml_tree import Path, YamlTree

MAX_VALUE_LENGTH = 60  # characters of a value or path shown in a message

_COMPARISONS = {
    "greater_than": "must be above {gt}",
    "greater_than_equal": "must be at least {ge}",
    "less_than": "must be below {lt}",
    "less_than_equal": "must be at most {le}",
    "string_too_long": "must have at most {max_length} characters",
    "literal_error": "must be {expected}",
}
_TYPES = {
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "string_type": "must be text",
    "tuple_type": "must be a list",
    "model_type": "must hold fields, each written `name: value`",
    "too_long": "must be one number each for three axes",
    "string_pattern_mismatch": "must be small letters, digits, - and _, a letter or digit first",
}


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing wrong in a scenario.

    Attributes:
        kind: pydantic's name of the fault, such as "greater_than".
        path: keys and indices to the value.
        value: what stands there (for a missing field: what it is missing in).
        context: the limits the message needs.
        text: pydantic's own words, for a fault that has none here.
    """

    kind: str
    path: Path
    value: object
    context: Mapping[str, object] = field(default_factory=dict)
    text: str = ""

    @classmethod
    def from_pydantic(cls, detail: Mapping[str, Any]) -> Fault:
        """Take one of `ValidationError.errors()`; a `refusal` brings the rest of its path along."""
        context = detail.get("ctx", {})
        path = (*detail["loc"], *context.get("at", ()))
        value = detail["input"]
        return cls(detail["type"], path, value, context, detail["msg"])


def describe_faults(source: str, tree: YamlTree, faults: list[Fault]) -> str:
    """Put the first fault of a file in one line, and say how many others there are."""
    ordered = sorted(faults, key=lambda fault: tree.line(fault.path))
    first = ordered[0]
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return f"{source}:{tree.line(first.path)}: {_describe(first)}{more}"


def shorten(text: str) -> str:
    """Make a value or path fit for a message: one line of printable characters, not too long."""
    line = "".join(char if char.isprintable() else "?" for char in " ".join(text.split()))
    return line if len(line) <= MAX_VALUE_LENGTH else line[: MAX_VALUE_LENGTH - 1] + "…"


def show(value: object) -> str:
    """Write a value as in YAML, short enough for a message."""
    return shorten(json.dumps(value, ensure_ascii=False, default=str))


def _describe(fault: Fault) -> str:
    name = shorten(field_path(fault.path)) or "scenario"
    if fault.kind == "missing":
        return f"{name} is missing; add it"
    if fault.kind == "extra_forbidden":
        return f"{name} is not a known field; {_nearest_field(fault.path)}"
    if fault.kind == "refused":
        return f"{name} {fault.context['value']} {fault.context['message']}"
    shown = "empty" if fault.value is None else show(fault.value)
    if fault.kind in _COMPARISONS:
        advice = _COMPARISONS[fault.kind].format_map(fault.context)
    else:
        advice = _TYPES.get(fault.kind, fault.text)
    return f"{name} is {shown}: {advice}"


def _nearest_field(path: Path) -> str:
    names = sorted(_fields_of(path[:-1]))
    nearest = difflib.get_close_matches(str(path[-1]), names, n=1, cutoff=0.5)
    if nearest:
        return f"did you mean {nearest[0]}?"
    return f"known here: {', '.join(names)}" if names else "remove it"


def _fields_of(path: Path) -> list[str]:
    """Field names of the scenario's part that a path leads to."""
    part: type[BaseModel] = Scenario
    for step in path:
        if isinstance(step, int):
            continue
        annotation = part.model_fields[step].annotation
        candidates = (annotation, *get_args(annotation))
        found = [kind for kind in candidates if isinstance(kind, type) and issubclass(kind, BaseModel)]
        if not found:
            return []
        part = found[0]
    return list(part.model_fields)
