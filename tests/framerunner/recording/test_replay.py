"""`framerunner replay`: what it shows of recordings, lockstep flights and logs, and what it refuses."""

import asyncio
import json
import shutil
import signal
from pathlib import Path

import aiohttp
import numpy as np
import pytest
from mcap.writer import Writer

from framerunner.cli import run
from framerunner.recording import replay as replay_module
from framerunner.recording.events import Crossed, RecordedImage
from framerunner.recording.open_recording import recorded_flight
from framerunner.recording.replay import replay
from framerunner.runs.recorder import VideoFile
from offboard.app import Moment
from offboard.drone import DroneState, VelocityFluCommand
from sitl.video import VideoServer
from tests.framerunner.recording.conftest import SEED
from tests.framerunner.recording.logs import write_log
from tests.processes import program
from vision.types import Detections

SHORT = """name: short
frames: [{colour: red, x_m: 2.0, y_m: 0.0, z_m: 1.0}]
try_limit_s: 4
"""


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """What a short lockstep flight leaves, without a recording."""
    path = tmp_path_factory.mktemp("lockstep")
    (path / "short.yaml").write_text(SHORT, encoding="utf-8")
    out = str(path / "runs")
    assert run(["fly", str(path / "short.yaml"), "--lockstep", "--seed", "3", "--out", out]) == 1
    (folder,) = (path / "runs").iterdir()
    return folder


@pytest.fixture
def lockstep_folder(flown, tmp_path, monkeypatch):
    """A copy of it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short.yaml").write_text(SHORT, encoding="utf-8")
    return Path(shutil.copytree(flown, tmp_path / "runs" / flown.name))


def moment_at(time_us, state):
    return Moment(
        DroneState(time_us, 0.0, 0.0, 0.5, 0.0), VelocityFluCommand(), Detections(), state, time_us / 1e6
    )


class Flight:
    """A recorded flight with given events."""

    title = "a place: a mission"
    result = None

    def __init__(self, events):
        self.events = lambda: iter(events)


def states_in(text):
    """Second column of the lines that begin with a time; not those of a flight being flown ("s of")."""
    lines = [line.split() for line in text.splitlines()]
    return [words[2] for words in lines if words[1:2] == ["s"] and words[2] != "of"]


def test_a_recording_is_shown_state_by_state_and_ends_with_its_result(recorded, capsys):
    assert run(["replay", str(recorded.path), "--fast"]) == 0
    said = capsys.readouterr()
    flown = list(dict.fromkeys(moment.mission_state for moment in recorded.moments))
    assert states_in(said.err) == flown
    result = recorded.flown.result
    assert said.out.startswith(f"{result.reason}\ntry 5.0 s, ")


def test_a_run_folder_is_shown_from_its_recording(recorded, tmp_path, capsys):
    shutil.copy(recorded.path, tmp_path / "flight.mcap")
    assert run(["replay", str(tmp_path), "--speed", "0"]) == 0
    assert "take_off.start" in capsys.readouterr().err


def test_a_lockstep_flight_without_a_recording_is_flown_again(lockstep_folder, capsys):
    before = {path.name for path in lockstep_folder.iterdir()}
    assert run(["replay", str(lockstep_folder), "--fast"]) == 0
    said = capsys.readouterr()
    assert states_in(said.err)[0] == "take_off"
    assert "timed out" in said.out
    assert {path.name for path in lockstep_folder.iterdir()} == before
    with recorded_flight(lockstep_folder) as flight:
        assert flight.result.seed == 3
        assert sum(isinstance(event, RecordedImage) for event in flight.events()) > 30


def test_a_flight_that_differs_when_flown_again_is_refused(lockstep_folder, capsys):
    path = lockstep_folder / "scenario.yaml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("try_limit_s: 4", "try_limit_s: 3"), encoding="utf-8")
    assert run(["replay", str(lockstep_folder), "--fast"]) == 2
    assert "it is another flight (state_sha256 differs)" in capsys.readouterr().err


def test_a_flight_stopped_by_hand_cannot_be_flown_again(lockstep_folder, capsys):
    path = lockstep_folder / "result.json"
    result = json.loads(path.read_text(encoding="utf-8"))
    result |= {"ended": "aborted", "reason": "aborted after 1.0 s (interrupted); crossed: none"}
    path.write_text(json.dumps(result), encoding="utf-8")
    assert run(["replay", str(lockstep_folder), "--fast"]) == 2
    assert "stopped by hand" in capsys.readouterr().err


def test_the_recording_of_the_command_holds_the_flight_of_the_result(lockstep_folder, tmp_path):
    assert run(["fly", "short.yaml", "--lockstep", "--seed", "3", "--record", "--out", "again"]) == 1
    (folder,) = (tmp_path / "again").iterdir()
    plain = json.loads((lockstep_folder / "result.json").read_text(encoding="utf-8"))
    with recorded_flight(folder) as flight:
        assert flight.result.state_sha256 == plain["state_sha256"]
        assert "wall_time_s" not in flight.result.as_json()


def test_a_real_time_flight_is_shown_from_its_log_and_video(tmp_path, capsys):
    write_log(tmp_path / "flight.tlog")
    (tmp_path / "scenario.yaml").write_text(SHORT, encoding="utf-8")
    video = VideoFile(tmp_path / "video.avi", 10.0)
    for level in range(50):
        video.write(np.full((48, 64, 3), 5 * level, np.uint8))
    video.close()
    with recorded_flight(tmp_path) as flight:
        events = list(flight.events())
    moments = [event for event in events if isinstance(event, Moment)]
    images = [event for event in events if isinstance(event, RecordedImage)]
    assert 190 <= len(moments) <= 201
    first, last = moments[0].state, moments[-1].state
    assert (first.x, first.y, first.yaw) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    assert last.z - first.z == pytest.approx(0.8, abs=0.01)
    assert last.armed and last.mode == "OFFBOARD"
    assert moments[-1].flight_time_s == pytest.approx(8.8, abs=0.1)
    assert len(images) == 50
    assert images[-1].time_us == last.time_us
    assert images[0].time_us == last.time_us - 4_900_000
    assert images[-1].image.mean() == pytest.approx(245, abs=3)
    assert run(["replay", str(tmp_path), "--fast"]) == 0
    said = capsys.readouterr()
    assert "offboard" in said.err
    assert said.out == "no result: the flight was not judged\n"


def test_the_crossings_of_a_real_time_flight_are_those_of_its_result(tmp_path, capsys):
    write_log(tmp_path / "flight.tlog")
    result = {"frames_crossed": ["red", "green"], "crossing_times_s": [2.0, 4.5]}
    (tmp_path / "result.json").write_text(json.dumps({"verdict": "aborted", **result}), encoding="utf-8")
    assert run(["replay", str(tmp_path), "--fast"]) == 0
    told = [line.split() for line in capsys.readouterr().err.splitlines()]
    when_s = {line[-1]: float(line[0]) for line in reversed(told) if "crossed:" in line}
    assert when_s["red"] == pytest.approx(2.0, abs=0.11)
    assert when_s["green"] == pytest.approx(4.5, abs=0.11)


def test_a_killed_real_time_flight_is_shown_from_its_log(tmp_path, recorded):
    write_log(tmp_path / "flight.tlog")
    (tmp_path / "flight.mcap").write_bytes(recorded.path.read_bytes()[:5000])
    with recorded_flight(tmp_path) as flight:
        assert len([event for event in flight.events() if isinstance(event, Moment)]) > 190


def foreign_mcap(path):
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/x", "json", writer.register_schema("x", "", b""))
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()


RESULTS = {
    "result": '{"verdict": ',
    "strange result": '{"verdict": "clean", "try_time_s": "x"}',
    "result only": '{"verdict": "clean"}',
}


def damage(tmp_path, recorded, how):
    """Make something that is no flight, and return what to replay."""
    path = tmp_path / "flight.mcap"
    data = recorded.path.read_bytes()
    if how == "flipped":
        middle = len(data) // 3
        path.write_bytes(data[:middle] + bytes([data[middle] ^ 0x55]) + data[middle + 1 :])
    elif how == "foreign":
        foreign_mcap(path)
    elif how in RESULTS:
        (tmp_path / "result.json").write_text(RESULTS[how], encoding="utf-8")
        return tmp_path
    elif how == "log":
        (tmp_path / "flight.tlog").write_bytes(b"\xfd not MAVLink at all" * 50)
        return tmp_path
    elif how == "nothing":
        return tmp_path
    elif how == "missing":
        return tmp_path / "missing"
    else:
        path.write_bytes({"cut": data[: len(data) // 2], "text": b"hello\n" * 20, "empty": b""}[how])
    return path


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("cut", "cut short, as if its program had been killed; `mcap recover`"),
        ("flipped", "damaged (CRCValidationError); `mcap recover`"),
        ("text", "not an MCAP file"),
        ("empty", "not an MCAP file"),
        ("foreign", "not one of framerunner's; open it with Foxglove"),
        ("result", "result.json': damaged"),
        ("strange result", "result.json': damaged: try_time_s: Input should be"),
        ("result only", "fly it again with --record"),
        ("log", "holds no position"),
        ("nothing", "holds no flight"),
        ("missing", "does not exist"),
    ],
)
def test_what_cannot_be_shown_is_refused_in_one_line(tmp_path, recorded, capsys, how, words):
    assert run(["replay", str(damage(tmp_path, recorded, how)), "--fast"]) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert len(lines) == 1
    assert words in lines[0]


@pytest.mark.parametrize(
    ("options", "words"),
    [(["--speed", "-1"], "--speed -1: must be"), (["--port", "70000"], "--port 70000: must be")],
)
def test_options_that_make_no_sense_are_refused(recorded, capsys, options, words):
    assert run(["replay", str(recorded.path), *options]) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("seed", ["-1", str(2**63)])
def test_a_seed_is_checked(seed, capsys):
    assert run(["fly", "empty", "--lockstep", f"--seed={seed}"]) == 2
    assert "--seed" in capsys.readouterr().err


def test_a_seed_without_lockstep_is_refused(capsys):
    assert run(["fly", "empty", "--seed", "1"]) == 2
    assert "--seed 1: is for a flight in lockstep" in capsys.readouterr().err


async def test_a_crossing_prints_a_line(capsys):
    events = [moment_at(1000, "red.crossing"), Crossed(2000, "red"), moment_at(3000, "red.crossing")]
    await replay(Flight(events), 0.0, None)
    lines = capsys.readouterr().err.splitlines()
    assert [line.rpartition("crossed: ")[2] for line in lines] == ["none", "red"]


async def test_vehicle_time_is_wall_time_times_the_speed(monkeypatch):
    now_s, waits_s = 100.0, []

    async def sleep(seconds):
        nonlocal now_s
        waits_s.append(seconds)
        now_s += seconds + 0.001  # showing takes time, too

    monkeypatch.setattr(replay_module, "monotonic", lambda: now_s)
    monkeypatch.setattr(replay_module.asyncio, "sleep", sleep)
    events = [moment_at(5_000_000 + 1_000_000 * number, "a") for number in range(5)]
    await replay(Flight(events), 4.0, None)
    assert waits_s == pytest.approx([0.0, 0.249, 0.249, 0.249, 0.249])


async def test_images_are_served_while_the_flight_is_shown():
    video = VideoServer(port=0)
    image = np.full((48, 64, 3), 200, np.uint8)
    started, seen = asyncio.Event(), asyncio.Event()

    class Endless(Flight):
        def __init__(self):
            pass

        def events(self):
            started.set()
            time_us = 0
            while not seen.is_set():
                time_us += 100_000
                yield RecordedImage(time_us, image)

    showing = asyncio.create_task(replay(Endless(), 0.0, video))
    await started.wait()
    async with aiohttp.ClientSession() as session:
        status, headers = 503, {}
        while status == 503:
            async with session.get(f"{video.url}image.jpg") as response:
                status, headers, body = response.status, response.headers, await response.read()
    seen.set()
    await showing
    assert (status, body[:2]) == (200, b"\xff\xd8")
    assert int(headers["X-Time-Us"]) % 100_000 == 0


def test_ctrl_c_ends_a_replay(recorded, tmp_path):
    with program(tmp_path, "replay", str(recorded.path), "--no-video") as running:
        running.wait_for("take_off", 30.0)
        assert running.end(signal.SIGINT) == 130
        assert "Traceback" not in running.err
        assert "interrupted" in running.err


def test_the_seed_of_a_flight_is_in_its_recording(recorded):
    with recorded_flight(recorded.path) as flight:
        assert flight.result.seed == SEED
