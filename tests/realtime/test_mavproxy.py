"""The real MAVProxy on the ground link: parameters, plans, modes and a flight, typed at its console."""

import os
import re
import subprocess
from pathlib import Path

import pytest

from tests.processes import ROOT, wait_until

pytestmark = pytest.mark.realtime

SIM_OPTIONS = ("--speed", "4")  # MAVProxy does not mind when time runs faster


def mavproxy_path():
    path = Path(os.environ.get("FRAMERUNNER_MAVPROXY", ROOT / ".venv-mavproxy" / "bin" / "mavproxy.py"))
    if not path.exists():
        pytest.fail(
            f"MAVProxy is not at {path}; run `make setup`, or set FRAMERUNNER_MAVPROXY to mavproxy.py"
        )
    return path


class MavProxy:
    """MAVProxy with its console on pipes."""

    def __init__(self, folder, port):
        self._log = folder / "mavproxy.txt"
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [
                    mavproxy_path(),
                    f"--master=udpin:127.0.0.1:{port}",
                    f"--state-basedir={folder}",
                    "--default-modules=cmdlong,param,ftp,mode,arm,misc,wp,fence,rally",
                ],
                cwd=folder,
                env={**os.environ, "HOME": str(folder), "PYTHONUNBUFFERED": "1"},
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=subprocess.STDOUT,
            )
        self._read = 0

    @property
    def _said(self):
        return self._log.read_text(encoding="utf-8", errors="replace")

    def type(self, line):
        """Type a line."""
        self._process.stdin.write(f"{line}\n".encode())
        self._process.stdin.flush()

    def expect(self, pattern, limit_s=15.0):
        """Wait until it has said something, after what was expected before; the match."""
        found = None

        def seen():
            nonlocal found
            found = re.search(pattern, self._said[self._read :])
            return found

        assert wait_until(seen, limit_s), f"not said: {pattern}\n{self._said[self._read :]}"
        self._read += found.end()
        return found

    def expect_all(self, *patterns, limit_s=15.0):
        """Wait until it has said some things, in any order, after what was expected before."""
        begin, end = self._read, self._read
        for pattern in patterns:
            self._read = begin
            self.expect(pattern, limit_s)
            end = max(end, self._read)
        self._read = end

    def ask(self, line, pattern, limit_s=15.0):
        """Type a line again and again until the answer is as wanted; the match."""
        for _ in range(int(limit_s / 0.5)):
            self.type(line)
            if wait_until(lambda: re.search(pattern, self._said[self._read :]), 0.5):
                break
        return self.expect(pattern, 1.0)

    def close(self):
        self._process.stdin.close()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the console finds files."""
    return tmp_path_factory.mktemp("mavproxy")


@pytest.fixture(scope="module")
def mavproxy(folder, sim, instance):
    console = MavProxy(folder, 14550 + instance)
    console.expect(rf"Detected vehicle {instance + 1}:1", 20.0)
    console.expect(r"Mode LOITER")
    yield console
    console.close()


def plan_file(path, *items):
    """A file of items (command, gate, params 1 to 4, latitude, longitude, altitude); its name."""
    lines = ["QGC WPL 110"]
    for number, (command, frame, params, *place) in enumerate(items):
        fields = (number, int(number == 0), frame, command, *params, *place, 1)
        lines.append("\t".join(str(field) for field in fields))
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path.name


def test_parameters_are_received_shown_and_set(mavproxy):
    received = mavproxy.expect(r"Received (\d+) parameters", 15.0)  # there is no file of them: it falls back
    assert int(received[1]) > 100
    mavproxy.type("param show MIS_TAKEOFF_ALT")
    assert float(mavproxy.expect(r"MIS_TAKEOFF_ALT +([0-9.]+)")[1]) == 2.5
    mavproxy.type("param set MIS_TAKEOFF_ALT 4.5")
    mavproxy.type("param set COM_OBL_RC_ACT 5")  # a whole number, which PX4 sends bytewise
    mavproxy.ask("param fetch MIS_TAKEOFF_ALT", r"MIS_TAKEOFF_ALT = 4\.5")
    mavproxy.ask("param fetch COM_OBL_RC_ACT", r"COM_OBL_RC_ACT = 5\b")


def test_mission_fence_and_rally_points_are_loaded_and_listed(mavproxy, folder):
    places = [
        (47.3977 + north / 1e4, 8.5455 + east / 1e4) for north, east in ((4, -4), (4, 4), (-4, 4), (-4, -4))
    ]
    mission = [(16, 3, (0, 0, 0, 0), *place, 20.0) for place in places]
    fence = [(5001, 3, (4, 0, 0, 0), *place, 0.0) for place in places]
    rally = [(5100, 3, (0, 0, 0, 0), *place, 20.0) for place in places[:2]]
    for module, items in (("wp", mission), ("fence", fence), ("rally", rally)):
        name = plan_file(folder / f"{module}.txt", *items)
        mavproxy.type(f"{module} load {name}")
        mavproxy.expect(rf"Loaded {len(items)} .+ in [0-9.]+s")  # the vehicle has said that it has them all
        mavproxy.type(f"{module} list")
        mavproxy.expect(rf"Requesting {len(items)} ")
        mavproxy.expect(rf"Saved {len(items)} ")
        mavproxy.type(f"{module} clear")
        mavproxy.ask(f"{module} list", r"Requesting 0 ")


def test_a_flight_with_modes_take_off_a_place_to_go_to_and_return(mavproxy):
    for mode, main, sub in (("POSCTL", 3, 0), ("MISSION", 4, 4), ("LOITER", 4, 3)):
        mavproxy.type(f"long DO_SET_MODE 1 {main} {sub}")
        mavproxy.expect_all(r"DO_SET_MODE: ACCEPTED", rf"{mode}> |Mode {mode}")
    mavproxy.ask("status GLOBAL_POSITION_INT", r"lat : 473977\d{3}, lon : 85455\d{3}")
    mavproxy.type("long DO_SET_MODE 1 99")
    mavproxy.expect(r"DO_SET_MODE: TEMPORARILY_REJECTED")

    mavproxy.type("arm throttle")
    mavproxy.expect_all(r"COMPONENT_ARM_DISARM: ACCEPTED", r"\bARMED")
    mavproxy.type("takeoff 494")  # PX4 counts from the sea, not from home
    mavproxy.expect_all(r"NAV_TAKEOFF: ACCEPTED", r"TAKEOFF> |Mode TAKEOFF")
    mavproxy.expect(r"LOITER> |Mode LOITER", 20.0)
    mavproxy.ask("status GLOBAL_POSITION_INT", r"relative_alt : (4[5-9]|5[0-5])\d\d\b")
    mavproxy.type("disarm")
    mavproxy.expect(r"COMPONENT_ARM_DISARM: TEMPORARILY_REJECTED")

    mavproxy.type("guided 47.3978 8.5456 8")
    mavproxy.expect(r"DO_REPOSITION: ACCEPTED")
    there = r"lat : 47397(79[5-9]|80[0-5])\d, lon : 8545(59[5-9]|60[0-5])\d"
    arrived = there + r", alt : \d+, relative_alt : (7[5-9]|8[0-4])\d\d\b"
    mavproxy.ask("status GLOBAL_POSITION_INT", arrived, 20.0)

    mavproxy.type("param set RTL_RETURN_ALT 8")
    mavproxy.type("long NAV_RETURN_TO_LAUNCH")
    mavproxy.expect_all(r"NAV_RETURN_TO_LAUNCH: ACCEPTED", r"RTL> |Mode RTL")
    mavproxy.expect(r"DISARMED", 30.0)

    mavproxy.type("arm throttle")
    mavproxy.expect(r"COMPONENT_ARM_DISARM: ACCEPTED")
    mavproxy.type("disarm")
    mavproxy.expect(r"COMPONENT_ARM_DISARM: ACCEPTED")
