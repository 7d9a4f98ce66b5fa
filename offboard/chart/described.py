"""What a class says of its values: type, words, unit and range, from annotations and docstrings.

    x: Annotated[float, Field(description="forward of the centre", json_schema_extra={"unit": "m"})]

A property has its words from its docstring and the rest from its return type. Without a unit in the
annotation, the ending of a name such as `speed_m_s` tells it.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import inf
from typing import Annotated, get_args, get_origin, get_type_hints

from pydantic.fields import FieldInfo

_UNITS = {
    **{"_rad_s2": "rad/s²", "_m_s2": "m/s²", "_rad_s": "rad/s", "_deg_s": "deg/s", "_m_s": "m/s"},
    **{"_m": "m", "_s": "s", "_rad": "rad", "_deg": "deg", "_px": "px", "_hz": "Hz", "_us": "µs", "_v": "V"},
}
"""Endings of names, the longer ones first."""


@dataclass(frozen=True, slots=True)
class ValueDescription:
    """What is known of a value.

    Attributes:
        type: declared; `object` if there is none.
        text: one sentence or more; empty if there is none.
        unit: such as "m/s"; empty if there is none or it is not known.
        low, high: the range, inclusive; infinite where there is no bound.
    """

    type: object = object
    text: str = ""
    unit: str = ""
    low: float = -inf
    high: float = inf


NOT_DESCRIBED = ValueDescription()


def descriptions(owner: type) -> Mapping[str, ValueDescription]:
    """The public values of a class by name: annotated attributes, class variables and properties."""
    return _descriptions(owner)


def unit_of(owner: type, name: str) -> str:
    """The unit of a value by its dotted name, such as "m" of a pilot's "frame.d"; "" if none is known."""
    kind: object = owner
    found = NOT_DESCRIBED
    for part in name.split("."):
        found = descriptions(kind).get(part, NOT_DESCRIBED) if isinstance(kind, type) else NOT_DESCRIBED
        kind = found.type
    return found.unit


@lru_cache(maxsize=64)
def _descriptions(owner: type) -> Mapping[str, ValueDescription]:
    if owner.__module__ == "builtins":
        return {}
    plain = (bool, int, float, str, tuple)
    untyped = inspect.getmembers(owner, lambda member: isinstance(member, plain))
    found = {name: _described(name, type(value), "") for name, value in untyped if name[0] != "_"}
    hints = get_type_hints(owner, include_extras=True)
    texts = _attribute_texts(owner)
    found |= {
        name: _described(name, hint, texts.get(name, "")) for name, hint in hints.items() if name[0] != "_"
    }
    for name, member in inspect.getmembers(owner, lambda member: isinstance(member, property)):
        if name[0] != "_":
            hint = get_type_hints(member.fget, include_extras=True).get("return", object)
            found[name] = _described(name, hint, inspect.getdoc(member) or "")
    return found


def _attribute_texts(owner: type) -> dict[str, str]:
    """The section "Attributes" of a class's docstring."""
    section = (inspect.getdoc(owner) or "").partition("Attributes:\n")[2].partition("\n\n")[0]
    found = re.findall(r"^ {4}(\w+): (.*(?:\n {5,}.*)*)", section, re.MULTILINE)
    return {name: " ".join(text.split()) for name, text in found}


def _described(name: str, hint: object, text: str) -> ValueDescription:
    kind = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    fields = [part for part in get_args(hint)[1:] if isinstance(part, FieldInfo)] if kind is not hint else []
    unit, low, high = "", -inf, inf
    for field in fields:
        text = field.description or text
        extra = field.json_schema_extra
        unit = str(extra.get("unit", unit)) if isinstance(extra, Mapping) else unit
        for bound in field.metadata:
            low = max(low, float(getattr(bound, "ge", getattr(bound, "gt", low))))
            high = min(high, float(getattr(bound, "le", getattr(bound, "lt", high))))
    if not unit:
        unit = next((unit for ending, unit in _UNITS.items() if name.endswith(ending)), "")
    return ValueDescription(kind, text, unit, low, high)
