"""Guards and values: which expressions are allowed, and their fast form.

Allowed are numbers, texts, names, dotted names, comparison, and/or/not, + - * / and tuples. Calls,
subscripts, lambdas and everything else are refused here with a reason, and a second time by
python-statemachine's restricted evaluator, which also does the evaluating.
"""

from __future__ import annotations

import ast
from collections.abc import Callable

from statemachine.spec_parser import parse_expr

from offboard.chart.vocabulary import UnknownNameError, Vocabulary, choices_of
from offboard.pilot import Pilot

MAX_EXPRESSION_CHARACTERS = 500

Evaluate = Callable[[Pilot], object]

_ALLOWED = (
    ast.Expression, ast.BoolOp, ast.And, ast.Or, ast.UnaryOp, ast.Not, ast.USub, ast.UAdd,
    ast.Compare, ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq,
    ast.BinOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Tuple, ast.Load,
    ast.Name, ast.Attribute, ast.Constant,
)  # fmt: skip

_REASONS = {
    ast.Call: "calls are not possible; name a value of the pilot, or set goal_m and read distance_to_goal_m",
    ast.Subscript: "[...] is not possible; name the part, such as imu.x",
    ast.Pow: "** is not possible; write a product",
    ast.NamedExpr: ":= is not possible; assign under 'enter' or 'during'",
}


class ExpressionError(Exception):
    """An expression that is not allowed or names something unknown, in one line."""


def check_expression(text: str, vocabulary: Vocabulary) -> None:
    """Check form and names of a guard or value.

    Raises:
        ExpressionError: with the reason.
    """
    tree = _parsed(text)
    for node in ast.walk(tree):
        if not isinstance(node, _ALLOWED):
            raise ExpressionError(_REASONS.get(type(node), f"{type(node).__name__} is not possible here"))
        if isinstance(node, ast.Constant) and not isinstance(node.value, (bool, int, float, str)):
            raise ExpressionError(f"{node.value!r} is not possible here")
    try:
        for path in _paths(tree):
            vocabulary.type_of(path)
    except UnknownNameError as error:
        raise ExpressionError(str(error)) from None
    try:
        parse_expr(text, _name_of_pilot)
    except (ValueError, SyntaxError) as error:
        raise ExpressionError(str(error)) from None


def check_assignment(location: str, text: str, vocabulary: Vocabulary) -> None:
    """Check both sides of `location = expression`.

    Raises:
        ExpressionError: with the reason.
    """
    path = tuple(location.split("."))
    try:
        vocabulary.check_assignable(path)
    except UnknownNameError as error:
        raise ExpressionError(str(error)) from None
    check_expression(text, vocabulary)
    choices = choices_of(vocabulary.type_of(path))
    value = _parsed(text).body
    if choices and isinstance(value, ast.Constant) and value.value not in choices:
        listed = ", ".join(map(repr, choices))
        raise ExpressionError(f"{location} cannot be {value.value!r}; it is one of {listed}")


def compile_value(text: str) -> Evaluate:
    """A checked expression as a function of the pilot, by the library's restricted evaluator."""
    evaluate: Evaluate = parse_expr(text, _name_of_pilot)
    return evaluate


def names_in(text: str) -> tuple[str, ...]:
    """The dotted names of a checked expression, each once, in the order in which they stand there."""
    return tuple(dict.fromkeys(".".join(path) for path in reversed(_paths(_parsed(text))))) if text else ()


def _name_of_pilot(name: str) -> Evaluate:
    def read(pilot: Pilot) -> object:
        value: object = getattr(pilot, name)
        return value

    read.__name__ = name
    return read


def _parsed(text: str) -> ast.Expression:
    if not text.strip():
        raise ExpressionError("nothing stands here; write an expression")
    if len(text) > MAX_EXPRESSION_CHARACTERS:
        raise ExpressionError(f"is longer than {MAX_EXPRESSION_CHARACTERS} characters; split it")
    try:
        return ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        reason = error.msg if isinstance(error, SyntaxError) else "too deep"
        raise ExpressionError(f"cannot be understood: {reason}") from None


def _paths(tree: ast.AST) -> list[tuple[str, ...]]:
    """Every dotted name of an expression, whole, the last one first."""
    found: list[tuple[str, ...]] = []
    pending = [tree]
    while pending:
        node = pending.pop()
        parts: list[str] = []
        inner = node
        while isinstance(inner, ast.Attribute):
            parts.append(inner.attr)
            inner = inner.value
        if isinstance(inner, ast.Name):
            found.append((inner.id, *reversed(parts)))
        elif parts:
            raise ExpressionError(f"'.{parts[-1]}' must follow a name")
        else:
            pending.extend(ast.iter_child_nodes(node))
    return found
