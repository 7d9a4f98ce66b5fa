"""The units of systemd/: accepted by systemd, and an app that never flies by itself."""

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from framerunner.cli import build_app
from framerunner.commands.options.hardware import (
    HARDWARE_RULES,
    SERVICE_VARIABLE,
    given_hardware,
    hardware_of,
)
from framerunner.commands.options.rules import check_rules
from framerunner.errors import SettingError
from framerunner.preflight.settings import HardwareSettings

FOLDER = Path(__file__).parents[2] / "systemd"
PROGRAM = "/opt/framerunner/.venv/bin/framerunner"
UNITS = sorted(path.name for path in FOLDER.glob("*.service"))


def settings(name):
    """Section, key and value of each line, continued lines joined."""
    text, section, found = (FOLDER / name).read_text().replace("\\\n", " "), "", []
    for line in text.splitlines():
        if line.startswith("["):
            section = line
            found.append((section, "", ""))
        elif line and not line.startswith("#"):
            key, _, value = line.partition("=")
            found.append((section, key, value))
    return found


def values(name, key):
    return [value for _, found, value in settings(name) if found == key]


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd")
@pytest.mark.parametrize("name", UNITS)
def test_systemd_accepts_the_unit_without_a_word(name, tmp_path):
    for each in UNITS:  # they name each other
        text = (FOLDER / each).read_text().replace(PROGRAM, "/bin/true")
        (tmp_path / each).write_text(text)
    done = subprocess.run(
        ["systemd-analyze", "verify", str(tmp_path / name)], capture_output=True, text=True, check=False
    )
    # Nothing else is looked at: other units of the machine may have warnings.
    assert not [line for line in done.stderr.splitlines() if "framerunner" in line]


def test_nothing_but_a_person_starts_the_app():
    name = "framerunner-fly.service"
    assert "[Install]" not in {section for section, _, _ in settings(name)}  # so it cannot be enabled
    assert values(name, "Restart") == ["no"]
    others = [each for each in UNITS if each != name]
    for each in others:
        assert "framerunner-fly" not in (FOLDER / each).read_text(), each
    # A stop or a restart of the monitor neither stops a flight nor begins it again.
    for key in ("Requires", "BindsTo", "PartOf", "Upholds"):
        assert values(name, key) == [], key
    assert f"{SERVICE_VARIABLE}=1" in " ".join(values(name, "Environment"))
    assert not re.search(r"^[^#]*(--yes|--simulated)", (FOLDER / name).read_text(), re.MULTILINE)


def test_the_app_has_time_to_land_when_it_is_stopped():
    name = "framerunner-fly.service"
    assert values(name, "KillMode") == ["mixed"]  # else the decoder of images would end before the landing
    assert int(values(name, "TimeoutStopSec")[0]) >= 60


@pytest.mark.parametrize("name", UNITS)
def test_units_have_few_rights(name):
    assert values(name, "User") == ["framerunner"]
    for key in ("NoNewPrivileges", "ProtectHome", "PrivateTmp", "RestrictSUIDSGID"):
        assert values(name, key) == ["yes"], key
    assert values(name, "ProtectSystem") == ["strict"]


@pytest.mark.parametrize(
    ("options", "option"),
    [(HardwareSettings(yes=True), "--yes"), (HardwareSettings(simulated=True), "--simulated")],
)
def test_a_service_never_flies_without_an_operator(monkeypatch, options, option):
    monkeypatch.delenv(SERVICE_VARIABLE, raising=False)
    drone = {"drone": "udpin://127.0.0.1:14540"}
    check_rules(HARDWARE_RULES, given_hardware(options) | drone)
    monkeypatch.setenv(SERVICE_VARIABLE, "1")
    with pytest.raises(SettingError, match=f"{option}: a service never flies without"):
        check_rules(HARDWARE_RULES, given_hardware(options) | drone)
    assert hardware_of(HardwareSettings(), "udpin://127.0.0.1:14540").needs_go


@pytest.mark.parametrize("name", [each for each in UNITS if "camera" not in each])
def test_the_program_understands_its_unit(name):
    (command,) = values(name, "ExecStart")
    program, *words = shlex.split(re.sub(r"\$\{?(\w+)\}?", r"\1", command))
    assert program == PROGRAM
    build_app().parse_args(words, print_error=False, exit_on_error=False)
