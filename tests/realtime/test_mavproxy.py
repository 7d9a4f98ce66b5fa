"""The real MAVProxy on the ground link: finds the drone, reads its parameters, arms, takes off, lands."""

import os
import re
import subprocess
from pathlib import Path

import pytest

from tests.processes import ROOT, wait_until

pytestmark = pytest.mark.realtime


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
                    "--default-modules=cmdlong,param,mode,arm,misc",
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


@pytest.fixture
def mavproxy(tmp_path, sim, instance):
    console = MavProxy(tmp_path, 14550 + instance)
    yield console
    console.close()


def test_mavproxy_connects_reads_arms_takes_off_and_lands(mavproxy, instance):
    mavproxy.expect(rf"Detected vehicle {instance + 1}:1", 20.0)
    mavproxy.expect(r"Mode LOITER")
    received = mavproxy.expect(r"Received (\d+) parameters", 30.0)
    assert int(received[1]) > 10
    mavproxy.type("param show MIS_TAKEOFF_ALT")
    assert float(mavproxy.expect(r"MIS_TAKEOFF_ALT +([0-9.]+)")[1]) == pytest.approx(2.5)
    mavproxy.ask("status GLOBAL_POSITION_INT", r"lat : 473977\d{3}, lon : 85455\d{3}")

    mavproxy.type("arm throttle")
    mavproxy.expect(r"COMPONENT_ARM_DISARM: ACCEPTED")
    mavproxy.expect(r"ARMED")
    mavproxy.type("long NAV_TAKEOFF 0 0 0 nan nan nan 491.5")  # PX4 counts from the sea, not from home
    mavproxy.expect(r"NAV_TAKEOFF: ACCEPTED")
    mavproxy.expect(r"Mode TAKEOFF")
    mavproxy.ask("status EXTENDED_SYS_STATE", r"landed_state : 2", 10.0)  # in the air
    mavproxy.ask("status GLOBAL_POSITION_INT", r"relative_alt : (1[5-9]\d\d|2\d\d\d)", 20.0)

    mavproxy.type("long NAV_LAND")
    mavproxy.expect(r"NAV_LAND: ACCEPTED")
    mavproxy.expect(r"Mode LAND")
    mavproxy.expect(r"DISARMED", 30.0)
