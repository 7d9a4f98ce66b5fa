"""No text of a table is a formula for a spreadsheet."""

import pytest

from framerunner.files.spreadsheet import csv_text, spreadsheet_cell


@pytest.mark.parametrize(
    "before", ["", " ", "\t", "\r", "\n", "\u00a0", "\u3000", "\u200b", "\ufeff", "\u2066"]
)
def test_what_a_spreadsheet_takes_for_a_formula_is_marked(before):
    for sign in "=+-@＝＋－＠﹦﹢﹣﹫":
        assert spreadsheet_cell(f"{before}{sign}cmd|'/c calc'!A1") == f"'{before}{sign}cmd|'/c calc'!A1"


@pytest.mark.parametrize(
    "text", ["", "calm-17", "a=1", "no frame: 3 - 2", "red.turning", "'=1", "¡hola!", "  "]
)
def test_other_texts_are_unchanged(text):
    assert spreadsheet_cell(text) == text


def test_a_cell_that_begins_behind_a_semicolon_or_in_a_new_line_counts():
    assert spreadsheet_cell("a; =1;b\n+2;-") == "a;' =1;b\n'+2;'-"
    assert spreadsheet_cell("\tx") == "'\tx"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("a=1", "a=1"),
        ("＝1", "'＝1"),
        (-1.5, "-1.5"),
        (None, ""),
        (True, "true"),
        (3, "3"),
        (("a", "=b", -2), "a;'=b;-2"),
        ({"@state": 2.5, "b": -1.0}, "'@state=2.5;b=-1.0"),
    ],
)
def test_texts_are_marked_and_all_else_is_left_alone(value, text):
    assert csv_text(["=column", "last"], [[value, 1]]) == f"'=column,last\r\n{text},1\r\n"
