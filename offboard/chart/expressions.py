"""Guards and values: which expressions are allowed, and their fast form.

Allowed are numbers, texts, names, dotted names, comparison, and/or/not, + - * / and tuples. Calls,
subscripts, lambdas and everything else are refused here with a reason, and a second time by
python-statemachine's restricted evaluator, which also does the evaluating.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from statemachine.spec_parser import parse_expr

from offboard.chart.hints import hint_for_syntax
from offboard.chart.kinds import KindError, Kinds
from offboard.chart.vocabulary import UnknownNameError, Vocabulary, path_of
from offboard.pilot import Pilot

MAX_EXPRESSION_CHARACTERS = 500
IN_LOCATION = -1

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
    ast.List: "[...] is not possible; a place stands in parentheses: (x, y, z)",
    ast.Pow: "** is not possible; write a product",
    ast.Mod: "% is not possible here",
    ast.BitAnd: "write 'and' instead of '&'",
    ast.BitOr: "write 'or' instead of '|'",
    ast.Invert: "write 'not' instead of '~'",
    ast.Is: "write '==' instead of 'is'",
    ast.IsNot: "write '!=' instead of 'is not'",
    ast.In: "'in' is not possible; compare with each: colour == 'red' or colour == 'blue'",
    ast.NotIn: "'not in' is not possible; compare with each: colour != 'red' and colour != 'blue'",
    ast.IfExp: "'if' is not possible here; write a transition for each case",
    ast.NamedExpr: ":= is not possible; assign under 'enter' or 'during'",
}


class ExpressionError(Exception):
    """An expression that is not allowed, names something unknown or mixes what does not fit, in one line.

    Attributes:
        offset: how many characters into the expression the fault stands.
    """

    def __init__(self, text: str, offset: int = 0) -> None:
        super().__init__(text)
        self.offset = offset


def check_guard(text: str, vocabulary: Vocabulary) -> None:
    """Check a condition: form, names, and that it gives true or false.

    Raises:
        ExpressionError: with the reason.
    """
    tree = _checked(text, vocabulary)
    with _kind_errors(text):
        Kinds(text.strip(), vocabulary).want_condition(tree.body)


def check_assignment(location: str, text: str, vocabulary: Vocabulary) -> None:
    """Check both sides of `location = expression`.

    Raises:
        ExpressionError: with the reason; the offset counts in the expression, below 0 in the location.
    """
    path = tuple(location.split("."))
    try:
        vocabulary.check_assignable(path)
    except UnknownNameError as error:
        raise ExpressionError(str(error), IN_LOCATION) from None
    tree = _checked(text, vocabulary)
    with _kind_errors(text):
        Kinds(text.strip(), vocabulary).want_for(path, tree.body)


def _checked(text: str, vocabulary: Vocabulary) -> ast.Expression:
    """Check form and names."""
    tree = _parsed(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and not node.args and not node.keywords:
            name = ".".join(path_of(node.func))
            if name and _is_known(vocabulary, path_of(node.func)):
                raise ExpressionError(f"write it without parentheses: {name}", _offset(text, node))
        if not isinstance(node, _ALLOWED):
            reason = _REASONS.get(type(node), f"{type(node).__name__} is not possible here")
            raise ExpressionError(reason, _offset(text, _around(tree, node)))
        if isinstance(node, ast.Constant) and not isinstance(node.value, (bool, int, float, str)):
            raise ExpressionError(f"{node.value!r} is not possible here", _offset(text, node))
    for node in _name_nodes(tree):
        try:
            vocabulary.type_of(path_of(node))
        except UnknownNameError as error:
            raise ExpressionError(str(error), _offset(text, node)) from None
    try:
        parse_expr(text, _name_of_pilot)
    except (ValueError, SyntaxError) as error:
        raise ExpressionError(str(error)) from None
    except RecursionError:
        raise ExpressionError("is nested too deep; write it simpler") from None
    return tree


@contextmanager
def _kind_errors(text: str) -> Iterator[None]:
    try:
        yield
    except KindError as error:
        raise ExpressionError(str(error), _offset(text, error.node)) from None
    except RecursionError:
        raise ExpressionError("is nested too deep; write it simpler") from None


def _is_known(vocabulary: Vocabulary, path: tuple[str, ...]) -> bool:
    try:
        vocabulary.type_of(path)
    except UnknownNameError:
        return False
    return True


def _around(tree: ast.AST, inner: ast.AST) -> ast.AST:
    """The node itself, or the one around it that has a place in the text."""
    if hasattr(inner, "col_offset"):
        return inner
    return next((node for node in ast.walk(tree) if inner in ast.iter_child_nodes(node)), tree)


def _offset(text: str, node: ast.AST) -> int:
    """Characters before a node; the tree counts bytes."""
    stripped = text.lstrip()
    before = stripped.encode()[: getattr(node, "col_offset", 0)]
    return len(text) - len(stripped) + len(before.decode(errors="ignore"))


def compile_value(text: str) -> Evaluate:
    """A checked expression as a function of the pilot, by the library's restricted evaluator."""
    evaluate: Evaluate = parse_expr(text, _name_of_pilot)
    return evaluate


def names_in(text: str) -> tuple[str, ...]:
    """The dotted names of a checked expression, each once, in the order in which they stand there."""
    return tuple(dict.fromkeys(".".join(path) for path in reversed(_paths(text)))) if text else ()


def _paths(text: str) -> list[tuple[str, ...]]:
    return [path_of(node) for node in _name_nodes(_parsed(text))]


def _name_of_pilot(name: str) -> Evaluate:
    def read(pilot: Pilot) -> object:
        value: object = getattr(pilot, name)
        return value

    read.__name__ = name
    return read


def _parsed(text: str) -> ast.Expression:
    if not text.strip():
        raise ExpressionError("nothing stands here; write an expression (what follows a # is not read)")
    if len(text) > MAX_EXPRESSION_CHARACTERS:
        raise ExpressionError(f"is longer than {MAX_EXPRESSION_CHARACTERS} characters; split it")
    try:
        return ast.parse(text.strip(), mode="eval")
    except SyntaxError as error:
        at, mend = hint_for_syntax(text, (error.offset or 1) - 1)
        raise ExpressionError(mend, at) from None
    except (ValueError, RecursionError, MemoryError):
        raise ExpressionError("cannot be understood: too deep") from None


def _name_nodes(tree: ast.AST) -> list[ast.expr]:
    """Every dotted name of an expression, whole, the last one first."""
    found: list[ast.expr] = []
    pending = [tree]
    while pending:
        node = pending.pop()
        inner = node
        while isinstance(inner, ast.Attribute):
            inner = inner.value
        if isinstance(inner, ast.Name) and isinstance(node, ast.expr):
            found.append(node)
        elif isinstance(node, ast.Attribute):
            raise ExpressionError(f"'.{path_of(node)[-1]}' must follow a name")
        else:
            pending.extend(ast.iter_child_nodes(node))
    return found
