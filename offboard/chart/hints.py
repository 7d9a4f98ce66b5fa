"""What is meant by an expression or an action that is none: signs of other languages, forgotten signs."""

from __future__ import annotations

import re

_OPERATORS = (
    (r"&&|&", "write 'and' instead of '{}'"),
    (r"\|\||\|", "write 'or' instead of '{}'"),
    (r"!(?!=)", "write 'not' instead of '{}'"),
    (r"<>|≠|=!", "write '!=' instead of '{}'"),
    (r"=<|≤", "write '<=' instead of '{}'"),
    (r"=>|≥", "write '>=' instead of '{}'"),
    (r"===", "write '==' instead of '{}'"),
    (r"(?<![<>=!:+\-*/])=(?!=)", "'=' sets a value; to compare write '=='"),
    (r":=|\+=|-=|\*=|/=", "'{}' is not possible here; a guard only compares"),
    (r"[‘’“”„‚«»´`]", "write a straight quotation mark ' instead of {}"),
    (r"[×·]", "write '*' instead of '{}'"),
    (r"[−–—]", "write '-' instead of '{}'"),
    (r"÷", "write '/' instead of '{}'"),
    (r"%", "'{}' is not possible; write 0.3 for 30 %"),
    (r"\b(?:AND|OR|NOT|And|Or|Not)\b", "write '{lower}' in small letters"),
    (r"(?:^|(?<=\s))(?:if|when|while)\b", "leave '{}' out; 'when:' asks already"),
    (r"\b(?:then|goto|else)\b", "leave '{}' out; where it leads stands under 'to:'"),
    (
        r"(?<![\w.])\d[\d.]*\s*(?:ms|s|sec|m|cm|mm|rad|deg|px|°)(?!\w)",
        "write the number without a unit: {number} instead of {}",
    ),
    (r"\b(?:and|or)\s*(?:<=?|>=?|==|!=)", "name the value again after '{first}': a < 2 and a > 1"),
    (r"\b(?:and|or|not)\s*$", "something must follow '{}'"),
    (r"(?:<=?|>=?|==|!=|[-+*/])\s*$", "a value must follow '{}'"),
)
_SIGNS = tuple((re.compile(pattern), text) for pattern, text in _OPERATORS)
_TEXT = re.compile(r"'[^']*'|\"[^\"]*\"")
_DECIMAL_COMMA = re.compile(r"(?<![\w.])(\d+),(\d+)(?![\w.])")

_ACTIONS = (
    (":=", "to set a value write '=' instead of ':='"),
    ("==", "'==' compares; to set a value write one '='"),
    (r"^[a-z][\w.]*\s*:", "to set a value write '=' instead of ':'"),
    (r"[,;]|\band\b|\s-\s", "one action a line; begin each line with '- '"),
)

Hint = tuple[int, str]
"""How many characters into the text, and what to do."""


def hint_for_syntax(text: str, error_at: int) -> Hint:
    """Say what is wrong with a text that is no expression.

    Args:
        text: the expression.
        error_at: where Python's parser stopped, characters from its beginning.
    """
    plain = _TEXT.sub(lambda found: "_" * len(found.group()), text)  # what stands in quotes means nothing
    for pattern, mend in _SIGNS:
        found = pattern.search(plain)
        if found:
            sign = found.group().strip()
            first, number = (re.match(pattern, sign) for pattern in (r"\w+", r"[\d.]+"))
            words = {
                "lower": sign.lower(),
                "first": first.group() if first else sign,
                "number": number.group() if number else sign,
            }
            return found.start(), mend.format(sign, **words)
    if plain.count("'") % 2 or plain.count('"') % 2:
        at = max(plain.rfind("'"), plain.rfind('"'))
        return at, f"a text begins here and is never closed; put another {plain[at]} behind it"
    opened, closed = plain.count("("), plain.count(")")
    if opened != closed:
        return (
            (plain.find("("), "a ')' is missing")
            if opened > closed
            else (plain.rfind(")"), "a '(' is missing")
        )
    at = min(max(error_at, 0), len(text) - 1)
    rest = text[at:].strip()
    return at, f"cannot be understood from '{rest[:30]}' on; write a comparison such as imu.z > 1"


def decimal_comma(text: str) -> Hint | None:
    """Where a number is written with a comma, and how to write it; None if there is none."""
    found = _DECIMAL_COMMA.search(_TEXT.sub(lambda one: "_" * len(one.group()), text))
    if found is None:
        return None
    whole, part = found.groups()
    return found.start(), f"write decimals with a point: {whole}.{part} instead of {whole},{part}"


def hint_for_action(text: str, known: tuple[str, ...]) -> str:
    """What is meant by an action that does not exist; empty if that cannot be seen.

    Args:
        text: the action as written.
        known: primitives.
    """
    changed = re.match(r"([a-z][\w.]*)\s*([-+*/])=\s*(.+)", text)
    if changed:
        name, sign, value = changed.groups()
        return f"write it in full: {name} = {name} {sign} {value}"
    called = re.match(r"(\w+)\s*\((.*)\)?\s*$", text)
    if called and called.group(1) in known:
        if not called.group(2).strip(" )"):
            return f"write it without parentheses: {called.group(1)}"
        before = "; set goal_m in a line before it" if called.group(1) == "fly_to_goal" else ""
        return f"'{called.group(1)}' takes no values{before}"
    return next((mend for pattern, mend in _ACTIONS if re.search(pattern, text)), "")
