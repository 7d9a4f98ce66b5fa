"""Whatever OpenCV opens as a camera source: RTSP, UDP, video devices, files."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable
from typing import Self

import cv2

from vision.latest import CameraError, Latest, shown
from vision.types import CameraFrame, Image


class CaptureSource:
    """Reads in a thread of its own, for OpenCV blocks; only the latest image is kept.

    A file is played at its own speed, and its end is a normal end; the end of a live stream is an error.
    """

    def __init__(self, url: str | int, timeout_s: float = 5.0) -> None:
        """Prepare; nothing is opened yet.

        Args:
            url: URL, path or number of a device.
            timeout_s: how long to wait for it to open, and for each image.
        """
        self._url = url
        self._name = f"camera {shown(str(url))}"
        self._timeout_s = timeout_s
        self._latest: Latest[CameraFrame] = Latest()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._opened: asyncio.Future[bool] | None = None
        self._loop: asyncio.AbstractEventLoop | None = None

    @property
    def bad_frames(self) -> int:
        """Always 0: OpenCV does not tell which images it skips."""
        return 0

    async def __aenter__(self) -> Self:
        """Open the camera.

        Raises:
            CameraError: it cannot be opened, or not in time.
        """
        self._loop = asyncio.get_running_loop()
        self._opened = self._loop.create_future()
        # A daemon: if OpenCV never returns from a dead camera, the program can still end.
        self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
        self._thread.start()
        try:
            opened = await asyncio.wait_for(asyncio.shield(self._opened), self._timeout_s)
        except TimeoutError:
            self._stop.set()
            raise CameraError(f"{self._name}: did not open within {self._timeout_s:g} s") from None
        if not opened:
            raise CameraError(f"{self._name}: cannot be opened; is it there, and is it video?")
        return self

    async def __aexit__(self, *exc_info: object) -> None:
        """Close it."""
        self._stop.set()
        if self._thread is not None:
            await asyncio.to_thread(self._thread.join, 2.0)

    async def frames(self) -> AsyncIterator[CameraFrame]:
        """Images as they come, always the latest; their vehicle time is unknown.

        Raises:
            CameraError: the stream ended, or no image came in time.
        """
        while True:
            try:
                async with asyncio.timeout(self._timeout_s):
                    frame = await self._latest.get()
            except TimeoutError:
                raise CameraError(f"{self._name}: no image for {self._timeout_s:g} s") from None
            if frame is None:
                return
            yield frame

    def _run(self) -> None:
        """Live in the thread: open, read until stopped, release."""
        capture = self._open()
        try:
            opened = capture.isOpened()
            self._tell(self._say_opened, opened)
            if opened:
                self._read(capture)
        finally:
            capture.release()

    def _open(self) -> cv2.VideoCapture:
        if isinstance(self._url, int):
            return cv2.VideoCapture(self._url)
        limit_ms = int(self._timeout_s * 1000)
        settings = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, limit_ms, cv2.CAP_PROP_READ_TIMEOUT_MSEC, limit_ms]
        capture = cv2.VideoCapture(self._url, cv2.CAP_FFMPEG, settings)
        return capture if capture.isOpened() else cv2.VideoCapture(self._url)

    def _read(self, capture: cv2.VideoCapture) -> None:
        is_file = capture.get(cv2.CAP_PROP_FRAME_COUNT) > 0
        rate_hz = capture.get(cv2.CAP_PROP_FPS)
        period_s = 1.0 / rate_hz if is_file and 0 < rate_hz < 1000 else 0.0
        next_s = time.monotonic()
        while not self._stop.is_set():
            done, image = capture.read()
            if not done:
                error = None if is_file else CameraError(f"{self._name}: the stream ended")
                self._tell(self._latest.end, error)
                return
            self._tell(self._put, image)
            if period_s:
                next_s += period_s
                self._stop.wait(max(0.0, next_s - time.monotonic()))

    def _put(self, image: Image) -> None:
        self._latest.put(CameraFrame(image, None, time.monotonic()))

    def _say_opened(self, opened: bool) -> None:
        if self._opened is not None and not self._opened.done():
            self._opened.set_result(opened)

    def _tell(self, call: Callable[..., None], *args: object) -> None:
        """Call in the event loop's thread; the loop may be gone already."""
        try:
            if self._loop is not None:
                self._loop.call_soon_threadsafe(call, *args)
        except RuntimeError:
            self._stop.set()
