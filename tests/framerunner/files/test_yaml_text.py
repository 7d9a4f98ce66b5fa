import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.files.yaml_text import MAX_DEPTH, YamlError, compose, follow, read_yaml, to_yaml

scalars = (
    st.none()
    | st.booleans()
    | st.integers(-(10**18), 10**18)
    | st.floats(allow_nan=False)
    | st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
)
trees = st.recursive(
    scalars,
    lambda inner: (
        st.lists(inner, max_size=4).map(tuple)
        | st.dictionaries(st.text("abyno1.~e", max_size=6), inner, max_size=4)
    ),
    max_leaves=12,
)


@given(trees.filter(lambda value: value is not None))
def test_what_is_written_is_read_back(value):
    if isinstance(value, dict | tuple):
        back = read_yaml(to_yaml(_listed(value)))
    else:
        back = read_yaml(to_yaml(value))
    assert back == value
    assert type(back) is type(value)


def _listed(value):
    if isinstance(value, tuple):
        return [_listed(item) for item in value]
    if isinstance(value, dict):
        return {key: _listed(item) for key, item in value.items()}
    return value


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 0.001),
        ("-.5", -0.5),
        ("007", 7),
        ("yes", "yes"),
        ("1:30", "1:30"),
        ("2020-01-01", "2020-01-01"),
        ("'1'", "1"),
        ("~", None),
        ("+.inf", float("inf")),
        ("9" * 400, float("inf")),
        ("1 # one", 1),
    ],
)
def test_scalars_follow_yaml_1_2(text, value):
    assert read_yaml(text) == value


def test_lines_are_those_of_keys_and_items():
    tree = compose("name: a\n\nframes:\n  - x: 1\n    y: 2\n  - {x: 3,\n     y: 4}\n")

    def line(path):
        return follow(tree, path)[-1][0].line

    assert line(("name",)) == 1
    assert line(("frames",)) == 3
    assert line(("frames", 0, "y")) == 5
    assert line(("frames", 1, "y")) == 7
    assert line(("frames", 1, "missing", "deeper")) == 6


def test_an_empty_text_has_no_value():
    assert read_yaml("# only a comment\n") is None


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("a: 1\nb: 2\na: 3", 3, "is given twice, first on line 1"),
        ("a: &x 1\nb: *x", 1, "anchor &x"),
        ("a: 1\nb: *x", 2, "alias *x"),
        ("a:\n  !!python/name:os.system x", 2, "tag"),
        ("a: 1\n---\nb: 2", 2, "second document"),
        ("? [1, 2]\n: 3", 1, "plain text"),
        ("a: 1\nb: [", 2, "not valid YAML"),
        ("a: 1\n\tb: 2", 2, "not valid YAML"),
        ("a: 1\nb: \x07", 2, "U+0007"),
        ("[" * 50_000, 1, f"deeper than {MAX_DEPTH}"),
        ("a: [" + "1, " * 30_000 + "]", 1, "more than"),
    ],
)
def test_refused_yaml_names_its_line(text, line, words):
    with pytest.raises(YamlError) as caught:
        read_yaml(text)
    assert caught.value.place.line == line
    assert words in str(caught.value)


def test_an_alias_bomb_is_refused_at_its_first_anchor():
    bomb = "a: &a [x, x]\n" + "".join(f"b{i}: &b{i} [*a, *a]\n" for i in range(9))
    with pytest.raises(YamlError, match="anchor &a") as caught:
        read_yaml(bomb)
    assert caught.value.place.line == 1
