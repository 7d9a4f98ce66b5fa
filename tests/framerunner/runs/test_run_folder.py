"""The folder that a flight leaves."""

import errno
import json
import re
from threading import Event
from types import SimpleNamespace

import pytest

from framerunner.errors import SettingError, UserError
from framerunner.flying import run
from framerunner.flying.plan import FlightPlan
from framerunner.flying.real_time import RealTimeSettings
from framerunner.runs.recorder import RunRecords
from framerunner.runs.run_folder import UNFINISHED, RunFolder, write_outcome
from framerunner.runs.track import Track
from offboard.mission import load_mission
from scenarios.loader import load_scenario
from scenarios.result import FlightResult


def test_its_name_has_time_and_scenario(tmp_path):
    folder = RunFolder(tmp_path / "runs" / "today", "test-case-1")
    assert folder.path.is_dir()
    assert re.fullmatch(r"\d{8}-\d{6}-test-case-1", folder.path.name)


def test_two_flights_in_one_second_have_a_folder_each(tmp_path):
    paths = {RunFolder(tmp_path, "empty").path for _ in range(5)}
    assert len(paths) == 5
    assert all(path.is_dir() for path in paths)


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(SettingError, match=r"--out .*file.*choose another"):
        RunFolder(tmp_path / "file", "empty")


def test_a_result_is_written_completely_or_not_at_all(tmp_path):
    folder = RunFolder(tmp_path, "empty")
    result = FlightResult(verdict="clean", seed=None)
    folder.write_result(result)
    assert json.loads(folder.result.read_text(encoding="utf-8")) == {"seed": None, "verdict": "clean"}
    with pytest.raises(ValueError, match="JSON"):
        folder.write_result(result.model_copy(update={"try_time_s": float("nan")}))  # JSON has no NaN
    assert json.loads(folder.result.read_text(encoding="utf-8"))["verdict"] == "clean"
    assert [path.name for path in folder.path.iterdir()] == ["result.json"]


def test_a_result_that_cannot_be_written_is_told(tmp_path, capsys, monkeypatch):
    def full(*_paths):
        raise OSError(errno.ENOSPC, "No space left on device")

    folder = RunFolder(tmp_path, "empty")
    monkeypatch.setattr("os.replace", full)
    monkeypatch.setattr("framerunner.runs.plots.draw_track", full)
    scenario = load_scenario("empty")
    assert not write_outcome(folder, scenario, Track(), FlightResult(verdict="clean", seed=None))
    assert capsys.readouterr().err.count("No space left on device") == 2
    assert list(folder.path.iterdir()) == []


def test_a_flight_that_did_not_start_leaves_nothing(tmp_path):
    folder = RunFolder(tmp_path, "empty")
    folder.scenario.write_text("name: empty\n", encoding="utf-8")
    folder.hang_report.write_text("", encoding="utf-8")
    folder.remove_if_empty()
    assert not folder.path.exists()


def test_a_flight_that_was_stopped_before_its_start_leaves_nothing(tmp_path):
    folder = RunFolder(tmp_path / "runs", "empty")
    folder.tlog.write_bytes(b"while it was connecting")
    folder.video.write_bytes(b"from the ground")
    folder.stopped_before_start = True
    folder.remove_if_empty()
    assert list(tmp_path.iterdir()) == []


def test_what_was_recorded_stays(tmp_path):
    folder = RunFolder(tmp_path, "empty")
    folder.scenario.write_text("name: empty\n", encoding="utf-8")
    folder.hang_report.write_text("", encoding="utf-8")
    folder.tlog.write_bytes(b"\xfd")
    folder.remove_if_empty()
    assert {path.name for path in folder.path.iterdir()} == {"scenario.yaml", "flight.tlog"}


@pytest.mark.parametrize(
    ("error", "armed", "why"),
    [
        (ZeroDivisionError("no reason"), True, "unexpected error: ZeroDivisionError: no reason"),
        (UserError("the referee is gone"), True, "the referee is gone"),
        (UserError("it was refused"), False, None),
    ],
)
async def test_a_flight_that_armed_leaves_a_result_whatever_error_ended_it(
    tmp_path, monkeypatch, error, armed, why
):
    async def fly(plan, settings, records, monitor_url, guard):
        told = {"verdict": "aborted", "reason": f"aborted ({UNFINISHED})", "cause": UNFINISHED}
        records.keep_unfinished(FlightResult(**told))
        if armed:
            guard.expect(10.0)
        raise error

    monkeypatch.setattr(run, "fly_in_real_time", fly)
    plan = FlightPlan(load_scenario("empty"), load_mission("hover"))
    with pytest.raises(type(error)):
        await run.fly_once(run.FlightSettings(plan, RealTimeSettings(), run.OutputSettings(out=tmp_path)))
    results = [json.loads(path.read_text(encoding="utf-8")) for path in tmp_path.glob("*/result.json")]
    assert [(each["reason"], each["cause"]) for each in results] == (
        [(f"aborted ({why})", why)] if why else []
    )
    assert not list(tmp_path.glob("*/unfinished.json"))


def test_a_slow_disk_has_no_line_of_unfinished_results_to_write():
    is_fast, written = Event(), []

    def write(result):
        is_fast.wait(5.0)
        written.append(result)

    records = RunRecords(SimpleNamespace(keep_unfinished=write), None)
    for _ in range(10):
        records.keep_unfinished(FlightResult(verdict="clean", seed=None))
    is_fast.set()
    records.stop_keeping()
    assert len(written) == 1
