import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from framerunner.files.text_file import MAX_TEXT_BYTES
from framerunner.files.yaml_text import to_yaml
from scenarios.random_numbers import LevelError, Range
from scenarios.random_scenarios import LEVEL_FILES, Level, load_level

CALM = to_yaml(load_level("calm").model_dump(exclude_unset=True))


@pytest.mark.parametrize("name", LEVEL_FILES.names())
def test_each_level_is_named_as_its_file_and_described(name):
    level = load_level(name)
    assert level.name == name
    assert level.description


def test_calm_is_as_declared():
    layout = load_level("calm").layout
    assert layout.x_m == layout.y_m == Range(low=-4, high=4)
    assert layout.apart_m == 1.5
    assert layout.frame_z_m == Range(low=0.5, high=2.5)
    assert layout.frame_yaw_rad == layout.start_yaw_rad == Range(low=-3.141, high=3.141)


def test_a_level_is_frozen():
    with pytest.raises(ValidationError, match="frozen"):
        load_level("calm").layout.apart_m = 1.0


def test_a_level_loads_by_path(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + CALM.encode())
    assert load_level(path) == load_level(str(path)) == load_level("calm")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "f.yaml:1: empty; it needs at least `name: my-level`"),
        ("- a", 'f.yaml:1: must hold fields like `name: my-level`, not ["a"]'),
        ("name: a", "f.yaml:1: layout is missing; add it"),
        ("name: a: b", "f.yaml:1:8: not valid YAML: mapping values are not allowed here"),
        (b"name: a\n# \xff", "f.yaml:2: not UTF-8 text; save the file as UTF-8"),
        ("#" * (MAX_TEXT_BYTES + 1), "f.yaml: 1000001 bytes is too large for a level; 1000000 at most"),
        (
            CALM + "fog: 1\n",
            "f.yaml:20: fog is not a known field; known here: name, description, layout, closeness, "
            "shapes, obstacles, wind, faults, camera, view, light, clutter, textures, base_marker, airframe, "
            "sensors",
        ),
        (CALM + "  apart: 1\n", "f.yaml:20: layout.apart is not a known field; did you mean apart_m?"),
        (
            CALM + "  near: 1\n",
            "f.yaml:20: layout.near is not a known field; known here: x_m, y_m, apart_m, frame_z_m, "
            "frame_yaw_rad, start_yaw_rad",
        ),
        (
            CALM.replace("    high: 4.0", "    high: 4.0\n    hihg: 4.0", 1),
            "f.yaml:7: layout.x_m.hihg is not a known field; did you mean high?",
        ),
        (CALM.replace("1.5", "0.0"), "f.yaml:10: layout.apart_m is 0.0: must be at least 0.01"),
        (CALM.replace("1.5", ".nan"), "f.yaml:10: layout.apart_m is NaN: must be a finite number"),
        (CALM.replace("0.5", "2.6"), "f.yaml:12: layout.frame_z_m.low 2.6 must not be above high 2.5"),
        (
            CALM.replace("0.5", "0.5001"),
            "f.yaml:12: layout.frame_z_m.low 0.5001 is too fine; use at most three decimals",
        ),
        (
            CALM.replace("low: -4.0", "low: -5.1", 1),
            "f.yaml:5: layout.x_m.low -5.1 cannot be flown; keep within -5 and 5",
        ),
        (
            CALM.replace("low: 0.5", "low: 0.1"),
            "f.yaml:12: layout.frame_z_m.low 0.1 cannot be flown; keep within 0.11 and 4",
        ),
        (
            CALM.replace("high: 2.5", "high: 4.5"),
            "f.yaml:13: layout.frame_z_m.high 4.5 cannot be flown; keep within 0.11 and 4",
        ),
        (
            CALM.replace("high: 3.141", "high: 180.0", 1),
            "f.yaml:16: layout.frame_yaw_rad.high 180.0 cannot be flown; keep within -6.283 and 6.283",
        ),
    ],
)
def test_faults_give_one_line(text, message):
    with pytest.raises(LevelError) as caught:
        LEVEL_FILES.parse(text, "f.yaml")
    assert str(caught.value) == message


@given(st.text(max_size=100) | st.binary(max_size=100))
def test_any_text_gives_one_line(content):
    with pytest.raises(LevelError, match=r"\Af\.yaml:.+\Z"):
        LEVEL_FILES.parse(content, "f.yaml")


json_like = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.dictionaries(st.sampled_from(["low", "high", "x_m", "apart_m", "x"]), inner, max_size=3),
    max_leaves=8,
)


@given(st.dictionaries(st.sampled_from([*Level.model_fields, "x"]), json_like, min_size=1))
def test_wrong_values_in_known_fields_give_one_line(fields):
    with pytest.raises(LevelError, match=r"\Af\.yaml:.+\Z"):
        LEVEL_FILES.parse(to_yaml(fields), "f.yaml")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("clam", 'unknown level "clam"; did you mean calm? Known: '),
        ("Calm", 'unknown level "Calm"; did you mean calm? Known: '),
        ("zzz", 'unknown level "zzz"; Known: '),
        ("", 'unknown level ""; Known: '),
        ("a\nb", 'unknown level "a\\nb"; '),
        ("nowhere.yaml", "nowhere.yaml: no such file; give a path or one of: "),
        ("bad\0.yaml", "bad?.yaml: cannot be read:"),
        ("/", "/: is a directory; give a level file"),
    ],
)
def test_unknown_names_are_refused(name, message):
    with pytest.raises(LevelError) as caught:
        load_level(name)
    assert str(caught.value).startswith(message)
    assert len(str(caught.value).splitlines()) == 1
