"""What an evaluation flies, and the identity by which it is recognised."""

from dataclasses import replace

import pytest

from framerunner.errors import SettingError
from framerunner.evaluation.plan import plan_files, plan_level
from framerunner.flying.response import ResponseDelay
from offboard.mission import load_mission
from offboard.pilot_file import PilotFile
from scenarios.loader import load_scenario
from scenarios.models import ScenarioError
from scenarios.random_numbers import LevelError
from scenarios.random_scenarios import load_level, random_scenario
from tests.framerunner.evaluation.flights import write_scenarios

PILOT = "from offboard.pilot import Pilot\n\n\nclass Mine(Pilot):\n    pass\n"


@pytest.fixture(scope="module")
def mission():
    return load_mission("frame_challenge")


def test_a_level_is_flown_with_consecutive_seeds(mission):
    plan = plan_level("calm", 5, 3, mission)
    assert [each.name for each in plan.scenarios] == ["calm-5", "calm-6", "calm-7"]
    assert plan.scenarios[1] == random_scenario(load_level("calm"), 6)
    assert plan.title == "level calm, seeds 5 to 7"
    assert [(task.scenario.name, task.seed) for task in plan.tasks({"calm-6"})] == [
        ("calm-5", 5),
        ("calm-7", 7),
    ]


def test_what_cannot_be_drawn_is_refused(mission):
    with pytest.raises(SettingError, match="--count 0: must be 1 or more"):
        plan_level("calm", 1, 0, mission)
    with pytest.raises(LevelError, match="unknown level"):
        plan_level("breezy", 1, 1, mission)
    for first, count in ((-1, 2), (2**63 - 1, 2), (2**63, 1)):
        with pytest.raises(LevelError, match="out of range"):
            plan_level("calm", first, count, mission)


def test_folders_files_and_names_are_flown_in_order(tmp_path, mission):
    folder = write_scenarios(tmp_path / "mine", (11, 9))
    (folder / "notes.txt").write_text("no scenario", encoding="utf-8")
    plan = plan_files([str(folder), "test-case-1", "calm-3"], mission)
    assert [each.name for each in plan.scenarios] == ["calm-11", "calm-9", "test-case-1", "calm-3"]
    assert plan_files([str(folder)], mission).default_out.name.startswith("evaluate-mine-frame_challenge-")


def test_faults_of_a_folder_are_refused_in_one_line(tmp_path, mission):
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(SettingError, match="empty: has no scenario files"):
        plan_files([str(empty)], mission)

    folder = write_scenarios(tmp_path / "mine")
    with pytest.raises(SettingError, match=r"calm-1: its name calm-1 is that of .*calm-1\.yaml too"):
        plan_files([str(folder), "calm-1"], mission)
    (folder / "x.yaml").write_text("name: x\nairframe: nonesuch\n", encoding="utf-8")
    with pytest.raises(ScenarioError, match="scenario x: unknown airframe"):
        plan_files([str(folder)], mission)
    (folder / "bad.yaml").write_text("name: bad\nframes: 3\n", encoding="utf-8")
    with pytest.raises(ScenarioError, match=r":2: frames is 3: must be a list"):
        plan_files([str(folder)], mission)


def test_equal_plans_have_equal_identities_and_others_have_not(mission):
    plan = plan_level("calm", 1, 3, mission)
    same = plan_level("calm", 1, 3, load_mission("frame_challenge"))
    assert plan.identity == same.identity
    assert plan.default_out == same.default_out
    assert plan.identity.difference(same.identity) == ""
    assert plan.identity.difference(replace(plan, seeds=[0, 0, 0]).identity) == "other seeds"
    own = load_mission("frame_challenge", PilotFile("mine.py", PILOT))
    own_changed = load_mission("frame_challenge", PilotFile("mine.py", PILOT + "# changed\n"))
    others = {
        "mission soft_landing, not frame_challenge": plan_level("calm", 1, 3, load_mission("soft_landing")),
        "pilot mine.py, not Pilot": plan_level("calm", 1, 3, own),
        "response lag=0.5, not none": plan.answering_late(ResponseDelay(lag_s=0.5)),
        r"other scenarios (4 from calm-1, not 3 from calm-1)": plan_level("calm", 1, 4, mission),
        r"other scenarios (3 from calm-2, not 3 from calm-1)": plan_level("calm", 2, 3, mission),
    }
    for difference, other in others.items():
        assert plan.identity.difference(other.identity) == difference
        assert other.default_out != plan.default_out
    changed = plan_level("calm", 1, 3, own_changed)
    assert plan_level("calm", 1, 3, own).identity.difference(changed.identity) == "another content of mine.py"


def test_a_changed_mission_or_scenario_of_the_same_name_changes_the_identity(tmp_path, mission):
    def own(x_m, goal):
        (tmp_path / "s.yaml").write_text(f"name: s\nstart: {{x_m: {x_m}}}\n", encoding="utf-8")
        text = f"name: m\nextends: frame_challenge\nvariables: {{x0: {goal}}}\n"
        (tmp_path / "m.yaml").write_text(text, encoding="utf-8")
        return plan_files([str(tmp_path / "s.yaml")], load_mission(tmp_path / "m.yaml")).identity

    first = own(0, 0.5)
    assert first.difference(own(0, 0.5)) == ""
    assert first.difference(own(1, 0.5)) == "another content of scenario s"
    assert first.difference(own(0, 0.25)) == "another content of mission m"


def test_every_field_of_a_scenario_changes_its_digest(mission):
    scenario = load_scenario("test-case-1")
    plan = plan_files(["test-case-1"], mission)
    (digest,) = plan.identity.scenarios.values()
    for name, value in {"try_limit_s": 179.0, "description": "other"}.items():
        changed = replace(plan, scenarios=[scenario.model_copy(update={name: value})])
        assert list(changed.identity.scenarios.values()) != [digest]
