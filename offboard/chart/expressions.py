"""Guards and values: which expressions are allowed, and their compiled form.

Allowed are numbers, texts, names, dotted names, comparison, and/or/not, + - * / and tuples. Calls,
subscripts, lambdas and everything else are refused with a reason. What is left is compiled as Python in
which each name is an attribute of the pilot, and with bounds for what could grow without end.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from numbers import Number

from offboard.chart.kinds import KindError, Kinds, masked
from offboard.chart.mission_texts import Message
from offboard.chart.vocabulary import UnknownNameError, Vocabulary, path_of
from offboard.pilot import Pilot

MAX_EXPRESSION_CHARACTERS = 500
MAX_BITS = 4096
"""Of a whole number that is calculated with: a mission may multiply one by itself at every tick."""
IN_LOCATION = -1

Evaluate = Callable[[Pilot], object]

_ALLOWED = (
    ast.Expression, ast.BoolOp, ast.And, ast.Or, ast.UnaryOp, ast.Not, ast.USub, ast.UAdd,
    ast.Compare, ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq,
    ast.BinOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Tuple, ast.Load,
    ast.Name, ast.Attribute, ast.Constant,
)  # fmt: skip

_REASONS = {
    ast.Call: "expression.call",
    ast.Subscript: "expression.subscript",
    ast.List: "expression.list",
    ast.Pow: "expression.power",
    ast.Mod: "expression.modulo",
    ast.BitAnd: "expression.bit_and",
    ast.BitOr: "expression.bit_or",
    ast.Invert: "expression.invert",
    ast.Is: "expression.is",
    ast.IsNot: "expression.is_not",
    ast.In: "expression.in",
    ast.NotIn: "expression.not_in",
    ast.IfExp: "expression.if",
    ast.NamedExpr: "expression.walrus",
}

_MISTAKES = (
    (r"&&|&", "expression.and"),
    (r"\|\||\|", "expression.or"),
    (r"!(?!=)", "expression.not"),
    (r"<>|≠|=!", "expression.unequal"),
    (r"=<|≤", "expression.at_most"),
    (r"=>|≥", "expression.at_least"),
    (r"===", "expression.equal"),
    (r"(?<![<>=!:+\-*/])=(?!=)", "expression.assignment"),
    (r":=|\+=|-=|\*=|/=", "expression.change"),
    (r"[‘’“”„‚«»´`]", "expression.quotes"),
    (r"[×·]", "expression.times"),
    (r"[−–—]", "expression.minus"),
    (r"÷", "expression.divide"),
    (r"%", "expression.percent"),
    (r"\b(?:AND|OR|NOT|And|Or|Not)\b", "expression.small"),
    (r"(?:^|(?<=\s))(?:if|when|while)\b", "expression.leave_out_if"),
    (r"\b(?:then|goto|else)\b", "expression.leave_out_then"),
    (r"(?<![\w.])\d[\d.]*\s*(?:ms|s|sec|m|cm|mm|rad|deg|px|°)(?!\w)", "expression.unit"),
    (r"\b(?:and|or)\s*(?:<=?|>=?|==|!=)", "expression.value_again"),
    (r"\b(?:and|or|not)\s*$", "expression.something_after"),
    (r"(?:<=?|>=?|==|!=|[-+*/])\s*$", "expression.value_after"),
)
_MISTAKE_PATTERNS = tuple((re.compile(pattern), code) for pattern, code in _MISTAKES)


class ExpressionError(Exception):
    """An expression that is not allowed, has unknown names or mixes kinds; the message is one line.

    Attributes:
        message: the same with its code.
        offset: of the fault, characters from the beginning of the expression.
    """

    def __init__(self, message: Message, offset: int = 0) -> None:
        super().__init__(str(message))
        self.message = message
        self.offset = offset


def check_guard(text: str, vocabulary: Vocabulary) -> None:
    """Check a condition: form, names, and that it is true or false. Raises `ExpressionError`."""
    with _as_expression_errors(text):
        Kinds(text.strip(), vocabulary).require_condition(_checked(text, vocabulary).body)


def check_assignment(location: str, text: str, vocabulary: Vocabulary) -> None:
    """Check both sides of `location = expression`.

    Raises:
        ExpressionError: with the reason; its offset is `IN_LOCATION` if the location is wrong.
    """
    path = tuple(location.split("."))
    try:
        vocabulary.check_assignable(path)
    except UnknownNameError as error:
        raise ExpressionError(error.message, IN_LOCATION) from None
    with _as_expression_errors(text):
        Kinds(text.strip(), vocabulary).require_assignable(path, _checked(text, vocabulary).body)


def _checked(text: str, vocabulary: Vocabulary) -> ast.Expression:
    """Check form and names."""
    tree = _parsed(text)
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and not node.args and not node.keywords and path_of(node.func):
            with suppress(UnknownNameError):
                vocabulary.type_of(path_of(node.func))
                name = ".".join(path_of(node.func))
                raise ExpressionError(Message("expression.parentheses", name=name), _offset(text, node))
    check_form(text)
    for node in _name_nodes(tree):
        try:
            vocabulary.type_of(path_of(node))
        except UnknownNameError as error:
            raise ExpressionError(error.message, _offset(text, node)) from None
    compile_value(text)
    return tree


def check_form(text: str) -> None:
    """Check that an expression has only what a mission can express. Raises `ExpressionError`."""
    tree = _parsed(text)
    for node in ast.walk(tree):
        if not isinstance(node, _ALLOWED):
            code = _REASONS.get(type(node), "expression.kind")
            message = Message(code, kind=type(node).__name__)
            raise ExpressionError(message, _offset(text, _around(tree, node)))
        if isinstance(node, ast.Constant) and not isinstance(node.value, (bool, int, float, str)):
            raise ExpressionError(Message("expression.constant", value=node.value), _offset(text, node))


@contextmanager
def _as_expression_errors(text: str) -> Iterator[None]:
    try:
        yield
    except KindError as error:
        raise ExpressionError(error.message, _offset(text, error.node)) from None
    except RecursionError:
        raise ExpressionError(Message("expression.deep")) from None


def _around(tree: ast.AST, inner: ast.AST) -> ast.AST:
    """The node, or the one around it that has a position in the text."""
    if hasattr(inner, "col_offset"):
        return inner
    return next((node for node in ast.walk(tree) if inner in ast.iter_child_nodes(node)), tree)


def _offset(text: str, node: ast.AST) -> int:
    """Characters before a node; the tree counts bytes."""
    stripped = text.lstrip()
    before = stripped.encode()[: getattr(node, "col_offset", 0)]
    return len(text) - len(stripped) + len(before.decode(errors="ignore"))


@lru_cache(maxsize=1024)
def compile_value(text: str) -> Evaluate:
    """An expression as a function of the pilot. Raises `ExpressionError` if its form is not allowed."""
    check_form(text)
    pilot = ast.arguments(posonlyargs=[], args=[ast.arg("pilot")], kwonlyargs=[], kw_defaults=[], defaults=[])
    function = ast.Expression(ast.Lambda(pilot, _OfPilot().visit(_parsed(text)).body))
    try:
        code = compile(ast.fix_missing_locations(function), "<expression>", "eval")
    except (ValueError, RecursionError, MemoryError):
        raise ExpressionError(Message("expression.too_deep")) from None
    evaluate: Evaluate = eval(code, {"__builtins__": {}, "number": _number})
    return evaluate


class _OfPilot(ast.NodeTransformer):
    """Makes names attributes of the pilot, and has what is calculated with be numbers of a bounded size.

    The vocabulary has no name that begins with "_"; here they are refused once more.
    """

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        _refuse_private(node.attr)
        self.generic_visit(node)
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        _refuse_private(node.id)
        return ast.Attribute(ast.Name("pilot", ast.Load()), node.id, ast.Load())

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        return ast.BinOp(_number_of(node.left), node.op, _number_of(node.right))

    def visit_Tuple(self, node: ast.Tuple) -> ast.expr:
        self.generic_visit(node)
        return ast.Tuple([_number_of(each) for each in node.elts], ast.Load())


def _refuse_private(name: str) -> None:
    if name.startswith("_"):
        raise ExpressionError(Message("expression.kind", kind=repr(name)))


def _number_of(node: ast.expr) -> ast.expr:
    is_number = isinstance(node, ast.Constant) and isinstance(node.value, float)
    return node if is_number else ast.Call(ast.Name("number", ast.Load()), [node], [])


def _number(value: object) -> object:
    """A value that may be calculated with; a variable may have any, and be calculated with at every tick."""
    if not isinstance(value, (float, int, Number)):
        raise TypeError(f"{str(value)[:40]!r} is no number")
    if isinstance(value, int) and value.bit_length() > MAX_BITS:
        raise ValueError(f"a whole number of more than {MAX_BITS} bits is too large")
    return value


def names_in(text: str) -> tuple[str, ...]:
    """The dotted names of a checked expression, each once, in their order; none of an empty one."""
    nodes = reversed(_name_nodes(_parsed(text))) if text else ()
    return tuple(dict.fromkeys(".".join(path_of(node)) for node in nodes))


def _parsed(text: str) -> ast.Expression:
    if not text.strip():
        raise ExpressionError(Message("expression.empty"))
    if len(text) > MAX_EXPRESSION_CHARACTERS:
        raise ExpressionError(Message("expression.long", limit=MAX_EXPRESSION_CHARACTERS))
    try:
        return ast.parse(text.strip(), mode="eval")
    except SyntaxError as error:
        raise _syntax_error(text, (error.offset or 1) - 1) from None
    except (ValueError, RecursionError, MemoryError):
        raise ExpressionError(Message("expression.too_deep")) from None


def _syntax_error(text: str, error_at: int) -> ExpressionError:
    """What is wrong with a text that is no expression; Python's parser stopped at `error_at`."""
    plain = masked(text)
    for pattern, code in _MISTAKE_PATTERNS:
        found = pattern.search(plain)
        if found:
            sign = found.group().strip()
            first, number = (re.match(pattern, sign) for pattern in (r"\w+", r"[\d.]+"))
            words = {
                "sign": sign,
                "lower": sign.lower(),
                "first": first.group() if first else sign,
                "number": number.group() if number else sign,
            }
            return ExpressionError(Message(code, **words), found.start())
    if plain.count("'") % 2 or plain.count('"') % 2:
        at = max(plain.rfind("'"), plain.rfind('"'))
        return ExpressionError(Message("expression.open_text", sign=plain[at]), at)
    opened, closed = plain.count("("), plain.count(")")
    if opened > closed:
        return ExpressionError(Message("expression.no_closing"), plain.find("("))
    if closed > opened:
        return ExpressionError(Message("expression.no_opening"), plain.rfind(")"))
    at = min(max(error_at, 0), len(text) - 1)
    rest = text[at:].strip()
    return ExpressionError(Message("expression.not_understood", rest=rest[:30]), at)


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
            raise ExpressionError(Message("expression.after_name", name=path_of(node)[-1]))
        else:
            pending.extend(ast.iter_child_nodes(node))
    return found
