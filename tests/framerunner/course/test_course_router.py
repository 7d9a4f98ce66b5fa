"""The course's addresses: a pupil opens a lesson, has the mission checked, and is in the class's table."""

import asyncio
import json
from contextlib import asynccontextmanager

import httpx
import pytest
from fastapi import FastAPI

from framerunner.course.lessons import load_lessons
from framerunner.course.router import CourseRouter
from framerunner.monitor.access import Role, Visitor

LESSON = load_lessons()[0]
TEACHER = Visitor(role=Role.ORGANISER)


async def check(client, learner, text, lesson=LESSON.name):
    """The lines of a check."""
    content = {"learner": learner, "lesson": lesson, "text": text}
    answer = await client.post("/api/course/check", json=content, timeout=60)
    assert answer.status_code == 200, answer.text
    return [json.loads(line) for line in answer.text.splitlines()]


@asynccontextmanager
async def course(folder, who=lambda _connection: TEACHER):
    router = CourseRouter(folder)
    web = FastAPI()
    web.include_router(router.router(who))
    running = asyncio.create_task(router.run())
    try:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(web), base_url="http://course") as client:
            yield client
    finally:
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)


async def test_a_pupil_opens_a_lesson_fails_passes_and_is_in_the_table(tmp_path):
    async with course(tmp_path) as client:
        who = {"learner": "Ada", "lesson": LESSON.name}
        opened = (await client.post("/api/course/open", json=who)).json()
        path = tmp_path / opened["file"]
        assert path.read_text() == LESSON.start
        path.write_text("mine")
        assert (await client.post("/api/course/open", json=who)).json() == opened
        assert path.read_text() == "mine"  # a mission that there is is never written again

        failed = (await check(client, "Ada", LESSON.start))[-1]
        assert not failed["passed"]
        assert "without being within 0.25 m" in failed["reason"]
        passed = (await check(client, "Ada", LESSON.solution))[-1]
        assert passed["passed"]
        assert passed["flight"]["track"]["x"]
        broken = (await check(client, "Ada", "states: 3"))[-1]
        assert not broken["passed"]
        assert broken["reason"]

        (row,) = (await client.get("/api/course/class")).json()["learners"]
        assert row["name"] == "Ada"
        done = row["lessons"][LESSON.name]
        assert done["flights"] == 2  # a mission with mistakes was not flown
        assert done["passed_after_s"] > 0.0


async def test_checks_queue_and_a_learner_has_one(tmp_path, monkeypatch):
    monkeypatch.setattr("framerunner.course.router._CHECKS_AT_ONCE", 1)
    async with course(tmp_path) as client:
        told = await asyncio.gather(*(check(client, name, LESSON.solution) for name in ("Ada", "Bo", "Cy")))
        assert all(lines[-1]["passed"] for lines in told)
        places = [list(dict.fromkeys(line["place"] for line in lines[:-1])) for lines in told]
        assert places == [[], [1], [2, 1]]
        assert all(line["seconds"] >= 0 for lines in told for line in lines[:-1])
        content = {"learner": "Ada", "lesson": LESSON.name, "text": LESSON.start}
        first = asyncio.create_task(check(client, "Ada", LESSON.start))
        await asyncio.sleep(0.1)
        second = await client.post("/api/course/check", json=content)
        assert second.status_code == 409
        assert "Ada's mission is being checked" in second.json()["detail"]
        assert not (await first)[-1]["passed"]


async def test_a_pupil_is_only_the_one_who_logged_in_and_a_teacher_resets_and_exports(tmp_path):
    visitor = Visitor("Ada", Role.PUPIL, "ada_2")
    async with course(tmp_path, lambda _connection: visitor) as client:
        own = {"learner": "Ada", "lesson": LESSON.name}
        assert (await client.post("/api/course/open", json=own)).json() == {"file": "lesson_1_ada_2.yaml"}
        for what in ("open", "check"):
            other = await client.post(
                f"/api/course/{what}", json={**own, "learner": "Bo", "text": LESSON.start}
            )
            assert other.status_code == 403
            assert "you are logged in as Ada" in other.json()["detail"]
        for method, what in (("POST", "reset"), ("GET", "class.csv")):
            assert (await client.request(method, f"/api/course/{what}", json=own)).status_code == 403
        visitor = TEACHER
        assert (await client.post("/api/course/open", json={**own, "learner": "=Bo"})).status_code == 200
        await check(client, "=Bo", LESSON.solution)
        csv = (await client.get("/api/course/class.csv")).text.splitlines()
        assert csv[0] == "pupil,lesson,flights,passed,passed_after_min,last_flight"
        assert csv[2].startswith(f"'=Bo,{LESSON.name},1,true,0.")
        visitor = Visitor("Ada", Role.PUPIL, "ada_2")
        (row,) = (await client.get("/api/course/class")).json()["learners"]
        assert row["name"] == "Ada"
        visitor = TEACHER
        await client.post("/api/course/reset", json={"learner": "=Bo", "lesson": ""})
        rows = {
            row["name"]: row["lessons"] for row in (await client.get("/api/course/class")).json()["learners"]
        }
        assert rows["=Bo"] == {}
        assert LESSON.name in rows["Ada"]


async def test_a_link_in_the_folder_is_not_written_through(tmp_path):
    folder = tmp_path / "missions"
    folder.mkdir()
    (folder / "lesson_1_ada.yaml").symlink_to(tmp_path / "elsewhere.yaml")
    async with course(folder) as client:
        await client.post("/api/course/open", json={"learner": "Ada", "lesson": LESSON.name})
    assert not (tmp_path / "elsewhere.yaml").exists()


async def test_lessons_are_told_in_both_languages(tmp_path):
    async with course(tmp_path, who=lambda _connection: Visitor()) as client:
        told = (await client.get("/api/course")).json()["lessons"]
    assert [each["number"] for each in told] == [1, 2, 3, 4, 5]
    assert told[0]["title"] == {"en": "Take off and hover", "es": "Despegar y mantenerse en el aire"}
    assert "solution" not in told[0]


@pytest.mark.parametrize(
    ("method", "what", "content"),
    [
        ("POST", "open", {"learner": "Ada", "lesson": LESSON.name}),
        ("POST", "check", {"learner": "Ada", "lesson": LESSON.name, "text": LESSON.solution}),
        ("GET", "class", None),
    ],
)
async def test_strangers_take_no_part(method, what, content, tmp_path):
    async with course(tmp_path, who=lambda _connection: Visitor()) as client:
        answer = await client.request(method, f"/api/course/{what}", json=content)
    assert answer.status_code == 403
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            {"learner": "", "lesson": LESSON.name},
            "nobody has given a name in this browser; open the lesson from the page Course",
        ),
        ({"learner": "Ada", "lesson": "../../etc"}, "unknown lesson"),
    ],
)
async def test_what_cannot_be_opened_is_said_in_a_line(content, words, tmp_path):
    async with course(tmp_path) as client:
        answer = await client.post("/api/course/open", json=content)
    assert answer.status_code == 400
    assert words in answer.json()["detail"]


async def test_names_that_are_no_file_names_stay_in_the_folder(tmp_path):
    async with course(tmp_path) as client:
        files = set()
        for name in ("../../x", "Ñandú", "名前", "a/b"):
            told = await client.post("/api/course/open", json={"learner": name, "lesson": LESSON.name})
            files.add(told.json()["file"])
    assert len(files) == 4
    assert files <= {each.name for each in tmp_path.iterdir()}
