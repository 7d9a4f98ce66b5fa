"""What a mission can name: values, assignable names and primitives, made from the class of the pilot.

All of it comes from the class: methods are primitives, attributes and properties values, docstrings and
annotations their words, units and ranges (`offboard.chart.described`). So what a contestant's class adds is
there, too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import get_origin

from offboard.authoring.document import Document
from offboard.chart.described import ValueDescription, descriptions
from offboard.chart.kinds import LIMITS, Kind, kind_of_type
from offboard.chart.vocabulary import WRITABLE, Vocabulary, choices_of
from offboard.pilot import NAMES_ON_MAP, Memory, Pilot

_TYPES = {
    Kind.CONDITION: "condition",
    Kind.NUMBER: "number",
    Kind.TEXT: "text",
    Kind.PLACE: "place",
}
OPERATORS = ("<", "<=", ">", ">=", "==", "!=", "and", "or", "not", "+", "-", "*", "/")


@dataclass(frozen=True, slots=True)
class ValueEntry:
    """A name that guards and expressions can read.

    Attributes:
        name: as written, such as "frame.d".
        type: "condition" (true or false), "number", "text", "place" (x, y, z), or "any".
        text: what it is.
        unit: such as "m/s"; empty if it has none.
        low, high: its range; None where there is no bound.
        choices: all values that it can have; empty if there are others.
        assignable: a mission can set it.
        needs_map: only missions with `vision: frames` have it.
        own: a contestant's class adds it.
    """

    name: str
    type: str
    text: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    choices: tuple[object, ...] = ()
    assignable: bool = False
    needs_map: bool = False
    own: bool = False


@dataclass(frozen=True, slots=True)
class PrimitiveEntry:
    """An action by name; primitives take no arguments, but read the names in `reads`."""

    name: str
    text: str  # the first sentence of its help
    help: str
    needs_map: bool = False
    own: bool = False


@dataclass(frozen=True, slots=True)
class Catalogue:
    """All names of a pilot's class, and what expressions are made of."""

    values: tuple[ValueEntry, ...]
    primitives: tuple[PrimitiveEntry, ...]
    operators: tuple[str, ...] = OPERATORS


def catalogue(
    pilot_class: type[Pilot] = Pilot,
    variables: Mapping[str, object] | None = None,
    *,
    contest: bool = True,
) -> Catalogue:
    """The names that a mission can use.

    Args:
        pilot_class: `Pilot` or a contestant's.
        variables: the mission's own, with their first values.
        contest: the mission is of the class `contest`, whose limits are the range of the commands.
    """
    vocabulary = Vocabulary(pilot_class, variables or {}, contest=contest)
    entries: list[ValueEntry] = []
    for name, described in descriptions(pilot_class).items():
        own = not hasattr(Pilot, name) and name not in descriptions(Pilot)
        if described.type is Memory:
            memory = [(each, ValueDescription(type(value))) for each, value in (variables or {}).items()]
            entries += [_entry(("memory", each), value, contest, own=False) for each, value in memory]
        else:
            entries += _entries((name,), described, contest, own=own)
    primitives = [
        _primitive(name, text, own=not hasattr(Pilot, name)) for name, text in vocabulary.primitives.items()
    ]
    return Catalogue(tuple(entries), tuple(primitives))


def catalogue_of(document: Document, pilot_class: type[Pilot] = Pilot) -> Catalogue:
    """The names that a document's mission can use, with its own variables and the limits of its class."""
    chart = document.chart
    if chart is None:
        return catalogue(pilot_class)
    return catalogue(pilot_class, chart.variables, contest=chart.mission_class != "open")


def _entries(path: tuple[str, ...], value: ValueDescription, contest: bool, *, own: bool) -> list[ValueEntry]:
    """The entries of a value, or of its parts if it has some."""
    kind = value.type
    if get_origin(kind) is tuple and kind_of_type(kind) is Kind.ANY:
        return []  # a list of objects: nothing can be done with it
    if kind_of_type(kind) is not Kind.PARTS or not isinstance(kind, type):
        return [_entry(path, value, contest, own=own)]
    found = []
    for name, part in descriptions(kind).items():
        found += _entries((*path, name), part, contest, own=own)
    return found


def _entry(path: tuple[str, ...], value: ValueDescription, contest: bool, *, own: bool) -> ValueEntry:
    low, high, unit = value.low, value.high, value.unit
    if contest and path in LIMITS:
        high, unit = LIMITS[path]
        low = -high
    return ValueEntry(
        ".".join(path),
        _TYPES.get(kind_of_type(value.type), "any"),
        value.text,
        unit,
        low if isfinite(low) else None,
        high if isfinite(high) else None,
        choices_of(value.type),
        assignable=path[0] in WRITABLE,
        needs_map=path[0] in NAMES_ON_MAP,
        own=own,
    )


def _primitive(name: str, text: str, *, own: bool) -> PrimitiveEntry:
    first = " ".join(text.partition("\n\n")[0].split())
    return PrimitiveEntry(name, first, text, needs_map=name in NAMES_ON_MAP, own=own)
