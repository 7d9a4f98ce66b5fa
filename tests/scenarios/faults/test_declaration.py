"""Faults in scenario files and in one line: what is understood, and one clear line for what is not."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.faults.declaration import SIZES, Fault, FaultError, parse_fault
from scenarios.loader import dump_yaml, load_scenario, parse_scenario
from scenarios.models import ScenarioError


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("gps off at 12 s", Fault(part="gps", kind="off", at_s=12)),
        ("gps off at 12", Fault(part="gps", kind="off", at_s=12)),
        ("gps off at 12s for 0.5s", Fault(part="gps", kind="off", at_s=12, for_s=0.5)),
        ("motor 2 weak 30% at 3 s", Fault(part="motor", kind="weak", number=2, size=0.3, at_s=3)),
        ("motor weak 0.3 at 3 s", Fault(part="motor", kind="weak", size=0.3, at_s=3)),
        ("range finder wrong -0.4 m at 2 s", Fault(part="range_finder", kind="wrong", size=-0.4, at_s=2)),
        ("range-finder stuck at 2 s", Fault(part="range_finder", kind="stuck", at_s=2)),
        ("accelerometer noisy 3 m/s² at 1 s", Fault(part="accelerometer", kind="noisy", size=3, at_s=1)),
        (" camera  black at 0 s ", Fault(part="camera", kind="black")),
    ],
)
def test_one_line(text, fault):
    assert parse_fault(text) == fault


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("gps off", "write PART [NUMBER] KIND [SIZE] at SECONDS"),
        ("", "write PART"),
        ("gps off at soon", "write PART"),
        ("gps weak at 3 s", "is no fault of a gps; use one of off, stuck"),
        ("radar off at 3 s", "no part 'radar'; use one of gyroscope"),
        ("motor off 3 at 2 s", "motor off has none; remove it"),
        ("link lossy 1.5 at 2 s", "is out of range; use 0.01 to 1"),
        ("gps wrong 3 V at 1 s", "the size of gps wrong is in m"),
        ("gps 2 off at 1 s", "numbers a motor; a gps has none"),
        ("motor 0 off at 1 s", "number"),
        ("gps off at 1 s for 0 s", "for_s"),
    ],
)
def test_a_bad_line_is_refused_in_one_line(text, words):
    with pytest.raises(FaultError) as caught:
        parse_fault(text)
    assert words in str(caught.value)
    assert repr(text) in str(caught.value)
    assert "\n" not in str(caught.value)


@given(st.text())
def test_any_text_is_a_fault_or_one_line(text):
    complaint = ""
    try:
        parse_fault(text)
    except FaultError as error:
        complaint = str(error)
    assert "\n" not in complaint


@pytest.mark.parametrize("part", SIZES, ids=str)
def test_a_fault_in_one_line_is_read_back(part):
    for kind, meant in SIZES[part].items():
        fault = Fault(
            part=part, kind=kind, at_s=3.5, for_s=2.0, size=None if meant is None else meant.default
        )
        assert parse_fault(str(fault)) == fault


def test_a_scenario_file_has_faults():
    scenario = parse_scenario(
        "name: failing\nfaults:\n  - {part: gps, kind: off, at_s: 12, for_s: 5}\n"
        "  - {part: motor, number: 2, kind: weak, size: 0.3, at_s: 30}\n"
    )
    assert [str(fault) for fault in scenario.faults] == [
        "gps off at 12 s for 5 s",
        "motor 2 weak 0.3 at 30 s",
    ]
    assert parse_scenario(dump_yaml(scenario)) == scenario


def test_a_scenario_without_faults_is_written_as_before():
    assert "faults" not in dump_yaml(load_scenario("test-case-1"))


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("{part: gps, kind: weak}", "faults[0].kind weak is no fault of a gps"),
        ("{part: radar, kind: off}", "faults[0].part radar is not known; use one of"),
        ("{part: gps, kind: broken}", "faults[0].kind broken is not known; use one of"),
        ("{part: gps, kind: off, at_s: -1}", "faults[0].at_s"),
        ("{part: battery, kind: sag, size: 2}", "faults[0].size 2.0 is out of range"),
        ("{kind: off}", "faults[0].part"),
    ],
)
def test_a_bad_fault_in_a_file_names_line_and_field(fault, words):
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(f"name: failing\nfaults:\n  - {fault}\n", "mine.yaml")
    assert words in str(caught.value)
    assert "mine.yaml:3" in str(caught.value)
