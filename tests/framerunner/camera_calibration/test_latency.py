"""`framerunner camera latency` with a light and a camera of known delay."""

import asyncio
import time
from collections import deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest
from aiohttp import web

from framerunner.camera_calibration.latency import film, led_light, terminal_light
from framerunner.errors import SettingError
from vision.calibration.latency import LatencyError
from vision.types import CameraError

DELAY_S = 0.15
PERIOD_S = 0.03


def is_lit(led: Path) -> bool:
    return led.exists() and led.read_text() == "1"


@asynccontextmanager
async def camera(led: Path, images: int = 10**6) -> AsyncIterator[str]:
    """A camera that films an LED; its images arrive late."""

    async def video(request: web.Request) -> web.StreamResponse:
        response = web.StreamResponse(headers={"Content-Type": "multipart/x-mixed-replace; boundary=cut"})
        await response.prepare(request)
        waiting: deque[tuple[float, bytes]] = deque()
        for _ in range(images):
            lit = is_lit(led)
            image = np.full((120, 160, 3), 30, np.uint8)
            image[40:90, 50:110] += 180 * lit
            waiting.append((time.monotonic() + DELAY_S, bytes(cv2.imencode(".jpg", image)[1])))
            while waiting and waiting[0][0] <= time.monotonic():
                data = waiting.popleft()[1]
                head = f"--cut\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
                await response.write(head.encode() + data + b"\r\n")
            await asyncio.sleep(PERIOD_S)
        return response

    app = web.Application()
    app.router.add_get("/video", video)
    runner = web.AppRunner(app, access_log=None, shutdown_timeout=0.1)
    await runner.setup()
    await web.TCPSite(runner, "127.0.0.1", 0).start()
    try:
        yield f"http://127.0.0.1:{runner.addresses[0][1]}/video"
    finally:
        await runner.cleanup()


async def test_an_led_and_a_camera_give_the_delay(tmp_path: Path) -> None:
    led = tmp_path / "brightness"
    async with camera(led) as url:
        found = await film(led_light(led), url, 8.0, lambda line: None)
    # An image is sent up to a period after its delay, when the next one is taken.
    assert DELAY_S - 0.005 < found.delay_s < DELAY_S + PERIOD_S + 0.02
    assert found.correlation > 0.9
    assert led.read_text() == "0"


async def test_a_camera_that_sees_no_light_is_said(tmp_path: Path) -> None:
    async with camera(tmp_path / "other") as url:
        with pytest.raises(LatencyError, match="not seen"):
            await film(led_light(tmp_path / "brightness"), url, 3.0, lambda line: None)


async def test_a_video_that_ends_is_said(tmp_path: Path) -> None:
    async with camera(tmp_path / "led", images=30) as url:
        with pytest.raises((CameraError, SettingError)):
            await film(led_light(tmp_path / "led"), url, 8.0, lambda line: None)


def test_an_led_that_cannot_be_switched_is_one_line(tmp_path: Path) -> None:
    with (
        pytest.raises(SettingError, match=r"--led .*: cannot be written"),
        led_light(tmp_path / "none" / "led"),
    ):
        pass


def test_what_is_no_terminal_does_not_blink() -> None:
    with pytest.raises(SettingError, match="--led"), terminal_light():
        pass
