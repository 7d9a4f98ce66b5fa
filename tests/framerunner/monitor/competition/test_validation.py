import pytest

from framerunner.monitor.competition.validation import (
    RefusedError,
    free_text,
    from_wire,
    name_key,
    shown,
    team_name,
)


@pytest.mark.parametrize("name", ["A", "x" * 60, "Équipe Ñandú 🚁", "الصقور", "ฝูงบิน", "<b>", "=1+1", "👩‍🚀"])
def test_names_of_all_kinds_are_taken(name):
    assert team_name(f"  {name} ") == name


@pytest.mark.parametrize(
    "name",
    [
        "",
        "   ",
        "x" * 61,
        "a\x00b",
        "a\nb",
        "a\tb",
        "\u200b",
        "\ud800",
        "a\u2028b",
        "abc\u202ecba",
        "\x1b[31m",
    ],
)
def test_invisible_names_and_control_characters_are_refused_in_one_line(name):
    with pytest.raises(RefusedError, match=r"^name ") as refusal:
        team_name(name)
    words = str(refusal.value)
    assert len(words.splitlines()) == 1 and "\x1b" not in words and refusal.value.status == 422


@pytest.mark.parametrize(
    ("one", "other"),
    [("Falken", "fALKEN"), ("Straße", "STRASSE"), ("a  b", "A B"), ("ﬁn", "fin"), ("a\u200bb", "ab")],
)
def test_names_that_look_alike_are_the_same(one, other):
    assert name_key(one) == name_key(other)


def test_different_names_differ():
    assert len({name_key(name) for name in ("Falken", "Falke", "Fälken", "الصقور")}) == 4


def test_remarks_may_have_lines_but_no_other_controls():
    assert free_text(" a\r\nb\tc\n", "remarks", 10) == "a\nb\tc"
    with pytest.raises(RefusedError, match=r"remarks .* 11 characters; use 10"):
        free_text("x" * 11, "remarks", 10)
    with pytest.raises(RefusedError, match="control"):
        free_text("a\x07", "remarks", 10)


def test_received_texts_are_cut_and_lose_control_characters():
    assert from_wire("truth\x00\ud800\n" + "x" * 100, 20) == "truth" + "x" * 12
    assert from_wire(None, 5) == from_wire(17, 5) == ""


def test_values_are_shown_short_and_on_one_line():
    assert shown("a\nb" + "c" * 100) == '"a\ufffdb' + "c" * 37 + '…"'
