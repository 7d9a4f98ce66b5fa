"""The folder of an evaluation: what was kept is read again after kills, damage and full disks."""

import os
from dataclasses import replace
from math import inf

import pytest

from framerunner.errors import SettingError
from framerunner.evaluation.plan import plan_level
from framerunner.evaluation.store import FLIGHTS, open_folder, read_folder
from framerunner.runs.track import Track
from offboard.mission import load_mission
from offboard.navigation.view import GateEstimate
from scenarios.loader import load_scenario
from tests.framerunner.evaluation.flights import made_row

ESTIMATE = GateEstimate("red", (3.0, 2.0, 2.0), 0.5, (inf, 0.1, 0.1), 0.1, True, False, 1, 2_900_000)
STATES = ["red.turning", "red.turning"]
TRACK = Track([0.0, 0.2], [1.0, 2.0], [3.0, 4.0], [0.5, 0.6], STATES, (ESTIMATE,))


@pytest.fixture(scope="module")
def plan():
    return plan_level("calm", 1, 4, load_mission("frame_challenge"))


def keep(path, plan, *rows):
    with open_folder(path, plan.identity) as folder:
        scenarios = {each.name: each for each in plan.scenarios}
        for row in rows:
            folder.keep(scenarios[row.scenario], row)


def kept(path, plan, **options):
    with open_folder(path, plan.identity, **options) as folder:
        rows = folder.rows()
        assert set(rows) == folder.done
        return list(rows.values())


def test_rows_are_found_again_in_the_order_of_the_scenarios(tmp_path, plan):
    flown = replace(TRACK, true_path=[(0.0, 0.1, 0.2, 0.3)], estimated_path=[(0.0, 0.1, 0.2, 0.4)])
    failed = made_row("calm-3", "timed out", track=flown)
    error = made_row("calm-2", "error", traceback="Traceback: this and that")
    keep(tmp_path / "a" / "b", plan, failed, made_row("calm-1"))
    keep(tmp_path / "a" / "b", plan, error)
    whole = [made_row("calm-1"), made_row("calm-2", "error"), made_row("calm-3", "timed out")]
    assert kept(tmp_path / "a" / "b", plan) == whole  # but for track and traceback
    folder = read_folder(tmp_path / "a" / "b", "--compare")
    assert folder.identity == plan.identity
    assert folder.track("calm-3") == flown
    assert folder.track("calm-1") == Track()
    assert folder.rows()["calm-3"].track is None
    assert folder.error_file("calm-2").read_text(encoding="utf-8") == "Traceback: this and that"
    assert load_scenario(folder.scenario_file("calm-3")) == plan.scenarios[2]


@pytest.mark.parametrize("cut", [1, 2, 40, 10_000])
def test_the_flight_of_an_incomplete_last_line_is_flown_again(tmp_path, plan, cut):
    rows = [made_row("calm-1"), made_row("calm-2"), made_row("calm-3")]
    keep(tmp_path, plan, *rows[:2])
    file = tmp_path / FLIGHTS
    content = file.read_bytes()
    last = content.rindex(b"\n", 0, -1) + 1
    file.write_bytes(content[: max(last, len(content) - cut)])
    expected = rows[:2] if cut == 1 else rows[:1]  # only the end of the line was missing
    assert kept(tmp_path, plan) == expected
    keep(tmp_path, plan, rows[2])
    assert kept(tmp_path, plan) == [*expected, rows[2]]


def test_a_damaged_line_costs_only_its_own_flight(tmp_path, plan):
    keep(tmp_path, plan, made_row("calm-1"), made_row("calm-2"), made_row("calm-3"))
    file = tmp_path / FLIGHTS
    lines = file.read_bytes().splitlines(keepends=True)
    file.write_bytes(lines[0] + b"\0" * 30 + b"\xff\n" + lines[2] + b"{}\n")
    assert [row.scenario for row in kept(tmp_path, plan)] == ["calm-1", "calm-3"]
    assert len(file.read_bytes().splitlines()) == 2


def test_another_evaluation_is_refused_unless_it_is_to_be_flown_again(tmp_path, plan):
    keep(tmp_path, plan, made_row("calm-1"))
    other = plan_level("calm", 1, 4, load_mission("soft_landing"))
    with pytest.raises(SettingError) as caught:
        kept(tmp_path, other)
    assert str(caught.value) == (
        f"--out {tmp_path}: has an evaluation of mission frame_challenge, not soft_landing; "
        "choose another, or --again to fly it again"
    )
    assert len(kept(tmp_path, plan)) == 1
    assert kept(tmp_path, other, again=True) == []
    assert not list((tmp_path / "scenarios").iterdir())


def test_again_deletes_the_same_evaluation_too(tmp_path, plan):
    keep(tmp_path, plan, made_row("calm-1"))
    assert kept(tmp_path, plan, again=True) == []


def test_other_files_are_not_deleted(tmp_path, plan):
    (tmp_path / "thesis.tex").write_text("years of work", encoding="utf-8")
    for again in (False, True):
        with pytest.raises(SettingError, match="has other files in it; choose a new folder"):
            kept(tmp_path, plan, again=again)
    inside = tmp_path / "inside"
    keep(inside, plan)
    (inside / "thesis.tex").write_text("years of work", encoding="utf-8")
    with pytest.raises(SettingError, match=r"thesis\.tex in it is not of an evaluation"):
        kept(inside, plan, again=True)
    assert (inside / "thesis.tex").exists()
    assert kept(inside, plan) == []  # the evaluation can be continued beside it


def test_a_folder_without_a_complete_identity_is_started_again(tmp_path, plan):
    (tmp_path / ".lock").touch()
    for name in ("evaluation.json.part", ".evaluation.json.0a1b2c3d.part"):
        (tmp_path / name).write_text('{"form', encoding="utf-8")
    assert kept(tmp_path, plan) == []
    assert (tmp_path / "evaluation.json").exists()


def test_two_evaluations_do_not_write_into_one_folder(tmp_path, plan):
    with open_folder(tmp_path, plan.identity):  # noqa: SIM117 - one after the other
        with pytest.raises(SettingError, match="another evaluation is writing here"):
            kept(tmp_path, plan)
    assert kept(tmp_path, plan) == []


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('{"format": 99}', "was made by another version"),
        ("{", "evaluation.json cannot be read"),
        ("[]", "evaluation.json cannot be read"),
        ('{"format": 2}', "evaluation.json cannot be read"),
    ],
)
def test_an_identity_that_cannot_be_read_is_refused(tmp_path, plan, content, message):
    keep(tmp_path, plan)
    (tmp_path / "evaluation.json").write_text(content, encoding="utf-8")
    with pytest.raises(SettingError, match=message):
        kept(tmp_path, plan)


def test_a_folder_that_cannot_be_made_is_refused(tmp_path, plan):
    (tmp_path / "file").touch()
    with pytest.raises(SettingError, match=r"--out .*file/x: cannot be written to"):
        kept(tmp_path / "file" / "x", plan)


def test_a_disk_that_fails_is_reported_and_what_was_kept_stays(tmp_path, plan, monkeypatch):
    keep(tmp_path, plan, made_row("calm-1"))

    def full(_descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(SettingError, match=r"No space left on device.*what was kept stays"):
        keep(tmp_path, plan, made_row("calm-2"))
    monkeypatch.undo()
    assert kept(tmp_path, plan)[0] == made_row("calm-1")


def test_there_must_be_something_to_compare_with(tmp_path):
    with pytest.raises(SettingError, match=r"--compare .*: holds no evaluation"):
        read_folder(tmp_path / "nothing", "--compare")
