"""The course's addresses: a pupil opens a lesson, has the mission checked, and is in the class's table."""

import asyncio
from contextlib import asynccontextmanager

import httpx
import pytest
from fastapi import FastAPI

from framerunner.course.door import CourseDoor
from framerunner.course.lessons import load_lessons

LESSON = load_lessons()[0]


@asynccontextmanager
async def course(folder, may_act=True):
    door = CourseDoor(folder)
    web = FastAPI()
    web.include_router(door.router(lambda _connection: may_act))
    running = asyncio.create_task(door.run())
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

        failed = (
            await client.post("/api/course/check", json={**who, "text": LESSON.start}, timeout=60)
        ).json()
        assert not failed["passed"]
        assert "without being within 0.25 m" in failed["reason"]
        passed = (
            await client.post("/api/course/check", json={**who, "text": LESSON.solution}, timeout=60)
        ).json()
        assert passed["passed"]
        assert passed["flight"]["track"]["x"]
        broken = (
            await client.post("/api/course/check", json={**who, "text": "states: 3"}, timeout=60)
        ).json()
        assert not broken["passed"]
        assert broken["reason"]

        (row,) = (await client.get("/api/course/class")).json()["learners"]
        assert row["name"] == "Ada"
        done = row["lessons"][LESSON.name]
        assert done["flights"] == 2  # a mission with mistakes was not flown
        assert done["passed_after_s"] > 0.0


async def test_lessons_are_told_in_both_languages(tmp_path):
    async with course(tmp_path, may_act=False) as client:
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
    async with course(tmp_path, may_act=False) as client:
        answer = await client.request(method, f"/api/course/{what}", json=content)
    assert answer.status_code == 403
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"learner": "", "lesson": LESSON.name}, "use 1 to 40 printable characters"),
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
