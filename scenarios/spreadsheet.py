"""Texts of other people in tables that are opened with a spreadsheet.

A cell that begins with = + - or @ is taken for a formula, which may fetch a page or start a program; spaces,
invisible characters and full-width forms (＝) before or instead of it do not prevent that. Where a comma is
the decimal separator, a semicolon begins the next cell, so what follows one counts as well.
"""

from __future__ import annotations

import re
import unicodedata

_FORMULA = frozenset("=+-@")
_INVISIBLE = frozenset({"Cc", "Cf", "Zs", "Zl", "Zp"})
_BEGINNINGS = re.compile(r"([;\n\r])")


def cell(text: str) -> str:
    """A text that no spreadsheet takes for a formula: a ' stands before what would begin one.

    Args:
        text: of any origin; not a number, whose sign would be taken for a formula's.
    """
    if _is_formula(text) or text[:1] in {"\t", "\r"}:
        return f"'{text}"
    parts = _BEGINNINGS.split(text)
    return "".join(f"'{part}" if _is_formula(part) else part for part in parts)


def _is_formula(text: str) -> bool:
    for character in text:
        if unicodedata.category(character) not in _INVISIBLE:
            return unicodedata.normalize("NFKC", character)[0] in _FORMULA
    return False
