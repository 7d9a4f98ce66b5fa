"""Whether a guard can hold, and whether one holds whenever another does.

A guard is brought to alternatives, each a set of tests of terms: `frame.d < 1`, `colour == 'red'`. Terms are
taken as independent of each other, so a guard that is found never to hold really never does, while one that
never holds may be missed. A term takes finitely many values that matter: the constants it is compared with,
what lies between them, and the ends of its range; they are all tried.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from math import inf, isnan
from typing import Any

from offboard.chart.kinds import as_float
from offboard.chart.mission_texts import Message
from offboard.chart.problems import cut
from offboard.chart.vocabulary import UnknownNameError, Vocabulary, choices_of, path_of

MAX_ALTERNATIVES = 64
MAX_TESTS = 30_000
"""That are looked at for one mission; then no more is found out, so that a hostile file costs no time."""
_COMPARE: Mapping[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
_NEGATED: Mapping[type[ast.cmpop], type[ast.cmpop]] = {
    **{ast.Lt: ast.GtE, ast.GtE: ast.Lt, ast.Gt: ast.LtE, ast.LtE: ast.Gt},
    **{ast.Eq: ast.NotEq, ast.NotEq: ast.Eq},
}
_SWAPPED: Mapping[type[ast.cmpop], type[ast.cmpop]] = {
    **{ast.Lt: ast.Gt, ast.Gt: ast.Lt, ast.LtE: ast.GtE, ast.GtE: ast.LtE},
    **{ast.Eq: ast.Eq, ast.NotEq: ast.NotEq},
}
_ARITHMETIC: Mapping[type[ast.operator], Callable[[float, float], float]] = {
    **{ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv},
}
_SIGNS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


@dataclass(frozen=True, slots=True)
class _Term:
    """What is tested: a value, or the order of two (-1, 0 or 1)."""

    shown: str
    low: float = -inf
    high: float = inf
    choices: tuple[object, ...] = ()  # all values it can have; none if it is a number
    is_text: bool = False


@dataclass(frozen=True, slots=True)
class _Test:
    """A term compared with a constant."""

    term: _Term
    operator: type[ast.cmpop]
    constant: object

    def __str__(self) -> str:
        value = f"{self.constant:g}" if isinstance(self.constant, float) else repr(self.constant)
        return f"{_SIGNS[self.operator]} {value}"


_Alternatives = tuple[frozenset[_Test], ...]
"""One of them must hold, all tests of it. None at all: never; an empty one: always."""

_ALWAYS: _Alternatives = (frozenset(),)


class _TooManyError(Exception):
    """An expression has more alternatives than are looked at."""


class Conditions:
    """Reasons about the guards of a mission.

    Args:
        vocabulary: with the types and ranges of all names.
        constants: values of names that never change, such as "memory.x0".
    """

    def __init__(self, vocabulary: Vocabulary, constants: Mapping[str, object]) -> None:
        self._vocabulary = vocabulary
        self._constants = constants
        self._tests_left = MAX_TESTS
        self._cached = cache(self._alternatives_of)

    def why_never(self, when: str) -> Message | None:
        """Why a guard never holds; None if it may."""
        with suppress(_TooManyError):
            alternatives = self._alternatives(when, True)
            if not alternatives:
                return Message("guard.constant")
            if not self._possible(alternatives):
                return _reason(alternatives[0])
        return None

    def holds_always(self, when: str) -> bool:
        """Whether a guard holds for all values."""
        with suppress(_TooManyError):
            return not self._possible(self._alternatives(when, False))
        return False

    def hides(self, elders: Iterable[str], younger: str) -> bool:
        """Whether one of some guards holds whenever another one does; an empty one always holds."""
        with suppress(_TooManyError):
            left = self._possible(self._alternatives(younger, True) if younger else _ALWAYS)
            for elder in elders:
                left = self._possible(_both(left, self._alternatives(elder, False) if elder else ()))
                if not left:
                    return True
        return False

    def _possible(self, alternatives: _Alternatives) -> _Alternatives:
        """Those that some values fulfil."""
        self._tests_left -= 1 + sum(map(len, alternatives))
        if self._tests_left < 0:
            raise _TooManyError
        return tuple(each for each in alternatives if _impossible_term(each) is None)

    def _alternatives(self, when: str, wanted: bool) -> _Alternatives:
        found = self._cached(when, wanted)
        if found is None:
            raise _TooManyError
        return found

    def _alternatives_of(self, when: str, wanted: bool) -> _Alternatives | None:
        """None if there are too many."""
        try:
            return self._of(ast.parse(when.strip(), mode="eval").body, wanted)
        except (SyntaxError, ValueError, RecursionError, _TooManyError):
            return None

    def _of(self, node: ast.expr, wanted: bool) -> _Alternatives:
        """The alternatives in which an expression is true or, with `wanted` false, false."""
        self._tests_left -= 1
        if self._tests_left < 0:
            raise _TooManyError
        match node:
            case ast.UnaryOp(op=ast.Not()):
                return self._of(node.operand, not wanted)
            case ast.BoolOp():
                parts = [self._of(part, wanted) for part in node.values]
                return _all_of(parts) if isinstance(node.op, ast.And) is wanted else _any_of(parts)
            case ast.Compare():
                sides = [node.left, *node.comparators]
                triples = zip(sides, node.ops, sides[1:], strict=False)
                parts = [self._compared(left, type(op), right, wanted) for left, op, right in triples]
                return _all_of(parts) if wanted else _any_of(parts)
        constant = self._constant(node)
        if constant is not None:
            return _ALWAYS if bool(constant) is wanted else ()
        return self._test(self._truth(node), ast.Eq, float(wanted))

    def _compared(self, left: ast.expr, op: type[ast.cmpop], right: ast.expr, wanted: bool) -> _Alternatives:
        op = op if wanted else _NEGATED[op]
        first, second = self._constant(left), self._constant(right)
        if first is not None and second is not None:
            try:
                return _ALWAYS if _COMPARE[op](first, second) else ()
            except TypeError:
                raise _TooManyError from None
        if first is not None:
            left, right, second, op = right, left, first, _SWAPPED[op]
        if second is not None:
            return self._test(self._value(left, second), op, second)
        if ast.unparse(right) < ast.unparse(left):
            left, right, op = right, left, _SWAPPED[op]
        same = ast.unparse(left) == ast.unparse(right)
        order = (0.0,) if same else (-1.0, 0.0, 1.0)
        return self._test(_Term(f"{ast.unparse(left)} and {ast.unparse(right)}", choices=order), op, 0.0)

    @staticmethod
    def _test(term: _Term, op: type[ast.cmpop], constant: object) -> _Alternatives:
        return (frozenset({_Test(term, op, constant)}),)

    def _constant(self, node: ast.expr) -> object | None:
        """The value of an expression that never changes: a float or a text; None if it may change."""
        match node:
            case ast.Constant(value=bool() | int() | float() as number):
                return as_float(number)
            case ast.Constant(value=str() as text):
                return text
            case ast.Name() | ast.Attribute():
                value = self._constants.get(".".join(path_of(node)))
                return as_float(value) if isinstance(value, (bool, int, float)) else value
            case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign):
                inner = self._constant(node.operand)
                if isinstance(inner, float):
                    return -inner if isinstance(sign, ast.USub) else inner
            case ast.BinOp():
                left, right = self._constant(node.left), self._constant(node.right)
                if isinstance(left, float) and isinstance(right, float):
                    with suppress(ArithmeticError):
                        result = _ARITHMETIC[type(node.op)](left, right)
                        return None if isnan(result) else result
        return None

    def _truth(self, node: ast.expr) -> _Term:
        """The term of a value that is true or false."""
        return _Term(ast.unparse(node), choices=(0.0, 1.0))

    def _value(self, node: ast.expr, constant: object) -> _Term:
        """The term of a value that is compared with a constant."""
        shown, kind, low, high = ast.unparse(node), None, -inf, inf
        if isinstance(node, (ast.Name, ast.Attribute)):
            with suppress(UnknownNameError):
                described = self._vocabulary.described(path_of(node))
                kind, low, high = described.type, described.low, described.high
        if kind is bool:
            return self._truth(node)
        choices = choices_of(kind) if path_of(node)[:1] != ("memory",) else ()
        return _Term(shown, low, high, choices, is_text=isinstance(constant, str))


def _all_of(parts: list[_Alternatives]) -> _Alternatives:
    found = _ALWAYS
    for part in parts:
        found = _both(found, part)
    return found


def _any_of(parts: list[_Alternatives]) -> _Alternatives:
    return tuple(dict.fromkeys(each for part in parts for each in part))


def _both(one: _Alternatives, other: _Alternatives) -> _Alternatives:
    if len(one) * len(other) > MAX_ALTERNATIVES:
        raise _TooManyError
    return tuple(dict.fromkeys(first | second for first in one for second in other))


def _impossible_term(tests: frozenset[_Test], *, ranges: bool = True) -> _Term | None:
    """A term of which no value fulfils all its tests; None if there is none."""
    by_term: dict[_Term, list[_Test]] = {}
    for test in tests:
        by_term.setdefault(test.term, []).append(test)
    for term, own in by_term.items():
        if not any(_fulfils(value, own) for value in _values(term, own, ranges)):
            return term
    return None


def _fulfils(value: object, tests: list[_Test]) -> bool:
    try:
        return all(_COMPARE[test.operator](value, test.constant) for test in tests)
    except TypeError:  # a text and a number: not decided here
        return True


def _values(term: _Term, tests: list[_Test], ranges: bool) -> list[object]:
    """Values of a term of which one fulfils some tests if any does."""
    if term.choices:
        return list(term.choices)
    if term.is_text:
        return [*(test.constant for test in tests), "\0"]
    numbers = sorted({test.constant for test in tests if isinstance(test.constant, float)})
    between = [(a + b) / 2 for a, b in pairwise(numbers)]
    outside = [numbers[0] - 1, numbers[-1] + 1] if numbers else [0.0]
    low, high = (term.low, term.high) if ranges else (-inf, inf)
    return [value for value in (*numbers, *between, *outside, low, high) if low <= value <= high]


def _reason(tests: frozenset[_Test]) -> Message:
    """Why an alternative is not possible."""
    term = _impossible_term(tests, ranges=False)
    if term is not None:
        return Message("guard.contradiction", names=cut(term.shown))
    term = _impossible_term(tests)
    assert term is not None
    own = " and ".join(sorted(str(test) for test in tests if test.term == term))
    code = "guard.at_least" if term.high == inf else "guard.from_to"
    ends = Message("guard.at_most" if term.low == -inf else code, low=term.low, high=term.high)
    return Message("guard.range", name=term.shown, meant=own, range=ends)
