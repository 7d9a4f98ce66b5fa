"""The whole challenge on a genuine ArduCopter: `make test-ardupilot ARDUPILOT_DIR=…`.

Without ARDUPILOT_DIR these tests are skipped; ARDUPILOT_FLIGHTS is the number of flights, 1 if not given.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from contextlib import contextmanager

import pytest

from tests.processes import free_instance

BUILD = os.environ.get("ARDUPILOT_DIR")
FLIGHTS = int(os.environ.get("ARDUPILOT_FLIGHTS", "1"))
FRAMERUNNER = (sys.executable, "-m", "framerunner")

pytestmark = pytest.mark.skipif(not BUILD, reason="ARDUPILOT_DIR names no ArduPilot built for SITL")


@contextmanager
def simulator(instance, seed, folder):
    """ArduCopter in the simulated world; each starts anew."""
    options = ["--scenario", "test-case-1", "--instance", str(instance), "--seed", str(seed)]
    options += ["--autopilot", "ardupilot", "--ardupilot", BUILD, "--video-rtp", "off"]
    with (folder / "simulator.txt").open("w") as output:
        process = subprocess.Popen(
            [*FRAMERUNNER, "sim", *options, "--storage", str(folder)], stdout=output, stderr=output
        )
        try:
            yield
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(20)


def flown(seed, folder):
    """The result of one flight of the default mission."""
    instance = free_instance()
    with simulator(instance, seed, folder):
        subprocess.run(
            [
                *(*FRAMERUNNER, "fly", "test-case-1", "--out", str(folder / "runs")),
                *("--simulated", "--drone", f"udpin://0.0.0.0:{14540 + instance}"),
                *("--simulator", f"http://127.0.0.1:{8100 + instance}"),
            ],
            timeout=400,
            check=False,
        )
    (file,) = (folder / "runs").rglob("result.json")
    return json.loads(file.read_text(encoding="utf-8"))


def test_test_case_1_is_completed_in_eight_of_ten_flights(tmp_path):
    verdicts = []
    for seed in range(FLIGHTS):
        folder = tmp_path / str(seed)
        folder.mkdir()
        verdicts.append(flown(seed, folder)["verdict"])
    completed = sum(verdict in ("clean", "completed") for verdict in verdicts)
    assert completed >= 0.8 * FLIGHTS, verdicts
