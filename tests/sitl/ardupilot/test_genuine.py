"""The whole challenge on a genuine ArduCopter: `make test-ardupilot ARDUPILOT_DIR=…`.

Without ARDUPILOT_DIR these tests are skipped; ARDUPILOT_FLIGHTS is the number of flights, 1 if not given.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from tests.processes import free_instance

BUILD = os.environ.get("ARDUPILOT_DIR")
FLIGHTS = int(os.environ.get("ARDUPILOT_FLIGHTS", "1"))
SPEED = "3"

pytestmark = pytest.mark.skipif(not BUILD, reason="ARDUPILOT_DIR names no ArduPilot built for SITL")


def flown(seed, folder):
    """The result of one flight of the default mission; ArduCopter and simulator start anew."""
    flight = ["fly", "test-case-1", "--ardupilot", BUILD, "--seed", str(seed), "--speed", SPEED]
    options = ["--instance", str(free_instance()), "--out", str(folder)]
    subprocess.run([sys.executable, "-m", "framerunner", *flight, *options], timeout=400, check=False)
    (file,) = folder.rglob("result.json")
    return json.loads(file.read_text(encoding="utf-8"))


def test_the_same_seed_is_the_same_flight(tmp_path):
    first, again = (flown(3, tmp_path / name) for name in ("first", "again"))
    assert first["verdict"] == again["verdict"]
    assert first["try_time_s"] == pytest.approx(again["try_time_s"], abs=0.2)


def test_test_case_1_is_completed_in_eight_of_ten_flights(tmp_path):
    verdicts = []
    for seed in range(FLIGHTS):
        verdicts.append(flown(seed, tmp_path / str(seed))["verdict"])
    completed = sum(verdict in ("clean", "completed") for verdict in verdicts)
    assert completed >= 0.8 * FLIGHTS, verdicts
