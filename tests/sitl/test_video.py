"""The video server: what clients, browsers and cv2 receive from it."""

import asyncio
import json
import re
import subprocess
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from math import inf, nan, pi

import aiohttp
import cv2
import numpy as np
import pytest

from scenarios.models import Base, Gate, Scenario
from sitl.camera import SimulatedCamera
from sitl.video import Image, VideoError, VideoServer, encode_jpeg
from vision.detector import detect


def sample(value: int = 0) -> Image:
    image = np.full((240, 320, 3), 128, np.uint8)
    image[100:120, 100:140] = (0, 0, 200)
    image[0:16, 0:16] = value % 256
    return image


@asynccontextmanager
async def serving() -> AsyncIterator[VideoServer]:
    server = VideoServer(port=0)
    await server.start()
    try:
        yield server
    finally:
        await server.close()


@asynccontextmanager
async def publishing(server: VideoServer, period_s: float = 0.02) -> AsyncIterator[None]:
    async def publish() -> None:
        for i in range(100_000):
            server.publish(sample(i), 1000 * i)
            await asyncio.sleep(period_s)

    task = asyncio.create_task(publish())
    try:
        yield
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


async def get(url: str) -> tuple[int, bytes, dict[str, str]]:
    async with aiohttp.ClientSession() as session, session.get(url) as response:
        return response.status, await response.read(), dict(response.headers)


async def test_stream_has_images_with_vehicle_times() -> None:
    async with serving() as server, publishing(server), aiohttp.ClientSession() as session:
        async with session.get(server.url + "video") as response:
            assert response.content_type == "multipart/x-mixed-replace"
            reader = aiohttp.MultipartReader.from_response(response)
            times = []
            for _ in range(5):
                part = await reader.next()
                data = await part.read()
                assert part.headers["Content-Type"] == "image/jpeg"
                assert int(part.headers["Content-Length"]) == len(data)
                times.append(int(part.headers["X-Time-Us"]))
                image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
                assert image.shape == (240, 320, 3)
                assert abs(int(image[8, 8, 0]) - times[-1] // 1000 % 256) < 8
        assert times == sorted(set(times))


async def test_latest_image_page_and_unknown_path() -> None:
    async with serving() as server:
        status, text, _ = await get(server.url + "image.jpg")
        assert (status, text) == (503, b"no image yet\n")
        server.publish(sample(), 1)
        server.publish(sample(), 123_456)
        status, data, headers = await get(server.url + "image.jpg")
        assert status == 200
        assert headers["X-Time-Us"] == "123456"
        assert data == encode_jpeg(sample())
        status, page, headers = await get(server.url)
        assert (status, headers["Content-Type"]) == (200, "text/html; charset=utf-8")
        assert b'src="/video"' in page
        status, text, _ = await get(server.url + "nothing")
        assert status == 404
        assert b"/video" in text


async def test_json_documents() -> None:
    async with serving() as server:
        server.add_json(
            "/referee.json", lambda query: {"state": query.get("state", ""), "d": [inf, 1.5, nan]}
        )
        server.add_json("/broken.json", lambda query: {"set": {1}})
        server.add_json("/failing.json", lambda query: 1 / 0)
        status, data, headers = await get(server.url + "referee.json?state=Red")
        assert (status, headers["Content-Type"]) == (200, "application/json; charset=utf-8")
        assert json.loads(data) == {"state": "Red", "d": [None, 1.5, None]}
        for path in ("broken.json", "failing.json"):
            status, data, _ = await get(server.url + path)
            assert status == 500
            assert data.count(b"\n") == 1


async def test_an_image_is_compressed_once_and_only_if_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    monkeypatch.setattr("sitl.video.encode_jpeg", lambda image: calls.append(1) or encode_jpeg(image))
    async with serving() as server:
        for i in range(20):
            server.publish(sample(i), i)
        assert calls == []
        await asyncio.gather(*(get(server.url + "image.jpg") for _ in range(4)))
        assert calls == [1]


async def test_a_slow_client_receives_the_latest_image_not_a_backlog() -> None:
    noise = np.random.default_rng(0).integers(0, 255, (240, 320, 3)).astype(np.uint8)
    async with serving() as server:
        server.publish(noise, 0)
        reader, writer = await asyncio.open_connection("127.0.0.1", server.port, limit=1 << 16)
        writer.write(b"GET /video HTTP/1.1\r\nHost: x\r\n\r\n")
        await reader.readuntil(b"X-Time-Us: 0\r\n")
        for i in range(1, 301):  # 300 images of 130 kB while the client does not read
            server.publish(noise, i)
            await asyncio.sleep(0.001)
        received = b""
        while b"X-Time-Us: 300\r\n" not in received:
            received += await asyncio.wait_for(reader.read(1 << 16), 5)
        writer.close()
        times = [int(text) for text in re.findall(rb"X-Time-Us: (\d+)", received)]
        assert times[-1] == 300
        assert len(times) < 60


async def test_clients_connect_and_disconnect_quietly(caplog: pytest.LogCaptureFixture) -> None:
    async with serving() as server, publishing(server, 0.001):
        for cut in (0, 10, 5000, 50000):
            reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
            writer.write(b"GET /video HTTP/1.1\r\nHost: x\r\n\r\n")
            if cut:
                await reader.readexactly(cut)
            writer.transport.abort()
        reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
        writer.write(b"GET / HTTP/1.1\r\n\r\n")  # without the host, which HTTP/1.1 demands
        assert (await reader.readline()).split()[1] == b"400"
        writer.close()
        status, _, _ = await get(server.url + "image.jpg")
        assert status == 200
    assert [record.message for record in caplog.records if record.levelname != "DEBUG"] == []


async def test_close_ends_open_streams() -> None:
    server = VideoServer(port=0)
    await server.start()
    server.publish(sample(), 1)
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    writer.write(b"GET /video HTTP/1.1\r\nHost: x\r\n\r\n")
    await reader.readuntil(b"X-Time-Us")
    await asyncio.wait_for(server.close(), 0.9)
    await asyncio.wait_for(reader.read(), 1)
    writer.close()
    server.publish(sample(), 2)  # is ignored


async def test_a_busy_port_is_one_line() -> None:
    async with serving() as server:
        with pytest.raises(VideoError) as refused:
            await VideoServer(port=server.port, options="--instance").start()
    assert str(refused.value) == (
        f"video: cannot listen on 127.0.0.1 port {server.port}: address already in use; "
        "choose another with --instance"
    )


@pytest.mark.parametrize(("host", "port"), [("203.0.113.7", 0), ("127.0.0.1", 70000), ("no.such.invalid", 0)])
async def test_an_impossible_address_is_one_line(host: str, port: int) -> None:
    with pytest.raises(VideoError, match="cannot listen") as refused:
        await VideoServer(host, port).start()
    assert "\n" not in str(refused.value)


async def test_publishing_from_another_thread_and_before_start() -> None:
    server = VideoServer(port=0)
    server.publish(sample(), 7)
    await server.start()
    try:
        async with aiohttp.ClientSession() as session, session.get(server.url + "video") as response:
            await response.content.readuntil(b"X-Time-Us: 7\r\n")
            await asyncio.to_thread(server.publish, sample(), 8)
            await asyncio.wait_for(response.content.readuntil(b"X-Time-Us: 8\r\n"), 2)
    finally:
        await server.close()


async def test_cv2_can_watch() -> None:
    code = (
        "import cv2, sys\n"
        "capture = cv2.VideoCapture(sys.argv[1])\n"
        "assert capture.isOpened()\n"
        "images = [capture.read() for _ in range(5)]\n"
        "assert all(done and image.shape == (240, 320, 3) for done, image in images)\n"
        "assert images[0][1][110, 120, 2] > 180 and images[0][1][110, 120, 1] < 30\n"
    )
    async with serving() as server, publishing(server):
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-c", code, server.url + "video", stderr=subprocess.PIPE
        )
        _, errors = await asyncio.wait_for(process.communicate(), 30)
        assert process.returncode == 0, errors.decode()


def test_importing_the_module_does_not_import_the_http_library() -> None:
    code = "import sys, sitl.video; sys.exit('aiohttp' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_compression_keeps_thin_bars_detectable() -> None:
    gates = [
        Gate(colour="red", x_m=0, y_m=0.6, z_m=1.3),
        Gate(colour="green", x_m=0, y_m=0, z_m=1, yaw_rad=0.3),
        Gate(colour="blue", x_m=0, y_m=-0.6, z_m=0.7, yaw_rad=pi),
    ]
    camera = SimulatedCamera(Scenario(name="bars", frames=tuple(gates), base=Base(x_m=4, y_m=4)))
    for distance in (1.0, 2.0, 3.0, 4.0):
        image = camera.render((-distance, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0))
        decoded = cv2.imdecode(np.frombuffer(encode_jpeg(image), np.uint8), cv2.IMREAD_COLOR)
        raw, seen = detect(image), detect(decoded)
        for colour in ("red", "green", "blue"):
            before, after = getattr(raw, colour), getattr(seen, colour)
            assert before.seen
            for edge in "nsew":
                assert abs(getattr(before, edge) - getattr(after, edge)) <= 1, (distance, colour, edge)
