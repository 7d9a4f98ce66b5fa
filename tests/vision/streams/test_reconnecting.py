"""A camera whose stream is lost is opened again; one that stays away fails in time."""

import asyncio
import logging
import time
from collections.abc import AsyncIterator

import numpy as np
import pytest

from tests.vision.test_sources import Write, jpeg, part, streaming
from vision.sources import CaptureSource, open_source
from vision.streams import reconnecting
from vision.streams.reconnecting import ReconnectingSource
from vision.types import CameraError, CameraFrame

NAME = "camera rtsp://fake"
SECOND = "the second source is open"
Step = CameraError | int | str  # an error, the width of an image, or what to wait for
END = CameraError(f"{NAME}: the stream ended")
REFUSED = CameraError(f"{NAME}: refused")


class FakeSource:
    """Gives what a script says of each of its openings; after the last step nothing comes any more."""

    def __init__(self, scripts: list[list[Step]], second: "FakeSource | None" = None) -> None:
        self.bad_frames, self.opened, self.closed = 0, 0, False
        self.is_open = asyncio.Event()
        self._scripts, self._second = scripts, second
        self._script: list[Step] = []

    async def __aenter__(self) -> "FakeSource":
        await self.open()
        return self

    async def __aexit__(self, *exc_info: object) -> None:
        self.closed = True

    async def open(self) -> None:
        self.opened += 1
        self._script = self._scripts.pop(0)
        if self._script == [REFUSED]:
            raise REFUSED
        self.is_open.set()

    async def frames(self) -> AsyncIterator[CameraFrame]:
        for step in self._script:
            if isinstance(step, CameraError):
                raise step
            if step == SECOND:
                await self._second.is_open.wait()
            else:
                yield CameraFrame(np.zeros((1, step, 3), np.uint8), None, 0.0)
        await asyncio.Event().wait()


def source_of(*fakes: FakeSource, timeout_s: float = 20.0) -> ReconnectingSource:
    return ReconnectingSource(iter(fakes).__next__, NAME, timeout_s)


async def take(source: ReconnectingSource, count: int) -> list[int]:
    """The widths of the next images."""
    widths: list[int] = []
    async with asyncio.timeout(20.0), source:
        async for frame in source.frames():
            widths.append(frame.image.shape[1])
            if len(widths) == count:
                break
    return widths


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reconnecting, "_FIRST_PAUSE_S", 0.001)


async def test_a_stream_that_ended_is_opened_again_until_it_gives_an_image(
    caplog: pytest.LogCaptureFixture,
) -> None:
    fake = FakeSource([[4, 4, END], [REFUSED], [END], [4, 4]])
    assert await take(source_of(fake), 4) == [4] * 4
    assert (fake.opened, fake.closed) == (4, True)
    assert [record.levelno for record in caplog.records] == [logging.WARNING] * 2
    lost, back = caplog.messages
    assert lost == f"{NAME}: the stream ended; opening it again"
    assert back.startswith(f"{NAME}: there are images again, after ")


@pytest.mark.parametrize(
    ("first", "second", "remains"),
    [
        ([4], [4, 4], "second"),
        ([4, SECOND, 4, 4], [], "first"),
        ([4, SECOND, END], [4, 4], "second"),
    ],
)
async def test_beside_a_silent_stream_a_second_is_opened_and_the_first_image_decides(
    first: list[Step],
    second: list[Step],
    remains: str,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(reconnecting, "_STALLED", 0.001)  # 20 ms of 20 s
    beside = FakeSource([second])
    fakes = FakeSource([first], beside), beside
    async with asyncio.timeout(20.0), source_of(*fakes) as source:
        frames = source.frames()
        for _ in range(3):
            await anext(frames)
        assert [fake.closed for fake in fakes] == [remains == "second", remains == "first"]
        assert all(fake.opened == 1 for fake in fakes)
        await frames.aclose()
    assert all(fake.closed for fake in fakes)
    assert asyncio.all_tasks() == {asyncio.current_task()}
    assert len(caplog.messages) == 2


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ([4, END], "the stream ended, and no image for 0.3 s; opening it again failed: refused"),
        (
            [4, CameraError(f"{NAME}: no image for 0.3 s")],
            "no image for 0.3 s; opening it again failed: refused",
        ),
    ],
)
async def test_a_camera_that_stays_away_fails_after_its_time_limit(script: list[Step], words: str) -> None:
    fakes = [FakeSource([each, *[[REFUSED]] * 1000]) for each in (script, [REFUSED])]
    began_s = time.monotonic()
    with pytest.raises(CameraError) as failed:
        await take(source_of(*fakes, timeout_s=0.3), 2)
    assert str(failed.value) == f"{NAME}: {words}"
    assert time.monotonic() - began_s >= 0.3
    assert fakes[0].closed


async def test_what_fails_before_the_first_image_is_not_tried_again() -> None:
    for script in ([REFUSED], [END]):
        fake = FakeSource([script])
        with pytest.raises(CameraError) as failed:
            await take(source_of(fake), 1)
        assert failed.value is script[-1]
        assert fake.opened == 1


async def test_images_of_another_size_than_before_fail_in_one_line(caplog: pytest.LogCaptureFixture) -> None:
    with pytest.raises(
        CameraError, match="now sends images of 8 × 1 pixels, before 4 × 1; let it keep its size"
    ):
        await take(source_of(FakeSource([[4, END], [8, 8]])), 2)
    assert len(caplog.messages) == 1


@pytest.mark.parametrize("by_opencv", [False, True])
async def test_a_server_that_ends_its_stream_and_is_back(
    by_opencv: bool, caplog: pytest.LogCaptureFixture
) -> None:
    connections, taken = 0, asyncio.Event()

    async def send(write: Write) -> None:
        nonlocal connections
        connections += 1
        value = 100 * connections
        while value > 100 or not taken.is_set():
            await write(part(jpeg(value), "Content-Type: image/jpeg\r\n"))
            await asyncio.sleep(0.04)

    async with streaming(send) as url:
        source = open_source(url, reconnects=True)
        if by_opencv:
            source = ReconnectingSource(lambda: CaptureSource(url), f"camera {url}", 20.0)
        began_s = time.monotonic()
        async with asyncio.timeout(20.0), source:
            async for frame in source.frames():
                assert began_s <= frame.received_s <= time.monotonic()
                taken.set()
                if frame.image[0, 0, 0] > 150:
                    break
    assert connections == 2
    assert len(caplog.messages) == 2
