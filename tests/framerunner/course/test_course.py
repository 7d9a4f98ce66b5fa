"""The lessons can be solved and are not solved yet; a class's progress is kept."""

import json

import pytest

from framerunner.cli import run
from framerunner.course.lessons import LessonError, find_lesson, load_lessons
from framerunner.course.progress import CourseEvent, CourseProgress, LessonProgress
from framerunner.errors import SettingError
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from offboard.mission import load_mission
from tests.disk import disk_that_takes

LESSONS = load_lessons()
NAMES = [lesson.name for lesson in LESSONS]


@pytest.fixture
def mission(tmp_path):
    def write(text):
        path = tmp_path / "mission.yaml"
        path.write_text(text)
        return load_mission(path)

    return write


@pytest.mark.parametrize("lesson", LESSONS, ids=NAMES)
def test_the_solution_passes_and_the_start_does_not(lesson, mission):
    solved = fly_lockstep(FlightPlan(lesson.scenario, mission(lesson.solution))).result
    assert solved.verdict == "clean", solved.reason
    begun = fly_lockstep(FlightPlan(lesson.scenario, mission(lesson.start))).result
    assert not begun.completed
    assert begun.landed_on_base  # it flies, lands, and lacks what the lesson teaches
    assert "without" in begun.reason


def test_there_are_five_lessons_and_the_last_ends_at_the_papers_navigator():
    assert [lesson.number for lesson in LESSONS] == [1, 2, 3, 4, 5]
    assert LESSONS[-1].solution == load_mission("frame_challenge").path.read_text()
    assert sum(lesson.text.minutes for lesson in LESSONS) <= 45


@pytest.mark.parametrize("lesson", LESSONS, ids=NAMES)
def test_the_names_that_a_lesson_introduces_exist_and_its_solution_uses_them(lesson):
    text = lesson.solution
    for name in lesson.text.introduces:
        assert name.rpartition(".")[2] in text or name.startswith("imu."), name


def test_a_lesson_is_found_by_number_and_name():
    assert find_lesson("3").name == find_lesson("3_face_a_frame").name == NAMES[2]
    with pytest.raises(LessonError, match="unknown lesson '9'; use one of 1"):
        find_lesson("9")


@pytest.mark.parametrize("language", ["en", "es"])
def test_a_lesson_is_begun_at_the_command_line(language, tmp_path, capsys):
    assert run(["course", "start", "1", "--out", str(tmp_path), "--language", language]) == 0
    told = capsys.readouterr().out
    assert LESSONS[0].text.goal.in_language(language) in told
    path = tmp_path / "lesson_1.yaml"
    assert f"framerunner edit {path}" in told  # the steps are about its page
    assert path.read_text() == LESSONS[0].start
    path.write_text(LESSONS[0].solution)
    assert run(["course", "start", "1", "--out", str(tmp_path)]) == 2
    assert path.read_text() == LESSONS[0].solution


def test_a_lesson_is_checked_at_the_command_line(tmp_path, capsys):
    path = tmp_path / "lesson_1.yaml"
    path.write_text(LESSONS[0].start)
    assert run(["course", "check", "1", str(path)]) == 1
    assert "not yet: aborted" in capsys.readouterr().out
    path.write_text(LESSONS[0].solution)
    assert run(["course", "check", "1", str(path)]) == 0
    assert "passed: clean" in capsys.readouterr().out


def test_a_class_has_a_table(tmp_path):
    progress = CourseProgress(tmp_path / "class" / "progress.jsonl")
    assert progress.table(NAMES) == {}
    for event in (
        CourseEvent(100.0, "Ada", NAMES[0], "opened"),
        CourseEvent(160.0, "Ada", NAMES[0], "flown", "aborted"),
        CourseEvent(170.0, "Bo", NAMES[0], "opened"),
        CourseEvent(220.0, "Ada", NAMES[0], "passed", "clean"),
        CourseEvent(300.0, "Ada", NAMES[0], "flown", "crashed"),
        CourseEvent(310.0, "Ada", "no lesson", "passed", "clean"),
    ):
        progress.add(event)
    table = progress.table(NAMES)
    assert list(table) == ["Ada", "Bo"]
    assert table["Ada"] == {NAMES[0]: LessonProgress(3, 120.0, "crashed")}
    assert table["Bo"] == {NAMES[0]: LessonProgress()}


def test_a_damaged_file_keeps_what_is_whole(tmp_path):
    path = tmp_path / "progress.jsonl"
    progress = CourseProgress(path)
    progress.add(CourseEvent(1.0, "Ada", NAMES[0], "flown", "aborted"))
    with path.open("ab") as file:
        file.write(
            b'{"time_s": 2.0, "learner": "Bo"}\n[]\nnull\n\xff\n' + json.dumps({"time_s": "x"}).encode()
        )
    progress.add(CourseEvent(3.0, "Cy", NAMES[0], "flown", "aborted"))
    assert "Ada" in progress.table(NAMES)
    progress.add(CourseEvent(4.0, "Di", NAMES[0], "flown", "aborted"))
    assert set(progress.table(NAMES)) == {"Ada", "Cy", "Di"}


@pytest.mark.parametrize("name", ["", "a\nb", " Ada", "x" * 61])
def test_a_name_that_would_not_be_shown_as_it_is_is_refused(name, tmp_path):
    with pytest.raises(SettingError, match=r"use 1 to 60 printable characters|nobody has given a name"):
        CourseProgress(tmp_path / "file").add(CourseEvent(1.0, name, NAMES[0], "opened"))


@pytest.mark.parametrize("command", [["course", "start", "1"], ["mission", "new", "mine"]])
def test_a_full_disk_leaves_no_part_of_a_mission_that_is_then_taken_for_one(tmp_path, command, capsys):
    with disk_that_takes(10):
        assert run([*command, "--out", str(tmp_path)]) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
    assert run([*command, "--out", str(tmp_path)]) == 0
