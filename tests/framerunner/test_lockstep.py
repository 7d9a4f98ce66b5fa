"""Whole flights in lockstep: their verdicts, and that they repeat to the last bit."""

import json
import subprocess
import sys
from dataclasses import replace

import cv2
import pytest

from framerunner.cli import run
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.mission import load_mission
from scenarios.air import Wind
from scenarios.loader import load_scenario
from tests.framerunner import reference_flights

HASH = """
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.mission import load_mission
from scenarios.loader import load_scenario
from tests.framerunner.test_lockstep import short

plan = FlightPlan(short("test-case-1"), load_mission("frame_challenge"))
print(fly_lockstep(plan).result.state_sha256)
"""


def short(name, limit_s=18.0):
    return load_scenario(name).model_copy(update={"try_limit_s": limit_s})


def fly(scenario, **options):
    return fly_lockstep(FlightPlan(scenario, load_mission("frame_challenge")), **options)


@pytest.mark.parametrize("name", reference_flights.SCENARIOS)
def test_a_flight_ends_as_it_should_and_is_the_stored_one(name):
    """`make reference-flights` stores them again after a change that is meant to change flights."""
    flown, ticks = reference_flights.fly(name)
    if name == "round-1":
        _turns_for_green_until_time_is_up(flown.result)
    else:
        _is_completed(flown)
    if name == "test-case-1":
        # As a faithful reproduction; the mission's own gains set the pace, not the stabiliser.
        assert flown.result.try_time_s == pytest.approx(92.0, rel=0.15)
    difference = reference_flights.first_difference(reference_flights.load(name), ticks)
    if difference:
        pytest.fail(difference, pytrace=False)


def _is_completed(flown):
    result = flown.result
    assert result.verdict in ("clean", "completed"), result.reason
    assert result.frames_crossed == ("red", "green", "blue")
    assert result.landing_error_m < 0.1
    assert result.mission_state == flown.track.mission_state[-1] == "landing.stop"
    assert flown.outcome.ended == "finished"


def _turns_for_green_until_time_is_up(result):
    assert (result.verdict, result.mission_state) == ("timed out", "green.turning")
    assert result.frames_crossed == ("red",)
    assert "not finished within" in result.reason or result.try_time_s == 180.0


def test_a_difference_from_a_stored_flight_is_located():
    stored = reference_flights.load("test-case-1")
    number = next(i for i, tick in enumerate(stored) if tick.mission_state == "green.frame_visible") + 10
    tick = stored[number]

    def difference(**changes):
        changed = [*stored[:number], replace(tick, **changes), *stored[number + 1 :]]
        return reference_flights.first_difference(stored, changed)

    where = f"tick {number}, vehicle time {tick.time_us / 1e6:.2f} s, green.frame_visible: "
    assert difference(x_mm=tick.x_mm + 19, yaw_mrad=tick.yaw_mrad + 19) is None
    assert difference(y_mm=tick.y_mm - 21).startswith(f"{where}0.021 m apart")
    assert difference(yaw_mrad=tick.yaw_mrad + 21).startswith(f"{where}yaw is ")
    assert difference(mission_state="green.turning") == f"{where}state is green.turning"
    assert difference(time_us=tick.time_us + 1).startswith(f"{where}time is ")
    assert reference_flights.first_difference(stored, stored[:-2]) is None
    shorter = reference_flights.first_difference(stored, stored[:-3])
    assert shorter == f"{len(stored) - 3} ticks, stored {len(stored)}"


def test_a_flight_repeats_to_the_last_bit_here_and_elsewhere():
    first = fly(short("test-case-1"))
    other = fly(short("test-case-2"))
    again = fly(short("test-case-1"))
    command = [sys.executable, "-c", HASH]
    elsewhere = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    assert len(first.result.state_sha256) == 64
    assert first.result == again.result
    assert first.track == again.track
    assert elsewhere == first.result.state_sha256
    assert other.result.state_sha256 != first.result.state_sha256


def test_observers_change_nothing():
    moments, images = [], []
    watched = fly(
        short("test-case-1", 6.0),
        observers=(moments.append,),
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


def test_a_video_is_written_on_request(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.yaml").write_text("name: short\ntry_limit_s: 2\n", encoding="utf-8")
    run(["fly", "short.yaml", "--lockstep", "--video"])
    (path,) = tmp_path.glob("runs/*/video.avi")
    video = cv2.VideoCapture(str(path))
    count = 0
    while video.read()[0]:
        count += 1
    assert 20 <= count <= 80  # 10 a second, from before take-off


def test_the_command_writes_what_a_flight_in_real_time_writes(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.yaml").write_text(
        "name: short\nbase: {x_m: 0, y_m: 0}\nstart: {x_m: 0, y_m: 0}\nframes: []\ntry_limit_s: 2\n",
        encoding="utf-8",
    )
    code = run(["fly", "short.yaml", "--lockstep"])  # a video and a recording only if asked for
    said = capsys.readouterr()
    assert code == 1, said.err
    (folder,) = (tmp_path / "runs").iterdir()
    assert {path.name for path in folder.iterdir()} == {
        "mission.yaml",
        "result.json",
        "scenario.yaml",
        "track.png",
    }
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert said.out.startswith("timed out after 2.0 s")
    assert said.out.splitlines()[-1] == f"see it again: framerunner replay runs/{folder.name}"
    assert (result["verdict"], result["seed"], result["judged_by"]) == ("timed out", 0, "truth")
    assert len(result["state_sha256"]) == 64
    assert result["wall_time_s"] > 0.0


@pytest.mark.parametrize(
    "options", [["--speed", "2"], ["--instance", "1"], ["--drone", "udpin://0.0.0.0:1", "--camera", "0"]]
)
def test_lockstep_refuses_options_of_real_time(options, capsys):
    assert run(["fly", "empty", "--lockstep", *options]) == 2
    assert "--lockstep" in capsys.readouterr().err


def test_a_windy_flight_repeats_with_its_seed_and_not_with_another():
    wind = Wind(speed_m_s=0.5, turbulence_m_s=0.2, gust_m_s=0.5, gust_period_s=3.0)
    scenario = short("test-case-1", 5.0).model_copy(update={"wind": wind})
    mission = load_mission("frame_challenge")
    hashes = [fly_lockstep(FlightPlan(scenario, mission, seed)).result.state_sha256 for seed in (3, 3, 4)]
    assert hashes[0] == hashes[1] != hashes[2]
