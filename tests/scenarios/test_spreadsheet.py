"""No text becomes a formula."""

import pytest

from scenarios.spreadsheet import cell


@pytest.mark.parametrize("sign", "=+-@＝＋－＠﹦﹢﹣﹫")
@pytest.mark.parametrize(
    "before", ["", " ", "\t", "\r", "\n", "\u00a0", "\u3000", "\u200b", "\ufeff", "\u2066"]
)
def test_what_a_spreadsheet_takes_for_a_formula_is_marked(before, sign):
    assert cell(f"{before}{sign}cmd|'/c calc'!A1") == f"'{before}{sign}cmd|'/c calc'!A1"


@pytest.mark.parametrize(
    "text", ["", "calm-17", "a=1", "no frame: 3 - 2", "red.turning", "'=1", "¡hola!", "  "]
)
def test_all_else_stays_as_it_is(text):
    assert cell(text) == text


def test_a_cell_that_begins_behind_a_semicolon_or_in_a_new_line_counts():
    assert cell("a; =1;b\n+2;-") == "a;' =1;b\n'+2;'-"
    assert cell("\tx") == "'\tx"
