"""The kind of an expression's value (condition, number, text, place), and which kinds do not fit together."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import is_dataclass
from enum import Enum
from math import inf
from typing import get_args, get_origin

from framerunner.geometry.vectors import Vec3
from offboard.chart.mission_texts import Message
from offboard.chart.problems import cut
from offboard.chart.vocabulary import Vocabulary, choices_of, path_of
from offboard.limits import CONTEST

LIMITS: Mapping[tuple[str, ...], tuple[float, str]] = {
    ("cmd", "vel_x"): (CONTEST.forward_m_s, "m/s"),
    ("cmd", "vel_y"): (CONTEST.left_m_s, "m/s"),
    ("cmd", "vel_z"): (CONTEST.up_m_s, "m/s"),
    ("cmd", "rot_z"): (CONTEST.yaw_rate_rad_s, "rad/s"),
}
"""Of the class `contest`; those of the class `open` depend on the drone."""
_ORDER = (ast.Lt, ast.LtE, ast.Gt, ast.GtE)
_QUOTED = re.compile(r"'[^']*'|\"[^\"]*\"")
_DECIMAL_COMMA = re.compile(r"(?<![\w.])(\d+),(\d+)(?![\w.])")


class Kind(Enum):
    """What a value is: the code of its words."""

    CONDITION = "kind.condition"
    NUMBER = "kind.number"
    TEXT = "kind.text"
    PLACE = "kind.place"
    PARTS = "kind.parts"
    ANY = "kind.any"

    @property
    def words(self) -> Message:
        """The kind in words."""
        return Message(self.value)


class KindError(Exception):
    """Values that do not fit together; the message is one line.

    Attributes:
        message: the same with its code.
        node: the part of the expression with the fault.
    """

    def __init__(self, node: ast.AST, message: Message) -> None:
        super().__init__(str(message))
        self.message = message
        self.node = node


class Kinds:
    """Finds the kinds in one expression.

    Args:
        text: the expression as written.
        vocabulary: contains all its names.
    """

    def __init__(self, text: str, vocabulary: Vocabulary) -> None:
        self._text = text
        self._vocabulary = vocabulary

    def of(self, node: ast.expr) -> Kind:
        """The kind of a part of the expression. Raises `KindError` if its parts do not fit together."""
        kind = Kind.ANY
        match node:
            case ast.Constant(value=value):
                kind = kind_of_type(type(value))
            case ast.Name() | ast.Attribute():
                kind = kind_of_type(self._type_of(node))
            case ast.Tuple():
                kind = self._of_tuple(node)
            case ast.BoolOp():
                for part in node.values:
                    self.require_condition(part)
                kind = Kind.CONDITION
            case ast.UnaryOp(op=ast.Not()):
                self.require_condition(node.operand)
                kind = Kind.CONDITION
            case ast.UnaryOp():
                kind = self._require_number(node.operand)
            case ast.BinOp():
                self._require_number(node.left)
                kind = self._require_number(node.right)
            case ast.Compare():
                left = node.left
                for operator, right in zip(node.ops, node.comparators, strict=True):
                    self._compare(left, operator, right)
                    left = right
                kind = Kind.CONDITION
        return kind

    def require_condition(self, node: ast.expr) -> None:
        """Refuse what is not true or false. Raises `KindError`."""
        kind = self.of(node)
        if kind in (Kind.CONDITION, Kind.ANY):
            return
        shown = self._shown(node)
        if kind is Kind.PLACE and isinstance(node, ast.Tuple):
            raise self._comma(node)
        if kind is Kind.TEXT and isinstance(node, ast.Constant):
            raise KindError(node, Message("kind.text_alone", shown=shown))
        example = "imu.z > 1" if isinstance(node, ast.Constant) else f"{shown} > 1"
        advice = {
            Kind.NUMBER: Message("kind.compare", example=example),
            Kind.TEXT: Message("kind.compare", example=f"{shown} == 'red'"),
            Kind.PLACE: Message("kind.compare_number"),
            Kind.PARTS: self._name_a_part(node),
        }[kind]
        raise KindError(node, Message("kind.no_condition", shown=shown, kind=kind.words, advice=advice))

    def require_assignable(self, path: tuple[str, ...], node: ast.expr) -> None:
        """Refuse a value that cannot be assigned to a dotted name. Raises `KindError`."""
        target = self._vocabulary.type_of(path)
        name, wanted = ".".join(path), kind_of_type(target)
        if isinstance(node, ast.Tuple) and wanted is Kind.PLACE and len(node.elts) != 3:
            raise self._not_three(node, name)
        if path[0] == "memory":
            wanted = Kind.ANY  # a variable may change its kind
        given = self.of(node)
        if given is Kind.PARTS:
            raise self._several(node)
        if wanted is not Kind.ANY and given not in (wanted, Kind.ANY):
            raise self._not_assignable(name, wanted, given, node)
        choices = choices_of(target)
        if choices and isinstance(node, ast.Constant) and node.value not in choices:
            listed = ", ".join(map(repr, choices))
            raise KindError(node, Message("kind.not_one_of", name=name, value=node.value, choices=listed))
        limit, value = LIMITS.get(path) if self._vocabulary.contest else None, _number(node)
        if limit is not None and value is not None and abs(value) > limit[0]:
            most, unit = limit
            raise KindError(node, Message("kind.too_fast", name=name, value=value, limit=most, unit=unit))

    def _several(self, node: ast.expr) -> KindError:
        advice = self._name_a_part(node)
        return KindError(node, Message("kind.several", shown=self._shown(node), advice=advice))

    def _not_assignable(self, name: str, wanted: Kind, given: Kind, node: ast.expr) -> KindError:
        if isinstance(node, ast.Tuple) and decimal_comma(self._text):
            return self._comma(node)
        example = {
            Kind.PLACE: f"{name} = (0, 0, 2)",
            Kind.NUMBER: f"{name} = 0.5",
            Kind.CONDITION: f"{name} = True",
            Kind.TEXT: f"{name} = 'red'",
        }.get(wanted, name)
        kinds = {"wanted": wanted.words, "given": given.words}
        shown = self._shown(node)
        return KindError(
            node, Message("kind.not_assignable", name=name, shown=shown, example=example, **kinds)
        )

    def _type_of(self, node: ast.expr) -> object:
        """Declared type of a name; `object` if there is none, or if it may change as a variable's does."""
        path = path_of(node) if isinstance(node, (ast.Name, ast.Attribute)) else ("memory",)
        return object if path[0] == "memory" else self._vocabulary.type_of(path)

    def _of_tuple(self, node: ast.Tuple) -> Kind:
        for part in node.elts:
            if self.of(part) not in (Kind.NUMBER, Kind.ANY):
                if decimal_comma(self._text):
                    raise self._comma(node)
                raise KindError(part, Message("kind.no_number", shown=self._shown(part)))
        if len(node.elts) != 3:
            raise self._comma(node)
        return Kind.PLACE

    def _require_number(self, node: ast.expr) -> Kind:
        kind = self.of(node)
        if kind in (Kind.NUMBER, Kind.ANY):
            return Kind.NUMBER
        if isinstance(node, ast.Tuple):
            raise self._comma(node)
        advice = Message("kind.take_number")
        if kind is Kind.PARTS:
            advice = self._name_a_part(node)
        elif kind is Kind.PLACE:
            advice = Message("kind.read_number")
        elif kind is Kind.TEXT and isinstance(node, ast.Constant):
            advice = Message("kind.no_quotes")
        shown = self._shown(node)
        raise KindError(node, Message("kind.not_a_number", shown=shown, kind=kind.words, advice=advice))

    def _compare(self, left: ast.expr, operator: ast.cmpop, right: ast.expr) -> None:
        if isinstance(operator, _ORDER):
            self._require_number(left)
            self._require_number(right)
            return
        kinds = self.of(left), self.of(right)
        for node, kind in zip((left, right), kinds, strict=True):
            if kind is Kind.PARTS:
                raise self._several(node)
        for name, constant in ((left, right), (right, left)):
            choices = choices_of(self._type_of(name))
            if choices and isinstance(constant, ast.Constant) and constant.value not in choices:
                listed = ", ".join(map(repr, choices))
                shown, value = self._shown(name), self._shown(constant)
                raise KindError(constant, Message("kind.never", shown=shown, value=value, choices=listed))
        alike = {Kind.CONDITION: Kind.NUMBER}  # True is 1
        first, second = (alike.get(kind, kind) for kind in kinds)
        if Kind.ANY not in kinds and first is not second:
            one, other = self._shown(left), self._shown(right)
            words = {"first": kinds[0].words, "second": kinds[1].words}
            raise KindError(left, Message("kind.never_equal", one=one, other=other, **words))

    def _comma(self, node: ast.Tuple) -> KindError:
        """The error for a comma where a number is required."""
        hint = decimal_comma(self._text)
        if hint is not None:
            return KindError(node, hint[1])
        return KindError(node, Message("kind.comma", shown=self._shown(node), count=len(node.elts)))

    def _not_three(self, node: ast.Tuple, name: str) -> KindError:
        count = len(node.elts)
        hint = decimal_comma(self._text) if count > 3 else None
        if hint is not None:
            return KindError(node, Message("kind.not_three_comma", name=name, count=count, hint=hint[1]))
        code = "kind.no_height" if count == 2 else "kind.not_three"
        return KindError(node, Message(code, name=name, count=count))

    def _shown(self, node: ast.expr) -> str:
        return cut(ast.get_source_segment(self._text, node) or "this", 40)

    def _name_a_part(self, node: ast.expr) -> Message:
        named = isinstance(node, (ast.Name, ast.Attribute))
        parts = self._vocabulary.parts_of(path_of(node)) if named else []
        example = f"{self._shown(node)}.{'d' if 'd' in parts else parts[0]}" if parts else "imu.x"
        return Message("kind.part", example=example)


def masked(text: str) -> str:
    """An expression with `_` for every character of its quoted texts."""
    return _QUOTED.sub(lambda found: "_" * len(found.group()), text)


def decimal_comma(text: str) -> tuple[int, Message] | None:
    """Where a number is written with a comma, and how to write it; None if there is none."""
    found = _DECIMAL_COMMA.search(masked(text))
    if found is None:
        return None
    whole, part = found.groups()
    return found.start(), Message("kind.decimal_comma", whole=whole, part=part)


def kind_of_type(kind: object) -> Kind:
    """The kind of a declared type; ANY if that is not certain."""
    if kind is bool:
        return Kind.CONDITION
    if kind in (int, float):
        return Kind.NUMBER
    if kind is str or (choices_of(kind) and all(isinstance(one, str) for one in choices_of(kind))):
        return Kind.TEXT
    if kind == Vec3 or (get_origin(kind) is tuple and get_args(kind) == (float, float, float)):
        return Kind.PLACE
    return Kind.PARTS if isinstance(kind, type) and is_dataclass(kind) else Kind.ANY


def _number(node: ast.expr) -> float | None:
    """The value of an expression of numbers alone; None if it is not one."""
    match node:
        case ast.Constant(value=bool()):
            return None
        case ast.Constant(value=int() | float() as value):
            return as_float(value)
        case ast.UnaryOp(op=ast.USub()):
            inner = _number(node.operand)
            return None if inner is None else -inner
        case ast.UnaryOp(op=ast.UAdd()):
            return _number(node.operand)
    return None


def as_float(number: float) -> float:
    """A whole number of any size as a float, infinite if it is too large for one."""
    try:
        return float(number)
    except OverflowError:
        return inf if number > 0 else -inf
