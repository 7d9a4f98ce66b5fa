"""A whole flight as a user starts it, over UDP and MAVSDK: it is that of lockstep, and leaves its files."""

import json
import subprocess
import sys
import threading
from contextlib import contextmanager, suppress
from urllib.request import urlopen

import cv2
import numpy as np
import pytest
from pymavlink import mavutil

from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from framerunner.recording.events import RecordedImage
from framerunner.recording.mcap_writer import FlightRecording
from framerunner.recording.open_recording import recorded_flight
from offboard.app import Moment
from offboard.mission import load_mission
from scenarios.loader import load_scenario
from tests.processes import free_instance, ports_are_free, program, simulator

pytestmark = pytest.mark.realtime

FIELDS = {
    *("scenario", "mission", "seed", "verdict", "reason", "frames_crossed", "crossing_times_s"),
    *("crossing_offsets_m", "contacts", "outside_s", "try_time_s", "penalty_s", "total_time_s"),
    *("landed_on_base", "landing_error_m", "path_length_m", "wall_time_s", "real_time_factor"),
}


def messages(path):
    """How many messages of each type a tlog holds."""
    log = mavutil.mavlink_connection(str(path))
    counts = {}
    while (message := log.recv_match()) is not None:
        counts[message.get_type()] = counts.get(message.get_type(), 0) + 1
    return counts


def images(path):
    """How many images of the camera's size a video holds."""
    video = cv2.VideoCapture(str(path))
    count = 0
    while (image := video.read()[1]) is not None:
        assert image.shape == (240, 320, 3)
        count += 1
    return count


@contextmanager
def disturbed(instance, busy, viewers):
    """Processes that take all the processor they get, and viewers of the video."""
    ended = threading.Event()

    def view():
        while not ended.is_set():
            with suppress(OSError), urlopen(f"http://127.0.0.1:{8100 + instance}/video", timeout=5) as video:
                while not ended.is_set() and video.read(4096):
                    pass
            ended.wait(0.2)

    spinning = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(busy)]
    watching = [threading.Thread(target=view) for _ in range(viewers)]
    for viewer in watching:
        viewer.start()
    try:
        yield
    finally:
        ended.set()
        for process in spinning:
            process.kill()
            process.wait()
        for viewer in watching:
            viewer.join()


@pytest.fixture(scope="module")
def busy_flight(tmp_path_factory):
    """Test case 1, three times as fast as real, on a busy machine with viewers: folder and words."""
    folder, instance = tmp_path_factory.mktemp("flight"), free_instance()
    options = ("--instance", str(instance), "--speed", "3", "--record")
    with disturbed(instance, busy=3, viewers=5), program(folder, "fly", "test-case-1", *options) as flight:
        code = flight.process.wait(300.0)
        assert code == 0, flight.err + flight.out
    assert ports_are_free(instance)
    (run,) = (folder / "runs").iterdir()
    return run, flight.out


@pytest.fixture(scope="module")
def lockstep_flight(tmp_path_factory):
    """The same in lockstep: result, and its recording."""
    path = tmp_path_factory.mktemp("lockstep") / "flight.mcap"
    plan = FlightPlan(load_scenario("test-case-1"), load_mission("explorer"))
    with FlightRecording(path, plan.scenario, plan.chart, None) as recording:
        flown = fly_lockstep(plan, observers=(recording.see,), on_image=recording.see_image)
        recording.finish(flown.result, flown.track)
    return flown.result, path


@pytest.mark.alone
def test_every_tick_and_image_is_that_of_lockstep_to_the_last_bit(busy_flight, lockstep_flight):
    folder, out = busy_flight
    (ticks, images_by_time), (wanted_ticks, wanted_images) = map(events, (folder, lockstep_flight[1]))
    assert len(ticks) == len(wanted_ticks) > 600
    for tick, wanted in zip(ticks, wanted_ticks, strict=True):
        assert tick == wanted, f"at {wanted.state.time_us} us"
    until_us = ticks[-1].state.time_us - 100_000
    used = {time_us: image for time_us, image in wanted_images.items() if time_us < until_us}
    assert len(used) > 300
    for time_us, wanted in used.items():
        assert np.array_equal(images_by_time[time_us], wanted), f"at {time_us} us"
    timing = json.loads((folder / "result.json").read_text(encoding="utf-8"))["timing"]
    assert (timing["late_ticks"], timing["late_images"], timing["late_setpoints"]) == (0, 0, 0)
    assert timing["kept_up"] == ("did not keep up" not in out)
    assert timing["kept_up"] or "the flight is the same as on a free machine" in out


def events(recording):
    """The ticks of a recording, and its images by their times."""
    with recorded_flight(recording) as recorded:
        found = list(recorded.events())
    ticks = [event for event in found if isinstance(event, Moment)]
    return ticks, {event.time_us: event.image for event in found if isinstance(event, RecordedImage)}


@pytest.mark.alone
def test_a_drone_that_estimates_its_place_flies_as_in_lockstep_too(tmp_path):
    instance = free_instance()
    options = ("--instance", str(instance), "--speed", "3", "--record", "--sensors", "flow")
    with disturbed(instance, busy=3, viewers=0), program(tmp_path, "fly", "test-case-1", *options) as flight:
        assert flight.process.wait(300.0) == 0, flight.err + flight.out
    (run,) = (tmp_path / "runs").iterdir()
    scenario = load_scenario("test-case-1").model_copy(update={"sensors": "flow"})
    plan = FlightPlan(scenario, load_mission("explorer"))
    path = tmp_path / "lockstep.mcap"
    with FlightRecording(path, plan.scenario, plan.chart, None) as recording:
        flown = fly_lockstep(plan, observers=(recording.see,))
        recording.finish(flown.result, flown.track)
    ticks, wanted_ticks = (events(each)[0] for each in (run, path))
    assert len(ticks) == len(wanted_ticks) > 400
    for tick, wanted in zip(ticks, wanted_ticks, strict=True):
        assert tick == wanted, f"at {wanted.state.time_us} us"


@pytest.mark.alone
def test_it_leaves_result_track_log_and_video(busy_flight, lockstep_flight):
    folder, lockstep = busy_flight[0], lockstep_flight[0]
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert FIELDS - result.keys() == set()
    assert result["verdict"] in ("clean", "completed")
    assert result["frames_crossed"] == ["red", "green", "blue"]
    assert result["landed_on_base"] is True
    assert result["landing_error_m"] < 0.25
    assert result["judged_by"] == "truth"
    ticked_s = result["wall_time_s"] * result["real_time_factor"]  # some before and after the try
    assert result["try_time_s"] < ticked_s < result["try_time_s"] + 6.0

    track = folder / "track.png"
    assert track.stat().st_size > 10_000
    assert cv2.imread(str(track)) is not None
    counts = messages(folder / "flight.tlog")
    assert counts["HEARTBEAT"] > result["try_time_s"]
    assert counts["ATTITUDE"] > 20 * result["try_time_s"]
    assert counts["SET_POSITION_TARGET_LOCAL_NED"] > 15 * result["try_time_s"]
    assert images(folder / "video.avi") > 8 * result["try_time_s"]

    assert (result["verdict"], result["try_time_s"], tuple(result["crossing_sides"])) == (
        lockstep.verdict,
        lockstep.try_time_s,
        lockstep.crossing_sides,
    )


@pytest.mark.alone
def test_the_explorer_is_quick_enough_for_a_drone_whose_time_does_not_wait(tmp_path, instance):
    """Late ticks and images cost precision, not the flight."""
    (tmp_path / "app").mkdir()
    drone = ("--drone", f"udpin://127.0.0.1:{14540 + instance}")
    camera = ("--camera", f"http://127.0.0.1:{8100 + instance}/video")
    arguments = ("fly", "test-case-1", "--mission", "explorer", *drone, *camera)
    with (
        simulator(tmp_path, instance, "--scenario", "test-case-1"),
        disturbed(instance, busy=4, viewers=0),
        program(tmp_path / "app", *arguments) as flight,
    ):
        assert flight.process.wait(240.0) == 0, flight.err + flight.out
    (run,) = (tmp_path / "app" / "runs").iterdir()
    result = json.loads((run / "result.json").read_text(encoding="utf-8"))
    assert result["verdict"] in ("clean", "completed"), result["reason"]
    assert result["try_time_s"] < 45.0
    assert result["timing"]["vehicle_time_waits"] is False


def test_a_drone_that_is_somebody_elses_is_not_commanded(tmp_path, instance):
    with simulator(tmp_path, instance, "--scenario", "test-case-1"):
        (tmp_path / "mine").mkdir()
        with program(tmp_path / "mine", "fly", "test-case-1", "--instance", str(instance)) as flight:
            assert flight.process.wait(60.0) == 2
            assert "--instance" in flight.err.splitlines()[-1]
        with urlopen(f"http://127.0.0.1:{8100 + instance}/referee.json", timeout=5) as answer:
            assert json.load(answer)["snapshot"]["began_us"] is None
