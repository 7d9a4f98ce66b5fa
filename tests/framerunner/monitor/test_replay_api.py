"""Recorded flights over HTTP: whole, compressed, read once; 404 with one line for others."""

import asyncio
import gzip
import threading

import pytest

from tests.framerunner.monitor.replay_runs import MARKUP, Library, a_run, serving_runs
from tests.framerunner.monitor.serving import browser


async def test_the_list_and_a_run_are_json(monkeypatch):
    library = Library(a_run(), a_run(MARKUP))
    async with serving_runs(monkeypatch, library) as served, browser() as client:
        async with client.get(f"{served.url}api/runs") as answer:
            assert answer.status == 200
            listed = await answer.json()
        assert [each["name"] for each in listed] == ["first", MARKUP]
        assert listed[0] == {
            "name": "first",
            "scenario": "test-case-1",
            "mission": "frame_challenge",
            "verdict": "clean",
            "total_time_s": 39.0,
            "started": "2026-01-02T03:04:05+00:00",
            "session": False,
        }
        async with client.get(f"{served.url}api/runs/first") as answer:
            assert answer.headers["Content-Type"] == "application/json"
            assert await answer.json() == a_run()
        async with client.get(f"{served.url}api/runs/first/result.json") as answer:
            assert await answer.json() == a_run()["result"]


async def test_answers_are_compressed_for_clients_that_accept_it(monkeypatch):
    async with serving_runs(monkeypatch, Library(a_run())) as served, browser() as client:
        sizes = {}
        for coding in ("gzip", "identity"):
            headers = {"Accept-Encoding": coding}
            async with client.get(f"{served.url}api/runs/first", headers=headers) as answer:
                sizes[coding] = int(answer.headers["Content-Length"])
                assert answer.headers.get("Content-Encoding", "identity") == coding
                assert (await answer.json())["name"] == "first"
        assert sizes["gzip"] < sizes["identity"] / 3


async def test_an_unchanged_answer_is_not_sent_again(monkeypatch):
    library = Library(a_run())
    packed = []
    compress = gzip.compress
    monkeypatch.setattr(gzip, "compress", lambda *a, **more: packed.append(a) or compress(*a, **more))
    async with serving_runs(monkeypatch, library) as served, browser() as client:
        url = f"{served.url}api/runs/first"
        async with client.get(url) as answer:
            tag = answer.headers["ETag"]
        async with client.get(url, headers={"If-None-Match": tag}) as answer:
            assert answer.status == 304
            assert await answer.read() == b""
        assert len(packed) == 1
        library._runs["first"] = a_run(end_s=20.0)  # flown on meanwhile
        async with client.get(url, headers={"If-None-Match": tag}) as answer:
            assert answer.status == 200
            assert answer.headers["ETag"] != tag


async def test_images_are_jpegs(monkeypatch):
    async with serving_runs(monkeypatch, Library(a_run())) as served, browser() as client:
        answer = await client.get(f"{served.url}api/runs/first/image/7.jpg")
        assert answer.headers["Content-Type"] == "image/jpeg"
        assert (await answer.read())[:2] == b"\xff\xd8"


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("missing", "run 'missing': there is no such run"),
        ("first/image/60.jpg", "run 'first': has no image 60"),
        ("first/image/-1.jpg", "image '-1': must be a whole number"),
        ("first/image/%D9%A3.jpg", "must be a whole number"),
        ("first/image/1e400.jpg", "must be a whole number"),
        ("first/image/" + "9" * 5000 + ".jpg", "must be a whole number"),
        ("missing/image/0.jpg", "run 'missing': there is no such run"),
        ("missing/result.json", "run 'missing': there is no such run"),
        ("unjudged/result.json", "run 'unjudged': was not judged"),
    ],
)
async def test_a_missing_run_is_reported_in_one_line(monkeypatch, path, words):
    library = Library(a_run(), a_run("unjudged", result=None))
    async with serving_runs(monkeypatch, library) as served, browser() as client:
        answer = await client.get(f"{served.url}api/runs/{path}")
        assert answer.status == 404
        text = await answer.text()
        assert words in text
        assert text.count("\n") == 1
        assert answer.headers["Content-Type"].startswith("text/plain")


async def test_a_name_cannot_leave_the_folder(monkeypatch):
    library = Library(a_run())
    async with serving_runs(monkeypatch, library) as served, browser() as client:
        for path in ("..%2f..%2fetc", "%2e%2e", "first%00", "%2fetc%2fpasswd"):
            async with client.get(f"{served.url}api/runs/{path}") as answer:
                assert answer.status == 404
        assert all("first" not in name or "\0" in name for name in library.read)


async def test_without_a_library_there_is_an_empty_list_and_a_hint(monkeypatch):
    async with serving_runs(monkeypatch, None) as served, browser() as client:
        async with client.get(f"{served.url}api/runs") as answer:
            assert await answer.json() == []
        for path in ("a", "a/image/0.jpg", "a/result.json"):
            async with client.get(f"{served.url}api/runs/{path}") as answer:
                assert answer.status == 404
                assert "--runs" in await answer.text()


class SlowLibrary(Library):
    """Reads nothing before the test allows it."""

    def __init__(self, *runs):
        super().__init__(*runs)
        self.go = threading.Event()
        self.at_once = 0
        self.most_at_once = 0
        self._lock = threading.Lock()

    def recording(self, name):
        with self._lock:
            self.at_once += 1
            self.most_at_once = max(self.most_at_once, self.at_once)
        self.go.wait(20)
        with self._lock:
            self.at_once -= 1
            return super().recording(name)


async def test_two_runs_are_read_two_wait_and_more_are_refused(monkeypatch):
    names = [f"run-{number}" for number in range(5)]
    library = SlowLibrary(*(a_run(name, end_s=2.0) for name in names))
    async with serving_runs(monkeypatch, library) as served, browser() as client:

        async def status(name):
            async with client.get(f"{served.url}api/runs/{name}") as answer:
                return answer.status, answer.headers.get("Retry-After"), await answer.text()

        asked = [asyncio.create_task(status(name)) for name in names[:4] for _ in range(3)]
        async with asyncio.timeout(20):
            refused = (0, None, "")
            while refused[0] != 503:
                await asyncio.sleep(0.05)
                if library.at_once == 2:
                    refused = await asyncio.wait_for(status(names[4]), 5)
            assert refused[1:] == ("60", "4 flights are being read; try again in a minute\n")
            async with client.get(f"{served.url}api/runs") as answer:
                assert answer.status == 200  # the list does not wait for them
            library.go.set()
            assert {each[0] for each in await asyncio.gather(*asked)} == {200}
            assert (await status(names[4]))[0] == 200
    assert library.most_at_once == 2
    assert sorted(library.read) == names  # each once, for three requests
    assert library.closed
