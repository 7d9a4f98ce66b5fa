"""Camera sources against real servers, honest and hostile, folders and files."""

import asyncio
import os
import random
import struct
import time
import zlib
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from pathlib import Path
from typing import cast

import cv2
import numpy as np
import pytest
from aiohttp import web

from scenarios.models import Camera
from sitl.streaming.h264 import RtpSender
from tests.free_ports import free_port
from vision.sources import CaptureSource, FolderSource, open_source
from vision.streams.http_source import HttpSource, Latest
from vision.streams.reconnecting import ReconnectingSource
from vision.types import CameraError, CameraFrame, Image, shown_url

MULTIPART = {"Content-Type": "multipart/x-mixed-replace; boundary=cut"}
Write = Callable[[bytes], Awaitable[None]]


def picture(value: int = 0) -> Image:
    return np.full((48, 64, 3), value, np.uint8)


def jpeg(value: int = 0) -> bytes:
    return bytes(cv2.imencode(".jpg", picture(value))[1])


def part(data: bytes, head: str = "") -> bytes:
    return f"--cut\r\nContent-Length: {len(data)}\r\n{head}\r\n".encode() + data + b"\r\n"


@asynccontextmanager
async def streaming(send: Callable[[Write], Awaitable[None]], **headers: str) -> AsyncIterator[str]:
    """Serve what `send` writes; gives the URL."""

    async def handler(request: web.Request) -> web.StreamResponse:
        response = web.StreamResponse(headers=MULTIPART | headers)
        await response.prepare(request)
        with suppress(ConnectionError):
            await send(response.write)
        return response

    async with serving(handler) as url:
        yield url


@asynccontextmanager
async def serving(handler: Callable[[web.Request], Awaitable[web.StreamResponse]]) -> AsyncIterator[str]:
    app = web.Application()
    app.router.add_get("/video", handler)
    runner = web.AppRunner(app, access_log=None, shutdown_timeout=0.1)
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", 0).start()
    try:
        yield f"http://127.0.0.1:{runner.addresses[0][1]}/video"
    finally:
        await runner.cleanup()


async def take(source: HttpSource | CaptureSource | FolderSource, count: int) -> list[CameraFrame]:
    taken = []
    async with source:
        async for frame in source.frames():
            taken.append(frame)
            if len(taken) == count:
                break
    return taken


async def failure(source: HttpSource | CaptureSource | FolderSource) -> str:
    """Take images until the source fails; gives the message, which must be one line."""
    with pytest.raises(CameraError) as failed:
        await take(source, 1_000_000)
    assert "\n" not in str(failed.value)
    return str(failed.value)


async def test_images_with_and_without_times() -> None:
    async def send(write: Write) -> None:
        for i in range(1000):
            await write(part(jpeg(40), f"X-Time-Us: {1000 * i}\r\n" if i % 2 else ""))
            await asyncio.sleep(0.01)

    async with streaming(send) as url:
        frames = await take(HttpSource(url), 6)
    assert {frame.time_us is None for frame in frames} == {True, False}
    times = [frame.time_us for frame in frames if frame.time_us is not None]
    assert times == sorted(set(times))
    assert all(
        frame.image.shape == (48, 64, 3) and abs(int(frame.image[0, 0, 0]) - 40) < 3 for frame in frames
    )
    assert all(frame.jpeg == jpeg(40) for frame in frames)
    arrivals = [frame.received_s for frame in frames]
    assert arrivals == sorted(arrivals)


async def test_a_slow_consumer_gets_the_latest_image() -> None:
    done = asyncio.Event()

    async def send(write: Write) -> None:
        for i in range(200):
            await write(part(jpeg(i), f"X-Time-Us: {i}\r\n"))
            await asyncio.sleep(0)
        done.set()
        await asyncio.sleep(60)

    async with streaming(send) as url, HttpSource(url) as source:
        frames = source.frames()
        await anext(frames)
        await done.wait()
        await asyncio.sleep(0.1)
        assert (await anext(frames)).time_us == 199
        await frames.aclose()


async def test_garbage_is_skipped_and_counted() -> None:
    bomb = jpeg().replace(b"\x00\x30\x00\x40", b"\xff\xff\xff\xff")
    assert bomb != jpeg()
    bad = [
        b"garbage",
        b"\xff\xd8\xff\xe0" + b"x" * 50,
        jpeg()[: len(jpeg()) // 2],
        bomb,
        b"\x89PNG\r\n\x1a\n",
    ]
    taken = asyncio.Event()

    async def send(write: Write) -> None:
        for data in bad:
            await write(part(data))
            await asyncio.sleep(0.03)
        await write(part(jpeg(7)))
        await taken.wait()

    async with streaming(send) as url:
        source = HttpSource(url)
        assert len(await take(source, 1)) == 1
        taken.set()
    assert source.bad_frames == len(bad)


async def test_only_garbage_is_no_image() -> None:
    async def send(write: Write) -> None:
        while True:
            await write(part(b"garbage"))
            await asyncio.sleep(0.01)

    async with streaming(send) as url:
        message = await failure(HttpSource(url, timeout_s=0.3))
    assert "no image for 0.3 s" in message
    assert "images were skipped; the last one is not a JPEG" in message
    assert url in message


async def test_images_of_another_size_than_the_camera_has_are_skipped() -> None:
    async def send(write: Write) -> None:
        while True:
            await write(part(bytes(cv2.imencode(".jpg", np.zeros((48, 80, 3), np.uint8))[1])))
            await asyncio.sleep(0.01)

    async with streaming(send) as url:
        message = await failure(open_source(url, timeout_s=0.3, size_px=(64, 48)))
    assert "the last one is of 80 x 48 pixels; the camera has 64 x 48" in message


async def test_a_progressive_jpeg_is_decoded_in_another_process_and_kept_as_it_came() -> None:
    data = bytes(cv2.imencode(".jpg", picture(7), [cv2.IMWRITE_JPEG_PROGRESSIVE, 1])[1])

    async def send(write: Write) -> None:
        for i in range(1000):
            await write(part(data, f"X-Time-Us: {i}\r\n"))
            await asyncio.sleep(0.01)

    async with streaming(send) as url:
        frames = await take(HttpSource(url), 3)
    assert all(
        np.array_equal(frame.image, cv2.imdecode(np.frombuffer(data, np.uint8), 1)) for frame in frames
    )
    assert all(frame.jpeg == data for frame in frames)
    assert len({frame.time_us for frame in frames}) == 3


async def test_a_flood_of_parts_breaks_the_stream() -> None:
    async def send(write: Write) -> None:
        while True:
            await write(b"--cut\r\n\r\nx" * 1000)
            await asyncio.sleep(0)

    async with streaming(send) as url:
        assert "more than 1000 images a second" in await failure(HttpSource(url))


async def test_silence_is_no_image() -> None:
    async def send(write: Write) -> None:
        await write(part(jpeg()))
        await asyncio.sleep(60)

    async with streaming(send) as url:
        assert await failure(HttpSource(url, timeout_s=0.2)) == f"camera {url}: no image for 0.2 s"


async def test_no_answer() -> None:
    async def handler(request: web.Request) -> web.Response:
        await asyncio.sleep(60)
        return web.Response()

    async with serving(handler) as url:
        assert await failure(HttpSource(url, timeout_s=0.2)) == f"camera {url}: no answer within 0.2 s"


async def test_the_stream_ends_after_its_last_image() -> None:
    async def send(write: Write) -> None:
        await write(part(jpeg()))

    async with streaming(send) as url, HttpSource(url) as source:
        frames = source.frames()
        assert (await anext(frames)).image.shape == (48, 64, 3)
        with pytest.raises(CameraError, match="the stream ended"):
            await anext(frames)


async def test_too_large_a_part_breaks_the_stream() -> None:
    async def send(write: Write) -> None:
        await write(b"--cut\r\nContent-Length: 9000000\r\n\r\n")
        await asyncio.sleep(60)

    async with streaming(send) as url:
        message = await failure(HttpSource(url))
    assert "a part of 9000000 bytes is refused; the limit is 8388608" in message


async def test_endless_bytes_without_boundary_stop_in_time() -> None:
    async def send(write: Write) -> None:
        while True:
            await write(b"\xff" * 10_000)
            await asyncio.sleep(0)

    async with streaming(send) as url:
        assert "no image for 0.3 s" in await failure(HttpSource(url, timeout_s=0.3))


async def test_a_compressed_stream_is_not_unpacked() -> None:
    async def send(write: Write) -> None:
        await write(b"\x1f\x8b" + b"\x00" * 1000)

    async with streaming(send, **{"Content-Encoding": "gzip"}) as url:
        assert "the stream ended" in await failure(HttpSource(url))


async def test_a_page_is_not_a_stream() -> None:
    async def handler(request: web.Request) -> web.Response:
        return web.Response(text="hello")

    async with serving(handler) as url:
        message = await failure(HttpSource(url))
    assert message.startswith(f"camera {url}: not an MJPEG stream: Content-Type is 'text/plain")


async def test_not_found() -> None:
    async def handler(request: web.Request) -> web.Response:
        return web.Response()

    async with serving(handler) as url:
        assert await failure(HttpSource(url + "x")) == f"camera {url}x: HTTP 404 Not Found"


async def test_endless_redirects() -> None:
    async def handler(request: web.Request) -> web.Response:
        raise web.HTTPFound("/video")

    async with serving(handler) as url:
        assert (await failure(HttpSource(url))).startswith(f"camera {url}: ")


async def test_refused_connection_and_unknown_host() -> None:
    server = await asyncio.start_server(lambda reader, writer: None, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    server.close()
    await server.wait_closed()
    url = f"http://127.0.0.1:{port}/video"
    assert await failure(HttpSource(url)) == f"camera {url}: cannot connect: connection refused"
    assert "camera http://no.such.invalid/" in await failure(HttpSource("http://no.such.invalid/"))
    assert "not a valid URL" in await failure(HttpSource("http://:x/"))


@pytest.mark.parametrize(
    "answer",
    [
        b"",
        b"\x00\xff" * 1000 + b"\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nX: " + b"x" * 100_000 + b"\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x; boundary=\xff\xfe\x00\r\n\r\n--x",
        b"HTTP/1.1 200 \x1b[31mred\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nContent-Length: -5\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n"
        b"Content-Type: multipart/x; boundary=a\r\n\r\nzz\r\n",
    ],
)
async def test_hostile_answers_are_one_line(answer: bytes) -> None:
    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.write(answer)
        await writer.drain()
        writer.close()

    server = await asyncio.start_server(talk, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    async with server:
        message = await failure(HttpSource(f"http://127.0.0.1:{port}/", 1.0))
    assert message.isprintable()


async def test_leaving_early_leaves_nothing_running() -> None:
    async def send(write: Write) -> None:
        while True:
            await write(part(jpeg()))
            await asyncio.sleep(0.005)

    async with streaming(send) as url:
        before = asyncio.all_tasks()
        async with HttpSource(url) as source:
            await anext(source.frames())
        left = {task.get_name() for task in asyncio.all_tasks() - before}
        assert not any(name.startswith("camera") for name in left)


async def test_folder_in_order_with_times_and_bad_files(tmp_path: Path) -> None:
    for name, value in (("b_0000002000us", 2), ("a_0000001000us", 1), ("c", 3)):
        cv2.imwrite(str(tmp_path / f"{name}.png"), picture(value))
    (tmp_path / "bad.png").write_bytes(b"not an image")
    (tmp_path / "huge.png").write_bytes(png_of(60_000, 60_000))
    os.mkfifo(tmp_path / "pipe.png")
    (tmp_path / "notes.txt").write_text("not an image either")
    source = open_source(tmp_path)
    async with source:
        frames = [frame async for frame in source.frames()]
    assert [int(frame.image[0, 0, 0]) for frame in frames] == [1, 2, 3]
    assert [frame.time_us for frame in frames] == [1000, 2000, None]
    assert source.bad_frames == 3


def png_of(width: int, height: int) -> bytes:
    """The head of a PNG that claims a size."""
    head = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + head + struct.pack(">I", zlib.crc32(head))


async def test_folder_without_images(tmp_path: Path) -> None:
    assert "no images in this folder" in await failure(FolderSource(tmp_path))
    assert "no such file" in await failure(FolderSource(tmp_path / "gone"))


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 10.0, (64, 48))
    for i in range(10):
        writer.write(picture(20 * i))
    writer.release()
    return path


async def test_file_plays_to_its_end(clip: Path) -> None:
    """At its own speed: 0.9 s. A busy machine may miss images, but not the last one."""
    async with open_source(str(clip)) as source:
        frames = [frame async for frame in source.frames()]
    numbers = [round(int(frame.image[0, 0, 0]) / 20) for frame in frames]
    assert numbers == sorted(set(numbers)) and numbers[-1] == 9
    assert frames[-1].received_s - frames[0].received_s > 0.15
    assert all(frame.time_us is None for frame in frames)


async def test_file_that_is_no_video(tmp_path: Path) -> None:
    path = tmp_path / "text.mp4"
    path.write_text("hello")
    assert "cannot be opened" in await failure(CaptureSource(str(path)))


async def test_a_camera_that_says_nothing_is_not_waited_for() -> None:
    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.read()

    server = await asyncio.start_server(talk, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    source = CaptureSource(f"http://127.0.0.1:{port}/live.mp4", 1.0)
    async with server:
        assert await failure(source) == f"camera http://127.0.0.1:{port}/live.mp4: did not open within 1 s"


async def test_opencv_reads_a_stream_and_notices_its_end() -> None:
    async def send(write: Write) -> None:
        for i in range(30):
            await write(part(jpeg(i)))
            await asyncio.sleep(0.005)

    async with streaming(send) as url:
        assert "the stream ended" in await failure(CaptureSource(url))


def test_open_source_chooses(tmp_path: Path, clip: Path) -> None:
    assert isinstance(open_source("http://127.0.0.1:8100/video"), HttpSource)
    assert isinstance(open_source("http://127.0.0.1/film.mp4"), CaptureSource)
    assert isinstance(open_source("rtsp://127.0.0.1/live"), CaptureSource)
    assert isinstance(open_source("rtsp://127.0.0.1/live", reconnects=True), ReconnectingSource)
    assert isinstance(open_source("udp://127.0.0.1:5600"), CaptureSource)
    assert isinstance(open_source("rtp://0.0.0.0:5600", reconnects=True), CaptureSource)
    for wrong in ("rtp://0.0.0.0", "rtp://0.0.0.0:x", "rtp://a:5600\nm=audio"):
        with pytest.raises(CameraError, match="write rtp://HOST:PORT"):
            open_source(wrong)
    assert isinstance(open_source("0", reconnects=True), CaptureSource)
    assert isinstance(open_source(2), CaptureSource)
    assert isinstance(open_source(tmp_path), FolderSource)
    assert isinstance(open_source(clip), CaptureSource)


@pytest.mark.parametrize("text", ["", "gone.mp4", "no/such/folder", "a\0b", "a\nb", "x" * 5000])
def test_open_source_says_what_it_cannot_find(text: str) -> None:
    with pytest.raises(CameraError, match="no such file, folder, device or URL") as refused:
        open_source(text)
    assert "\n" not in str(refused.value)


def test_a_password_is_never_shown() -> None:
    assert shown_url("rtsp://me:secret@host/x") == "rtsp://me:***@host/x"
    assert shown_url("http://host/\r\nevil") == "http://host/\\r\\nevil"
    assert shown_url("http://[broken") == "http://[broken"


async def test_latest_keeps_one_item_and_ends() -> None:
    latest: Latest[int] = Latest()
    latest.put(1)
    latest.put(2)
    assert await latest.get() == 2
    waiting = asyncio.create_task(latest.get())
    await asyncio.sleep(0)
    latest.put(3)
    assert await waiting == 3
    latest.put(4)
    latest.end(CameraError("gone"))
    assert await latest.get() == 4
    with pytest.raises(CameraError, match="gone"):
        await latest.get()


@asynccontextmanager
async def sending_rtp(port: int) -> AsyncIterator[None]:
    sender = RtpSender(("127.0.0.1", port), Camera())

    async def send() -> None:
        for number in range(10**6):
            sender.send(np.full((240, 320, 3), number % 25 * 10, np.uint8), time.monotonic_ns() // 1000)
            await asyncio.sleep(0.05)

    sending = asyncio.create_task(send())
    try:
        yield
    finally:
        sending.cancel()
        await asyncio.to_thread(sender.close)


async def test_h264_over_rtp_is_received() -> None:
    port = free_port()
    async with sending_rtp(port):
        frames = await take(CaptureSource(f"rtp://127.0.0.1:{port}", 8.0), 12)
    assert {frame.image.shape for frame in frames} == {(240, 320, 3)}
    times_s = [frame.received_s for frame in frames]
    assert times_s == sorted(times_s)
    assert all(0.0 <= time.monotonic() - at_s < 5.0 for at_s in times_s)


class Renumbering(asyncio.DatagramProtocol):
    """Passes RTP packets on, with sequence numbers that count from a start."""

    def __init__(self, port: int, number: int) -> None:
        self._port, self.number = port, number

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.DatagramTransport, transport)

    def datagram_received(self, data: bytes, addr: object) -> None:
        self.pass_on(data[:2], data[4:])

    def pass_on(self, kind: bytes, rest: bytes) -> None:
        self._transport.sendto(kind + struct.pack(">H", self.number) + rest, ("127.0.0.1", self._port))
        self.number += 1


async def test_rtp_outlives_foreign_packets_and_a_restart_of_its_sender() -> None:
    sent_to, _, port = free_port(), free_port(), free_port()  # RTP uses the next port, too
    loop, source = asyncio.get_running_loop(), CaptureSource(f"rtp://127.0.0.1:{port}", 8.0)
    relay = Renumbering(port, 10_000)
    async with AsyncExitStack() as stack:
        transport, _ = await loop.create_datagram_endpoint(lambda: relay, local_addr=("127.0.0.1", sent_to))
        stack.callback(transport.close)
        async with sending_rtp(sent_to):
            await stack.enter_async_context(source)
            frames = source.frames()
            first = await anext(frames)
        noise = random.Random(1)
        for _ in range(200):
            relay.pass_on(b"\x80\xe0", noise.randbytes(700))
            await asyncio.sleep(0.002)
        relay.number, stopped_s = 5_000, time.monotonic()  # of a new sender, before those of the last one
        async with sending_rtp(sent_to):
            while (again := await anext(frames)).received_s <= stopped_s + 0.2:
                pass
    assert again.image.shape == first.image.shape


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("401 Unauthorized", "user name or password is missing or wrong"),
        ("404 Not Found", "the server has no such stream"),
        ("500 Internal Server Error", "cannot be opened"),
    ],
)
async def test_why_an_rtsp_camera_does_not_open(answer: str, words: str) -> None:
    async def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(asyncio.IncompleteReadError, ConnectionError):
            while request := (await reader.readuntil(b"\r\n\r\n")).decode():
                number = request.partition("CSeq: ")[2].split()[0]
                status = "200 OK" if request.startswith("OPTIONS") else answer
                login = 'WWW-Authenticate: Basic realm="x"'
                writer.write(f"RTSP/1.0 {status}\r\nCSeq: {number}\r\n{login}\r\n\r\n".encode())
        writer.close()

    server = await asyncio.start_server(talk, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    async with server:
        message = await failure(CaptureSource(f"rtsp://me:secret@127.0.0.1:{port}/live", 5.0))
    assert words in message and "secret" not in message


async def test_nothing_listens_or_the_address_is_another_machines() -> None:
    assert "connection refused" in await failure(CaptureSource(f"tcp://127.0.0.1:{free_port()}"))
    assert "no address of this machine" in await failure(CaptureSource("udp://192.0.2.1:5600"))
    assert "ls /dev/video*" in await failure(CaptureSource(999))
