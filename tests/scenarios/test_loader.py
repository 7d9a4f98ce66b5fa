import os
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.files.text_file import MAX_TEXT_BYTES
from framerunner.files.yaml_text import to_yaml
from scenarios.loader import (
    dump_yaml,
    json_schema,
    list_scenarios,
    load_scenario,
    parse_scenario,
)
from scenarios.models import COLOURS, Base, Gate, Scenario, ScenarioError, StartPose
from scenarios.random_scenarios import load_level, random_scenario

NAMES = ["empty", "first-flight", "open-field", "round-1", "test-case-1", "test-case-2", "test-case-3"]


def layout(scenario):
    start = scenario.start
    gates = {gate.colour: (gate.x_m, gate.y_m, gate.z_m, gate.yaw_rad) for gate in scenario.frames}
    return (start.x_m, start.y_m, start.yaw_rad), gates


def test_these_scenarios_are_installed():
    assert list_scenarios() == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_each_scenario_is_named_as_its_file_and_has_its_base_under_the_start(name):
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.description
    assert (scenario.base.x_m, scenario.base.y_m) == (scenario.start.x_m, scenario.start.y_m)
    if name not in ("first-flight", "open-field"):
        assert (scenario.base.edge_m, scenario.base.top_m, scenario.try_limit_s) == (0.5, 0.51, 180.0)


def test_published_layouts():
    assert layout(load_scenario("test-case-1")) == (
        (-3, -3, 1),
        {"red": (3, 2, 2, 3), "green": (-2, 1, 0.5, 2), "blue": (3, -1, 1, 1)},
    )
    assert layout(load_scenario("test-case-2")) == (
        (1, 2, 2.5),
        {"red": (-2, -3, 1, -0.1), "green": (0, -3, 1.5, 0.1), "blue": (2, -3, 2, 0.4)},
    )
    assert layout(load_scenario("round-1")) == (
        (-3, -3, 1),
        {"red": (3, 2, 2, 1), "green": (-2, 1, 0.5, 2), "blue": (3, -1, 1, 3)},
    )
    start, gates = layout(load_scenario("test-case-3"))
    assert start[:2] == (-3, -3)
    assert {colour: place[:2] for colour, place in gates.items()} == {
        "red": (-1, 3),
        "green": (-3, 0),
        "blue": (3, -2),
    }
    assert load_scenario("empty").frames == ()


coordinate = st.floats(-5, 5)


@st.composite
def scenarios(draw):
    colours = draw(st.lists(st.sampled_from(COLOURS), unique=True))
    gates = tuple(
        Gate(
            colour=colour,
            x_m=draw(coordinate),
            y_m=draw(coordinate),
            z_m=draw(st.floats(0.11, 4)),
            yaw_rad=draw(st.floats(-6.3, 6.3)),
        )
        for colour in colours
    )
    return Scenario(
        name=draw(st.from_regex(r"\A[a-z0-9][a-z0-9_-]{0,20}\Z")),
        description=draw(st.text(st.characters(exclude_categories=["Cs"]), max_size=60)),
        base=Base(x_m=draw(coordinate), y_m=draw(coordinate)),
        start=StartPose(x_m=draw(coordinate), y_m=draw(coordinate), yaw_rad=draw(st.floats(-6.3, 6.3))),
        frames=gates,
    )


@given(scenarios())
def test_dump_and_parse_round_trip(scenario):
    assert parse_scenario(dump_yaml(scenario)) == scenario
    assert parse_scenario(dump_yaml(scenario).encode()) == scenario


UNUSUAL = [
    chr(code)
    for code in (*range(0x10000), 0x1F600, 0x1FFFF, 0x10FFFF)
    if unicodedata.category(chr(code)) in ("Cc", "Cf", "Zl", "Zp", "Zs") or code % 0x10000 >= 0xFFFE
]


@pytest.mark.parametrize("around", ["{}", "a{}b", "a {} b", "a\n{}b", "- {}: #", 60 * "a " + "{} b"])
def test_characters_that_yaml_folds_or_refuses_survive_a_round_trip(around):
    for character in [*UNUSUAL, *"-?:,[]{}#&*!|>'\"%@`"]:
        scenario = Scenario(name="a", description=around.replace("{}", character))
        assert parse_scenario(dump_yaml(scenario).encode()) == scenario, f"U+{ord(character):04X}"


def test_a_file_loads_by_path(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_bytes(b"\xef\xbb\xbfname: mine\n")  # a byte order mark, as some editors write
    assert load_scenario(str(path)) == load_scenario(path) == Scenario(name="mine")


def test_schema_describes_every_field():
    schema = json_schema()
    assert schema["required"] == ["name"]
    objects = [schema, *(each for each in schema["$defs"].values() if each["type"] == "object")]
    fields = [field for part in objects for field in part["properties"].values()]
    assert len(fields) > 30
    assert all(field.get("description") for field in fields)
    assert all(part["additionalProperties"] is False for part in objects)


GATE = "name: a\nframes:\n  - {colour: red, x_m: 1, y_m: 1, z_m: 1}\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "f.yaml:1: empty; it needs at least `name: my-scenario`"),
        ("- a", 'f.yaml:1: must hold fields like `name: my-scenario`, not ["a"]'),
        ("{}", "f.yaml:1: name is missing; add it"),
        ("name: a\nframs: []", "f.yaml:2: frams is not a known field; did you mean frames?"),
        ("name: a\nbase:\n  top: 1", "f.yaml:3: base.top is not a known field; did you mean top_m?"),
        (GATE + "  - {colr: red}", "f.yaml:4: frames[1].colour is missing; add it (and 4 more)"),
        ("name: A", 'f.yaml:1: name is "A": must be small letters, digits, - and _, a letter or digit first'),
        ("name: 3", "f.yaml:1: name is 3: must be text"),
        ("name: a\ntry_limit_s: yes", 'f.yaml:2: try_limit_s is "yes": must be a number'),
        ("name: a\ntry_limit_s: true", "f.yaml:2: try_limit_s is true: must be a number"),
        ("name: a\ntry_limit_s: '9'", 'f.yaml:2: try_limit_s is "9": must be a number'),
        ("name: a\ntry_limit_s: 0", "f.yaml:2: try_limit_s is 0: must be at least 1.0"),
        ("name: a\ntry_limit_s: .nan", "f.yaml:2: try_limit_s is NaN: must be a finite number"),
        ("name: a\ncamera:\n  far_m: .inf", "f.yaml:3: camera.far_m is Infinity: must be a finite number"),
        ("name: a\ncamera: {width_px: 3.5}", "f.yaml:2: camera.width_px is 3.5: must be a whole number"),
        ("name: a\ncamera: {rate_hz: 999}", "f.yaml:2: camera.rate_hz is 999: must be at most 120.0"),
        ("name: a\ncamera: {rate_hz: 1e-320}", "f.yaml:2: camera.rate_hz is 1e-320: must be at least 0.1"),
        ("name: a\ncamera:\n  far_m: 0.01", "f.yaml:2: camera.near_m 0.01 must be below far_m 0.01"),
        ("name: a\nstart:", "f.yaml:2: start is empty: must hold fields, each written `name: value`"),
        ("name: a\nframes: {red: 1}", 'f.yaml:2: frames is {"red": 1}: must be a list'),
        (
            "name: a\nlight:\n  sun_direction_arena: [1, 2]",
            "f.yaml:3: light.sun_direction_arena[2] is missing; add it",
        ),
        (
            "name: a\nlight: {sun_direction_arena: [1, .nan, 2]}",
            "f.yaml:2: light.sun_direction_arena[1] is NaN: must be a finite number",
        ),
        (
            "name: a\nlight: {sun_direction_arena: [0, 0, 0]}",
            "f.yaml:2: light.sun_direction_arena [0.0, 0.0, 0.0] has no direction; "
            "one number must be 1e-06 or more",
        ),
        (
            GATE.replace("red", "pink"),
            "f.yaml:3: frames[0].colour is \"pink\": must be 'red', 'green' or 'blue'",
        ),
        (
            GATE + "  - {colour: red, x_m: 2, y_m: 2, z_m: 2}",
            "f.yaml:4: frames[1].colour red is used twice; give each frame its own colour",
        ),
        (
            GATE.replace("z_m: 1", "z_m: 0.1"),
            "f.yaml:3: frames[0].z_m 0.1 sinks the frame into the floor; use 0.11 or more",
        ),
        (
            GATE.replace("z_m: 1", "z_m: 1, bar_m: 0.2"),
            "f.yaml:3: frames[0].bar_m 0.2 leaves no opening; make it thinner or the frame larger",
        ),
        (
            GATE.replace("x_m: 1", "x_m: 7"),
            "f.yaml:3: frames[0].x_m 7.0 is outside the arena; keep within ±5.0 or enlarge the arena",
        ),
        (
            GATE.replace("z_m: 1", "z_m: 5"),
            "f.yaml:3: frames[0].z_m 5.0 is above the arena; use 4.0 or less",
        ),
        ("name: a\nname: b", "f.yaml:2:1: name is given twice, first on line 1; keep one"),
        ("name: a: b", "f.yaml:1:8: not valid YAML: mapping values are not allowed here"),
        (b"name: a\n# \xff", "f.yaml:2: not UTF-8 text; save the file as UTF-8"),
        ("#" * (MAX_TEXT_BYTES + 1), "f.yaml: 1000001 bytes is too large for a scenario; 1000000 at most"),
    ],
)
def test_faults_give_one_line(text, message):
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(text, "f.yaml")
    assert str(caught.value) == message


def complaint(content):
    """The error message of a content, or an empty one if it is valid."""
    try:
        parse_scenario(content, "f.yaml")
    except ScenarioError as error:
        return str(error)
    return "f.yaml:"


@given(st.text(max_size=200) | st.binary(max_size=200))
def test_any_text_gives_a_scenario_or_one_line(content):
    message = complaint(content)
    assert message.startswith("f.yaml:")
    assert len(message.splitlines()) == 1


def test_a_long_word_does_not_make_a_long_line():
    word = "x" * 5000
    for text in (f"{word}: 1", f"{word}: 1\n{word}: 2", f"name: {word}", f"a: !{word} b", f"a: &{word} b"):
        assert len(complaint(text)) < 300


json_like = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


@given(st.dictionaries(st.sampled_from(sorted(Scenario.model_fields)), json_like))
def test_wrong_values_in_known_fields_give_one_line_or_load(fields):
    message = complaint(to_yaml(fields))
    assert message.startswith("f.yaml:")
    assert len(message.splitlines()) == 1


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "testcase1",
            'unknown scenario "testcase1"; did you mean test-case-1? Known: empty, first-flight, open-field,',
        ),
        ("zzz", 'unknown scenario "zzz"; Known: empty, first-flight, open-field,'),
        ("", 'unknown scenario ""; Known:'),
        ("a\nb", 'unknown scenario "a\\nb"; Known:'),
        ("nowhere.yaml", "nowhere.yaml: no such file; give a path or one of: empty,"),
        ("bad\0.yaml", "bad?.yaml: cannot be read:"),
    ],
)
def test_unknown_names_are_refused(name, message):
    with pytest.raises(ScenarioError) as caught:
        load_scenario(name)
    assert str(caught.value).startswith(message)
    assert len(str(caught.value).splitlines()) == 1


def test_a_random_scenario_is_loaded_by_its_level_and_seed():
    assert load_scenario("calm-17") == random_scenario(load_level("calm"), 17)
    assert load_scenario("calm-0").name == "calm-0"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("calmm-17", 'unknown scenario "calmm-17"; did you mean calm-17? Known: empty,'),
        ("calm-017", 'unknown scenario "calm-017"; did you mean calm-17? Known: empty,'),
        ("calm-x", 'unknown scenario "calm-x"; Known: empty,'),
        ("calm-1.5", 'unknown scenario "calm-1.5"; Known: empty,'),
        ("calm-²", 'unknown scenario "calm-²"; Known: empty,'),
        ("calm--1", 'unknown scenario "calm--1"; '),
        ("calm", 'unknown scenario "calm"; '),
        (
            "calm-9223372036854775808",
            "seed 9223372036854775808 is out of range; use a whole",
        ),
        ("calm-" + "9" * 5000, "unknown scenario"),
    ],
)
def test_unknown_random_names_are_refused(name, message):
    with pytest.raises(ScenarioError) as caught:
        load_scenario(name)
    assert str(caught.value).startswith(message)
    assert len(str(caught.value)) < 330  # with the names of all scenarios and levels
    assert len(str(caught.value).splitlines()) == 1


def test_directories_pipes_and_large_files_are_refused(tmp_path):
    with pytest.raises(ScenarioError, match="is a directory"):
        load_scenario(tmp_path)
    fifo = tmp_path / "pipe.yaml"
    os.mkfifo(fifo)
    with pytest.raises(ScenarioError, match="not a regular file"):  # and it does not wait for a writer
        load_scenario(fifo)
    large = tmp_path / "large.yaml"
    large.write_bytes(b"#" * (MAX_TEXT_BYTES + 1))
    with pytest.raises(ScenarioError, match="too large"):
        load_scenario(large)
