"""Run folders as the monitor sees them: listed quickly, read in another process, nothing else opened."""

import json
import os
import shutil
import time
from tempfile import TemporaryDirectory

import cv2
import numpy as np
import pytest

from framerunner.cli import run
from framerunner.monitor.ports import RunError
from framerunner.monitoring import run_library
from framerunner.monitoring.run_library import RunFolders
from framerunner.runs.recorder import VideoFile
from scenarios.loader import load_scenario
from tests.framerunner.recording.logs import write_log

SHORT = """name: short
frames: [{colour: red, x_m: 2.0, y_m: 0.0, z_m: 1.0}]
try_limit_s: 6
"""


@pytest.fixture(scope="session")
def flown(tmp_path_factory):
    """The folder of a short flight in lockstep, without a recording."""
    path = tmp_path_factory.mktemp("flown")
    (path / "short.yaml").write_text(SHORT, encoding="utf-8")
    assert run(["fly", str(path / "short.yaml"), "--lockstep", "--out", str(path / "runs")]) == 1
    (folder,) = (path / "runs").iterdir()
    return folder


@pytest.fixture(scope="session")
def library(flown):
    return RunFolders(flown.parent)


@pytest.fixture(scope="session")
def recording(library, flown):
    return library.recording(flown.name)


def result_in(runs, name, **changes):
    """A run folder that contains only a result."""
    result = {
        "scenario": "place",
        "mission": "task",
        "verdict": "clean",
        "total_time_s": 12.5,
        "started": "2026-01-02T03:04:05+00:00",
        **changes,
    }
    folder = runs / name
    folder.mkdir(parents=True)
    (folder / "result.json").write_text(json.dumps(result), encoding="utf-8")
    return folder


def test_runs_are_listed_newest_first(tmp_path):
    result_in(tmp_path, "b", started="2026-01-02T03:04:06+00:00", verdict="crashed", total_time_s=None)
    result_in(tmp_path, "a")
    result_in(tmp_path, "c", started="2026-01-02T05:04:05+02:00", scenario="<b>x</b>")
    (tmp_path / "20250102-030405-open-field").mkdir()
    (tmp_path / "20250102-030405-open-field" / "flight.tlog").write_bytes(b"\0")
    runs = RunFolders(tmp_path).runs()
    assert runs[0].name == "b"
    assert {each.name for each in runs[1:3]} == {"a", "c"}
    assert runs[3].name == "20250102-030405-open-field"
    assert (runs[3].scenario, runs[3].verdict, runs[3].total_time_s) == ("open-field", "", None)
    assert runs[3].started.startswith("2025-01-02T03:04:05")
    assert (runs[0].verdict, runs[0].total_time_s) == ("crashed", None)
    first = next(each for each in runs if each.name == "a")
    assert (first.scenario, first.mission, first.total_time_s) == ("place", "task", 12.5)


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '"text"', "\xff", '{"verdict": ' + "[" * 100_000, " " * 1_100_000 + "{}"]
)
def test_a_damaged_run_is_listed_as_unreadable(tmp_path, text):
    result_in(tmp_path, "good")
    (result_in(tmp_path, "bad") / "result.json").write_text(text, encoding="latin-1")
    verdicts = {each.name: each.verdict for each in RunFolders(tmp_path).runs()}
    assert verdicts == {"good": "clean", "bad": "unreadable"}


@pytest.mark.parametrize(
    "changes",
    [{"total_time_s": float("nan")}, {"total_time_s": "x"}, {"verdict": 3}, {"started": 5}, {"scenario": {}}],
)
def test_strange_values_in_a_result_are_left_out(tmp_path, changes):
    result_in(tmp_path, "a", **changes)
    (info,) = RunFolders(tmp_path).runs()
    (name,) = changes
    assert getattr(info, name) in {"", None}


def test_what_is_no_run_is_not_listed(tmp_path):
    (tmp_path / "file").write_text("x", encoding="utf-8")
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "read.me").write_text("x", encoding="utf-8")
    os.mkdir(os.fsencode(tmp_path) + b"/\xff")
    (tmp_path / os.fsdecode(b"\xff") / "result.json").write_text("{}", encoding="utf-8")
    assert RunFolders(tmp_path).runs() == []
    assert RunFolders(tmp_path / "missing").runs() == []


def test_hundreds_of_runs_are_listed_at_once_and_read_only_once(tmp_path, monkeypatch):
    for number in range(300):
        result_in(
            tmp_path, f"run-{number}", started=f"2026-01-02T03:{number // 60:02d}:{number % 60:02d}+00:00"
        )
    library = RunFolders(tmp_path)
    before_s = time.process_time()
    assert [each.name for each in library.runs()[:2]] == ["run-299", "run-298"]
    assert time.process_time() - before_s < 1.0
    read = []
    looked = run_library._info
    monkeypatch.setattr(run_library, "_info", lambda folder: read.append(folder.name) or looked(folder))
    assert len(library.runs()) == 300
    assert read == []
    changed = tmp_path / "run-7" / "result.json"
    changed.write_text(json.dumps({"verdict": "crashed"}), encoding="utf-8")
    os.utime(changed, (1, 1))
    assert {each.name: each.verdict for each in library.runs()}["run-7"] == "crashed"
    assert read == ["run-7"]


def test_a_lockstep_flight_is_flown_again_and_read_completely(recording, flown):
    result = json.loads((flown / "result.json").read_text(encoding="utf-8"))
    scenario = load_scenario(flown / "scenario.yaml")
    assert recording["name"] == flown.name
    assert recording["result"]["state_sha256"] == result["state_sha256"]
    assert recording["world"]["scenario"] == scenario.model_dump(mode="json")
    assert recording["world"]["source"] == "truth"
    poses = recording["poses"]
    assert poses[0]["t"] < 0.0 < poses[-1]["t"]
    steps = np.diff([pose["t"] for pose in poses])
    assert np.median(steps) == pytest.approx(0.05, abs=0.002)
    assert not poses[0]["on"]
    assert max(pose["p"][2] for pose in poses) > scenario.base.top_m + 0.3
    assert all(np.linalg.norm(pose["q"]) == pytest.approx(1.0, abs=1e-3) for pose in poses)
    rising = max(poses, key=lambda pose: pose["v"][2])
    assert rising["v"][2] == pytest.approx(rising["c"][2], abs=0.2)


def test_its_chart_states_and_transitions_belong_together(recording):
    chart, states = recording["chart"], recording["states"]
    assert chart["name"] == "explorer"
    assert chart["mermaid"].startswith("stateDiagram-v2")
    assert chart["states"] == states[: len(chart["states"])]
    assert "extends" in chart["source"] or "states" in chart["source"]
    transitions = recording["transitions"]
    assert transitions[0]["from"] == "take_off"
    assert [each["from"] for each in transitions[1:]] == [each["to"] for each in transitions[:-1]]
    assert any(each["when"] and each["values"] for each in transitions)
    for each in transitions:
        pose = next(pose for pose in recording["poses"] if pose["t"] >= each["time_s"])
        assert states[pose["s"]] == each["to"]


def test_detections_and_images_have_their_times(recording, library, flown):
    assert recording["images"] == sorted(recording["images"])
    times = [each["t"] for each in recording["detections"]]
    assert times == sorted(times)
    seen = next(each for each in recording["detections"] if each["boxes"]["red"])
    assert (seen["width"], seen["height"]) == (320, 240)
    assert len(seen["boxes"]["red"]) == 6
    index = recording["images"].index(seen["t"])
    image = cv2.imdecode(np.frombuffer(library.image(flown.name, index), np.uint8), cv2.IMREAD_COLOR)
    assert image.shape == (240, 320, 3)
    n, s, e, w, _, _ = seen["boxes"]["red"]
    box = image[round(120 - n) : round(120 - s), round(160 + w) : round(160 + e)].astype(int)
    assert (box @ [-1, -1, 2] > 100).any()  # a far bar fills a part of its pixels only


def test_a_real_time_flight_is_read_from_its_log_and_video(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "scenario.yaml").write_text(SHORT, encoding="utf-8")
    write_log(folder / "flight.tlog")
    video = VideoFile(folder / "video.avi", 10.0)
    for level in range(50):
        video.write(np.full((48, 64, 3), 5 * level, np.uint8))
    video.close()
    recording = RunFolders(tmp_path).recording("run")
    poses = recording["poses"]
    assert (recording["chart"], recording["result"], recording["detections"][0]["width"]) == (None, None, 64)
    assert all(pose["c"] is None for pose in poses)
    assert poses[0]["t"] == pytest.approx(-1.2, abs=0.1)  # motors on after 1.2 of ten seconds
    assert poses[-1]["t"] == pytest.approx(8.8, abs=0.1)
    assert poses[-1]["p"][2] - poses[0]["p"][2] == pytest.approx(0.8, abs=0.02)
    assert recording["states"][poses[-1]["s"]] == "offboard"
    assert len(recording["images"]) == 50
    assert recording["images"][-1] == poses[-1]["t"]


def test_it_is_json_without_nan(recording):
    json.dumps(recording, allow_nan=False)


def test_a_second_request_does_not_fly_again(library, flown, recording, monkeypatch):
    monkeypatch.setattr(run_library, "_unpack", None)
    assert library.recording(flown.name) is recording
    assert library.image(flown.name, 0)[:2] == b"\xff\xd8"


@pytest.mark.parametrize(
    "name", ["", ".", "..", "../other", "/etc", "other/", "no\0thing", "x" * 5000, "linked", "missing"]
)
def test_only_names_of_the_listing_are_opened(tmp_path, name):
    runs = tmp_path / "runs"
    result_in(runs, "good")
    result_in(tmp_path, "other")
    (runs / "linked").symlink_to(tmp_path / "other")
    library = RunFolders(runs)
    assert [each.name for each in library.runs()] == ["good"]
    for ask in (lambda: library.recording(name), lambda: library.image(name, 0)):
        with pytest.raises(RunError, match="there is no such run") as refused:
            ask()
        assert "\n" not in str(refused.value)
        assert len(str(refused.value)) < 300 + len(str(tmp_path))


def test_linked_files_are_not_read(tmp_path, flown):
    folder = tmp_path / "run"
    shutil.copytree(flown, folder)
    (folder / "scenario.yaml").unlink()
    (folder / "scenario.yaml").symlink_to("/etc/passwd")
    with pytest.raises(RunError, match=r"its scenario\.yaml is a link"):
        RunFolders(tmp_path).recording("run")


def test_an_image_that_is_not_there(library, flown, recording):
    for index in (-1, len(recording["images"]), 10**12):
        with pytest.raises(RunError, match=f"has no image {index}"):
            library.image(flown.name, index)


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (
            lambda folder: (folder / "scenario.yaml").write_text("name: [", encoding="utf-8"),
            r"run/scenario\.yaml:",
        ),
        (lambda folder: (folder / "mission.yaml").unlink(), "neither recording nor log"),
        (lambda folder: (folder / "flight.mcap").write_bytes(b"no recording"), "not an MCAP file"),
    ],
)
def test_what_cannot_be_shown_is_refused_in_one_line(tmp_path, flown, damage, words):
    folder = tmp_path / "run"
    shutil.copytree(flown, folder)
    damage(folder)
    with pytest.raises(RunError, match=words) as refused:
        RunFolders(tmp_path).recording("run")
    assert str(refused.value).startswith("run 'run': cannot be shown: ")
    assert "\n" not in str(refused.value)
    assert str(tmp_path) not in str(refused.value)


def test_a_contestant_s_file_is_never_executed(tmp_path, flown):
    folder = tmp_path / "run"
    shutil.copytree(flown, folder)
    mark = tmp_path / "executed"
    (folder / "pilot.py").write_text(f"open({str(mark)!r}, 'w')", encoding="utf-8")
    assert RunFolders(tmp_path).recording("run")["chart"] is not None
    assert not mark.exists()


def test_no_more_than_a_few_runs_are_kept_unpacked(tmp_path, monkeypatch):
    def unpack(folder, mark, readers, pilot):
        target = TemporaryDirectory()
        return run_library._Unpacked(mark, target, {"name": folder.name}, [])

    monkeypatch.setattr(run_library, "_unpack", unpack)
    names = [f"run-{number}" for number in range(run_library.KEPT_RUNS + 2)]
    for name in names:
        result_in(tmp_path, name)
    library = RunFolders(tmp_path)
    library.recording(names[0])
    kept = library._unpacked[names[0]].folder.name
    assert os.path.exists(kept)
    for name in names:
        assert library.recording(name)["name"] == name
    assert list(library._unpacked) == names[2:]
    assert not os.path.exists(kept)
