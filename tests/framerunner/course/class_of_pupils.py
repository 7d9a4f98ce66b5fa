"""A class at the course, each pupil a program in a browser context of its own, all at the same time.

    python -m tests.framerunner.course.class_of_pupils --pupils 20

flies lessons 1 to 3 and says how long the checks took. Every pupil also tries what is not allowed.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import socket
import statistics
import sys
import time
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.async_api import Browser, Page, expect

from framerunner.course.lessons import load_lessons
from tests.chromium import chromium
from tests.framerunner.editing.editor_program import free_port

CODE = "heron and kite"
SIZE = {"width": 1280, "height": 900}
PATIENCE_S = 300.0
# What is asked in the page, with its cookie: status codes of requests, and of a WebSocket that is refused.
FORBIDDEN = """async ({file, learner}) => {
  const post = async (path, content) => (await fetch(path, {
    method: "POST", headers: {"Content-Type": "application/json"}, body: JSON.stringify(content)})).status;
  const closed = (path) => new Promise((resolve) => {
    const socket = new WebSocket(location.origin.replace("http", "ws") + path);
    socket.onmessage = () => resolve(200);
    socket.onclose = ({code}) => resolve(code);
  });
  return [
    await post("/api/course/open", {learner, lesson: "1"}),
    await post("/api/course/check", {learner, lesson: "1", text: "name: x"}),
    await post("/api/course/reset", {learner, lesson: ""}),
    await post("/api/competition/teams", {name: "Ours"}),
    await post("/api/competition/draw", {pool: ["test-case-1"], count: 1}),
    await post("/api/competition/tries/1/judgement", {seen: 0, contacts: 0}),
    (await fetch(`/api/edit/export?kind=mermaid&file=${file}`)).status,
    (await fetch("/api/course/class.csv")).status,
    await closed(`/ws/edit?file=${file}`), await closed("/ws/pilot"), await closed("/ws/operator"),
  ];
}"""
REFUSED = [403] * 8 + [4403] * 3


@dataclass
class Course:
    """What happened.

    Attributes:
        checks_s: how long each check took, by lesson.
        longest_line: the last place in a line that was shown.
    """

    checks_s: dict[int, list[float]] = field(default_factory=dict)
    longest_line: int = 0


@asynccontextmanager
async def monitor(folder: Path):
    """A monitor for the network with the missions of a folder; yields its address."""
    (folder / "missions").mkdir()
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "framerunner", "monitor", "--bind", "0.0.0.0", "--port", "0"),
        *(
            "--drone",
            f"udpin://127.0.0.1:{free_port(socket.SOCK_DGRAM)}",
            "--missions",
            str(folder / "missions"),
        ),
        *("--database", f"sqlite:///{folder}/contest.db", "--runs", str(folder / "runs")),
        stdout=asyncio.subprocess.DEVNULL,
        stderr=asyncio.subprocess.PIPE,
        env={**os.environ, "FRAMERUNNER_CLASS_CODE": CODE, "FRAMERUNNER_JUDGE_PASSWORD": "for judges only"},
    )
    try:
        told = ""
        while "monitor: http" not in told:
            line = (await process.stderr.readline()).decode()
            assert line, told
            told += line
        port = told.rpartition("monitor: ")[2].split()[0].rstrip("/").rpartition(":")[2]
        reading = asyncio.create_task(process.stderr.read())
        yield f"http://127.0.0.1:{port}"
        reading.cancel()
    finally:
        if process.returncode is None:
            process.terminate()
            await process.wait()


async def take_part(browser: Browser, url: str, number: int, pupils: int, lessons: int, seen: Course) -> None:
    """A pupil logs in, solves lessons, and tries to change what is another's."""
    name, neighbour = f"Pupil {number}", (number + 1) % pupils
    context = await browser.new_context(viewport=SIZE)
    page = await context.new_page()
    page.set_default_timeout(1000 * PATIENCE_S)
    try:
        await page.goto(f"{url}/login?next=/course")
        await page.fill("[name=name]", name)
        await page.fill("[type=password]", CODE)
        await page.keyboard.press("Enter")
        await expect(page.locator(".c-name")).to_contain_text(f"You are {name}.")
        await page.get_by_role("button", name="Begin").first.click()
        for lesson in load_lessons()[:lessons]:
            seen.checks_s.setdefault(lesson.number, []).append(await _solve(page, lesson, seen))
            if lesson.number == 1:
                what = {"file": f"lesson_1_pupil_{neighbour}.yaml", "learner": f"Pupil {neighbour}"}
                found = await page.evaluate(FORBIDDEN, what)
                assert found == REFUSED, found
            if lesson.number < lessons:
                await page.get_by_role("button", name="Next lesson").click()
                await page.wait_for_url(f"**lesson={load_lessons()[lesson.number].name}")
    finally:
        await context.close()


async def _solve(page: Page, lesson, seen: Course) -> float:
    """Write the solution and have it checked; how long that took."""
    await expect(page.locator(".e-saved")).not_to_be_empty(timeout=1000 * PATIENCE_S)
    await page.locator(".cm-content").click()
    await page.keyboard.press("ControlOrMeta+a")
    await page.keyboard.insert_text(lesson.solution)
    await page.keyboard.press("ControlOrMeta+s")
    line = page.locator(".e-lesson-line")
    started_s = time.monotonic()
    await page.get_by_role("button", name="Check the lesson").click()
    while True:
        told = await line.text_content() or ""
        if told.startswith("Place "):
            seen.longest_line = max(seen.longest_line, int(told.split()[1]))
        elif await line.get_attribute("data-passed") == "true":
            return time.monotonic() - started_s
        else:
            assert told.startswith(("flying", "When you are ready")), told
        assert time.monotonic() - started_s < PATIENCE_S, told
        await asyncio.sleep(0.2)


def _check_files(missions: Path, pupils: int) -> None:
    """Each pupil's mission is what that pupil has written."""
    solutions = {each.number: each.solution for each in load_lessons()}
    files = sorted(missions.glob("lesson_*.yaml"))
    assert len(files) % pupils == 0 and files
    for file in files:
        assert file.read_text() == solutions[int(file.name.split("_")[1])], file
    assert len(json.loads((missions / "course-pupils.json").read_text())["pupils"]) == pupils


async def hold_class(pupils: int, lessons: int) -> Course:
    """Let a class go through the first lessons."""
    expect.set_options(timeout=1000 * PATIENCE_S)  # a class on two processors loads its pages slowly
    seen = Course()
    with TemporaryDirectory(prefix="framerunner-class-") as name:
        async with monitor(Path(name)) as url, chromium() as browser:
            await asyncio.gather(
                *(take_part(browser, url, number, pupils, lessons, seen) for number in range(pupils))
            )
        _check_files(Path(name, "missions"), pupils)
    return seen


def main() -> None:
    """Hold a class and print what it took."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--pupils", type=int, default=20)
    parser.add_argument("--lessons", type=int, default=3)
    given = parser.parse_args()
    seen = asyncio.run(hold_class(given.pupils, given.lessons))
    for lesson, took_s in sorted(seen.checks_s.items()):
        times = f"{statistics.median(took_s):.1f} s median, {max(took_s):.1f} s longest"
        print(f"lesson {lesson}: {len(took_s)} checks passed, {times}")
    print(f"longest line: place {seen.longest_line}; nobody was refused, and changed what is another's")


if __name__ == "__main__":
    main()
