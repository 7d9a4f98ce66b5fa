"""Whole flights in lockstep: their verdicts, and that they repeat to the last bit."""

import json
import subprocess
import sys

import pytest

from framerunner.cli import run
from framerunner.lockstep import fly_lockstep
from offboard.mission import load_mission
from scenarios.loader import load_scenario

HASH = """
from framerunner.lockstep import fly_lockstep
from offboard.mission import load_mission
from scenarios.loader import load_scenario
from tests.framerunner.test_lockstep import short

print(fly_lockstep(short("test-case-1"), load_mission("frame_challenge")).result["state_sha256"])
"""


def short(name, limit_s=18.0):
    return load_scenario(name).model_copy(update={"try_limit_s": limit_s})


def fly(scenario, **options):
    return fly_lockstep(scenario, load_mission("frame_challenge"), **options)


@pytest.mark.parametrize("name", ["test-case-1", "test-case-2", "test-case-3"])
def test_the_test_cases_are_completed(name):
    flown = fly(load_scenario(name))
    result = flown.result
    assert result["verdict"] in ("clean", "completed"), result["reason"]
    assert result["frames_crossed"] == ("red", "green", "blue")
    assert result["landing_error_m"] < 0.1
    assert result["mission_state"] == flown.track.mission_state[-1] == "landing.stop"
    assert flown.outcome.ended == "finished"


def test_test_case_1_takes_about_as_long_as_the_paper_s_own_stabiliser():
    """92 s in a faithful reproduction; the mission's own gains set the pace, not the stabiliser."""
    assert fly(load_scenario("test-case-1")).result["try_time_s"] == pytest.approx(92.0, rel=0.15)


def test_round_1_turns_for_green_until_time_is_up():
    result = fly(load_scenario("round-1")).result
    assert (result["verdict"], result["mission_state"]) == ("timed out", "green.turning")
    assert result["frames_crossed"] == ("red",)
    assert "not finished within" in result["reason"] or result["try_time_s"] == 180.0


def test_a_flight_repeats_to_the_last_bit_here_and_elsewhere():
    first = fly(short("test-case-1"))
    other = fly(short("test-case-2"))
    again = fly(short("test-case-1"), seed=0)
    command = [sys.executable, "-c", HASH]
    elsewhere = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    assert len(first.result["state_sha256"]) == 64
    assert first.result == again.result
    assert first.track == again.track
    assert elsewhere == first.result["state_sha256"]
    assert other.result["state_sha256"] != first.result["state_sha256"]


def test_looking_on_changes_nothing():
    moments, images = [], []
    watched = fly(
        short("test-case-1", 6.0),
        observer=moments.append,
        on_image=lambda time_us, image: images.append((time_us, image.shape)),
    )
    assert watched.result == fly(short("test-case-1", 6.0)).result
    times_us = [time_us for time_us, _ in images]
    assert times_us == [36_000 + 100_000 * number for number in range(len(times_us))]
    assert {shape for _, shape in images} == {(240, 320, 3)}
    flown = [moment for moment in moments if moment.flight_time_s > 0.0]
    ages_us = {moment.state.time_us - moment.detections.time_us for moment in flown}
    assert ages_us == {64_000, 116_000}  # as over UDP and HTTP
    assert {moment.state.time_us % 50_000 for moment in flown} == {0, 2_000}


def test_the_command_leaves_what_a_flight_in_real_time_leaves(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.yaml").write_text(
        "name: short\nbase: {x_m: 0, y_m: 0}\nstart: {x_m: 0, y_m: 0}\nframes: []\ntry_limit_s: 2\n",
        encoding="utf-8",
    )
    code = run(["fly", "short.yaml", "--lockstep"])
    said = capsys.readouterr()
    assert code == 1, said.err
    (folder,) = (tmp_path / "runs").iterdir()
    assert {path.name for path in folder.iterdir()} == {
        "mission.yaml",
        "result.json",
        "scenario.yaml",
        "track.png",
        "video.avi",
    }
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert said.out.startswith(f"{result['verdict']}: ")
    assert (result["verdict"], result["seed"], result["judged_by"]) == ("timed out", 0, "truth")
    assert len(result["state_sha256"]) == 64
    assert result["wall_time_s"] > 0.0


@pytest.mark.parametrize(
    "options", [["--speed", "2"], ["--instance", "1"], ["--drone", "udpin://0.0.0.0:1", "--camera", "0"]]
)
def test_lockstep_refuses_what_it_has_no_use_for(options, capsys):
    assert run(["fly", "empty", "--lockstep", *options]) == 2
    assert "--lockstep" in capsys.readouterr().err
