"""`framerunner fly --settings`: options in a file, and the rules that say which options go together."""

from pathlib import Path

import pytest

from framerunner.cli import build_app, run
from framerunner.commands import fly as fly_command


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def options(*words):
    """The options of `framerunner fly` as its function gets them, by name."""
    _, bound, _ = build_app().parse_args(["fly", *words], print_error=False, exit_on_error=False)
    given = dict(bound.arguments)
    groups = [
        given.pop(name) for name in ("flown", "simulated", "genuine", "output", "hardware") if name in given
    ]
    for group in groups:
        given |= {name: getattr(group, name) for name in group.__dataclass_fields__}
    return given


def write(text):
    Path("flight.yaml").write_text(text, encoding="utf-8")


def test_a_file_gives_options_and_the_command_line_goes_before_it():
    write(
        "scenario: hall.yaml\nmission: hover\ncamera: 0\nlockstep: true\nmax-speed: 1\nseed: 7\n"
        "accept: [battery, gps]\non-abort: hold\nfault:\n  - gps off at 3 s\n"
    )
    found = options("--settings", "flight.yaml", "--seed", "8", "--lockstep=false", "--mission", "explorer")
    assert (found["scenario"], found["mission"], found["camera"]) == ("hall.yaml", "explorer", "0")
    assert (found["lockstep"], found["max_speed"], found["seed"]) == (False, 1.0, 8)
    assert (found["accept"], found["on_abort"]) == (("battery", "gps"), "hold")
    assert found["fault"] == ("gps off at 3 s",)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("max-sped: 1", "flight.yaml:1: max-sped is not a known field; did you mean max-speed?"),
        ("record: true\nspeed: fast", 'flight.yaml:2: speed is "fast": must be a number'),
        ("instance: 1.5", "flight.yaml:1: instance is 1.5: must be a whole number"),
        ("lockstep: yes", 'flight.yaml:1: lockstep is "yes": must be true or false'),
        ("on-abort: fly", "flight.yaml:1: on-abort is \"fly\": must be 'hold' or 'land'"),
        ("accept: gps", 'flight.yaml:1: accept is "gps": must be a list'),
        ("drone:", "flight.yaml:1: drone is empty: must be text"),
        ("settings: other.yaml", "flight.yaml:1: settings is not a known field"),
        ("lifeline: true", "flight.yaml:1: lifeline is not a known field"),
        ("speed: 1\nspeed: 2", "flight.yaml:2:1: speed is given twice"),
        ("a: &b 1", "anchor &b is not allowed"),
        ("", "flight.yaml:1: empty; it needs at least `max-speed: 0.5`"),
        ("speed: 500", "--speed 500: must be from 0.01 to 100"),
        (
            "lockstep: true\nmonitor: true",
            "--monitor: shows flights in real time; leave it out with --lockstep",
        ),
    ],
)
def test_a_bad_file_is_refused_with_field_value_and_what_to_do(text, said, capsys):
    write(text)
    assert run(["fly", "--settings", "flight.yaml"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line


def test_a_file_that_is_not_there_is_refused(capsys):
    assert run(["fly", "--settings", "no.yaml"]) == 2
    assert capsys.readouterr().err == "error: no.yaml: no such file; give a path\n"


def test_every_rule_names_options_that_there_are():
    known = {
        argument.name.removeprefix("--") for argument in build_app()["fly"].assemble_argument_collection()
    }
    known |= {"service", "on-abort hold"}
    for rule in fly_command._RULES:
        assert {rule.option, *rule.excludes, *rule.needs} <= known, rule


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["--simulator", "http://127.0.0.1:8100"], "name it with --drone"),
        (["--px4", "a", "--ardupilot", "b"], "PX4 flies, by --px4"),
        (["--px4", "a", "--drone", "udpin://:1", "--camera", "0"], "flies a simulator that is started"),
        (["--drone", "udpin://:1"], "--drone udpin://:1: needs the URL of its camera too; add --camera"),
        (["--camera", "0"], "--camera 0: needs the URL of its drone too; add --drone"),
        (["--drone", "udpin://:1", "--camera", "0", "--speed", "2"], "--speed 2: is for the simulated drone"),
        (["--seed", "1"], "add one of them or leave it out"),
        (["--lockstep", "--instance", "0", "--speed", "2"], "in this process; leave out --speed"),
        (["--response", "lag=0.5"], "add --lockstep"),
        (["--dry-run"], "--dry-run: is for a drone given by --drone"),
        (["--drone", "u", "--camera", "0", "--simulated", "--yes"], "--yes: a drone that is --simulated"),
        (["--drone", "u", "--camera", "0", "--hold-time", "9"], "--hold-time 9: is for --on-abort hold"),
        (
            ["--drone", "u", "--camera", "0", "--sensors", "mocap"],
            "--sensors mocap: is for a simulated drone",
        ),
    ],
)
def test_options_that_do_not_go_together_are_refused(given, said, capsys):
    assert run(["fly", *given]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line
