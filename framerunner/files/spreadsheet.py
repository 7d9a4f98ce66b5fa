"""Tables for spreadsheets, which take none of their texts for a formula."""

from __future__ import annotations

import csv
import re
import unicodedata
from collections.abc import Iterable, Mapping
from io import StringIO

_FORMULA = frozenset("=+-@")
_INVISIBLE = frozenset({"Cc", "Cf", "Zs", "Zl", "Zp"})


def csv_text(columns: Iterable[str], rows: Iterable[Iterable[object]], *, line_end: str = "\r\n") -> str:
    """Rows as comma-separated values with a header line.

    Lists are joined by ";", mappings are written "turning=2.5;crossing=4", None is empty.
    """
    text = StringIO()
    csv.writer(text, lineterminator=line_end).writerows(map(_cell, row) for row in (columns, *rows))
    return text.getvalue()


def _cell(value: object) -> str:
    if isinstance(value, Mapping):
        return ";".join(f"{_cell(key)}={_cell(each)}" for key, each in value.items())
    if isinstance(value, tuple):
        return ";".join(map(_cell, value))
    if isinstance(value, str):
        return spreadsheet_cell(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else str(value)


def spreadsheet_cell(text: str) -> str:
    """Put a ' before each part of a text that a spreadsheet would take for a formula.

    A cell that begins with = + - or @ is a formula, which may fetch a page or start a program; spaces,
    invisible characters and full-width forms (＝) before or instead of it do not prevent that. Where a comma
    is the decimal separator, a semicolon begins the next cell, so what follows one counts as well.

    Args:
        text: from any source; not a number, whose sign would be taken for a formula's.
    """
    if _is_formula(text) or text[:1] in {"\t", "\r"}:
        return f"'{text}"
    parts = re.split(r"([;\n\r])", text)
    return "".join(f"'{part}" if _is_formula(part) else part for part in parts)


def _is_formula(text: str) -> bool:
    for character in text:
        if unicodedata.category(character) not in _INVISIBLE:
            return unicodedata.normalize("NFKC", character)[0] in _FORMULA
    return False
