import asyncio
import contextlib
import struct

import pytest
from aiohttp import web

from framerunner.monitor.video_proxy import MAX_IMAGE_BYTES, can_be_forwarded
from tests.framerunner.monitor.serving import browser, serving

JPEG = b"\xff\xd8\xff\xe0 an image \xff\xd9"


def part(number, body=JPEG, head=""):
    text = f"--x\r\nContent-Type: image/jpeg\r\nX-Time-Us: {number}\r\n{head}\r\n"
    return text.encode() + body + b"\r\n"


def test_only_http_is_forwarded():
    assert can_be_forwarded("http://127.0.0.1:8100/video")
    for url in (
        None,
        "",
        "rtsp://a/b",
        "5600",
        "udp://0.0.0.0:5600",
        "file:///etc/passwd",
        "http://[",
        "http://",
    ):
        assert not can_be_forwarded(url)


class Camera:
    """A drone's video: numbered images, one for each `show`."""

    def __init__(self):
        self.connections = 0
        self.now = 0
        self.number = 0
        self.is_broken = self.hold = False
        self.first = b""  # written before all images
        self.changed = asyncio.Event()

    def show(self):
        self.number += 1
        self.changed.set()
        self.changed.clear()

    async def video(self, request):
        response = web.StreamResponse(headers={"Content-Type": "multipart/x-mixed-replace; boundary=x"})
        await response.prepare(request)
        self.connections += 1
        self.now += 1
        try:
            await response.write(self.first)
            while True:
                if self.hold:
                    await asyncio.Event().wait()
                await response.write(part(self.number, head=f"Content-Length: {len(JPEG)}\r\n"))
                await self.changed.wait()
                if self.is_broken:
                    self.is_broken = False
                    return response
        finally:
            self.now -= 1

    async def elsewhere(self, request):
        raise web.HTTPFound("/video")


@contextlib.asynccontextmanager
async def camera():
    source = Camera()
    app = web.Application()
    app.router.add_get("/video", source.video)
    app.router.add_get("/moved", source.elsewhere)
    runner = web.AppRunner(app, shutdown_timeout=0.1)
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0)
    await site.start()
    source.url = f"http://127.0.0.1:{runner.addresses[0][1]}/video"
    try:
        yield source
    finally:
        await runner.cleanup()


async def reached(condition):
    async with asyncio.timeout(15):
        while not condition():  # noqa: ASYNC110 - it is another program's doing
            await asyncio.sleep(0.02)


async def next_number(answer):
    async with asyncio.timeout(15):
        while not (line := await answer.content.readline()).startswith(b"X-Time-Us:"):
            assert line, "the stream ended"
    return int(line.partition(b":")[2])


async def test_many_viewers_share_one_connection_that_ends_with_the_last(monkeypatch):
    async with camera() as source, serving(monkeypatch) as served, browser() as client:
        served.fleet.video = source.url
        answers = [await client.get(served.url + "video/1") for _ in range(3)]
        assert answers[0].headers["Content-Type"].startswith("multipart/x-mixed-replace")
        for answer in answers:
            assert await next_number(answer) == 0
        source.show()
        for answer in answers:
            assert await next_number(answer) == 1
        assert source.connections == 1
        for answer in answers:
            answer.close()
        await reached(lambda: source.now == 0 or source.show())


async def test_a_single_image_is_served(monkeypatch):
    async with camera() as source, serving(monkeypatch) as served, browser() as client:
        served.fleet.video = source.url
        source.number = 7
        async with client.get(served.url + "video/1/image.jpg") as answer:
            assert await answer.read() == JPEG
            assert answer.headers["Content-Type"] == "image/jpeg"
            assert answer.headers["X-Time-Us"] == "7"
            assert answer.headers["X-Content-Type-Options"] == "nosniff"


EVIL = b"<script>alert(1)</script>"


@pytest.mark.parametrize("head", ["", f"Content-Length: {len(EVIL)}\r\n"])
async def test_only_jpegs_are_forwarded(monkeypatch, head):
    async with camera() as source, serving(monkeypatch) as served, browser() as client:
        served.fleet.video = source.url
        source.first = part(1, EVIL, head)
        source.number = 2
        async with client.get(served.url + "video/1/image.jpg") as answer:
            assert (await answer.read(), answer.headers["X-Time-Us"]) == (JPEG, "2")


async def test_an_image_that_is_too_large_ends_the_connection(monkeypatch):
    monkeypatch.setattr("framerunner.monitor.video_proxy.FIRST_IMAGE_S", 0.5)
    async with camera() as source, serving(monkeypatch) as served, browser() as client:
        served.fleet.video = source.url
        source.first = part(1, head=f"Content-Length: {MAX_IMAGE_BYTES + 1}\r\n")
        async with client.get(served.url + "video/1/image.jpg") as answer:
            assert answer.status == 503
        await reached(lambda: source.now == 0 or source.show())


async def next_frame(answer):
    async with asyncio.timeout(15):
        time_us, length = struct.unpack("<qI", await answer.content.readexactly(12))
        return time_us, await answer.content.readexactly(length)


async def test_frames_have_their_time_and_a_late_viewer_gets_the_last_one_at_once(monkeypatch):
    async with camera() as source, serving(monkeypatch) as served, browser() as client:
        served.fleet.video = source.url
        source.number = 7
        async with client.get(served.url + "video/1/frames") as answer:
            assert await next_frame(answer) == (7, JPEG)
            source.show()
            assert await next_frame(answer) == (8, JPEG)
        await reached(lambda: source.now == 0 or source.show())
        last = source.number
        source.hold = True  # the flight is over: no new images
        async with client.get(served.url + "video/1/frames") as answer:
            time_us, jpeg = await next_frame(answer)
            assert 8 <= time_us <= last
            assert jpeg == JPEG


async def test_the_connection_is_made_again_after_a_failure(monkeypatch):
    monkeypatch.setattr("framerunner.monitor.video_proxy._RETRY_S", 0.05)
    async with camera() as source, serving(monkeypatch) as served, browser() as client:
        served.fleet.video = source.url
        answer = await client.get(served.url + "video/1")
        assert await next_number(answer) == 0
        source.is_broken = True
        source.number = 40
        source.show()  # as the last one of this connection
        await reached(lambda: source.connections == 2)
        assert await next_number(answer) == 41
        answer.close()


@pytest.mark.parametrize(
    ("path", "video", "status", "words"),
    [
        ("2", None, 404, "no drone 2"),
        ("1", None, 404, "has no video"),
        ("1", "rtsp://10.0.0.1/live", 404, "is rtsp; only MJPEG over http"),
        ("1", "5600", 404, "only MJPEG over http"),
    ],
)
async def test_the_reason_is_told_when_there_is_no_video(monkeypatch, path, video, status, words):
    async with serving(monkeypatch) as served, browser() as client:
        served.fleet.video = video
        async with client.get(served.url + f"video/{path}") as answer:
            assert answer.status == status
            assert words in await answer.text()


async def test_a_redirection_is_not_followed(monkeypatch):
    monkeypatch.setattr("framerunner.monitor.video_proxy.FIRST_IMAGE_S", 0.5)
    async with camera() as source, serving(monkeypatch) as served, browser() as client:
        served.fleet.video = source.url.replace("/video", "/moved")
        async with client.get(served.url + "video/1/image.jpg") as answer:
            assert answer.status == 503
        assert source.connections == 0
