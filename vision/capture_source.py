"""Whatever OpenCV opens as a camera source: RTSP, UDP, video devices, files."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Self

from vision.latest import CameraError, shown
from vision.types import CameraFrame
from vision.worker_process import Answer, WorkerEndedError, WorkerProcess
from vision.worker_protocol import Reply, Request


class CaptureSource:
    """Reads in a process of its own, which can be ended whatever a stream makes OpenCV do.

    Only the latest image is kept. A file is played at its own speed, and its end is a normal end; the end of
    a live stream is an error.
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
        self._worker = WorkerProcess()
        self._bad_frames = 0

    @property
    def bad_frames(self) -> int:
        """Images skipped so far because they are too large; OpenCV does not tell which ones it skips."""
        return self._bad_frames

    async def __aenter__(self) -> Self:
        """Open the camera.

        Raises:
            CameraError: it cannot be opened, or not in time.
        """
        request = f"{round(self._timeout_s * 1000)} {self._url}".encode()
        try:
            async with asyncio.timeout(self._timeout_s):
                answer = await self._ask(Request.OPEN, request)
        except TimeoutError:
            raise CameraError(f"{self._name}: did not open within {self._timeout_s:g} s") from None
        if answer.reply is not Reply.OPENED:
            self._worker.end()
            raise CameraError(f"{self._name}: cannot be opened; is it there, and is it video?")
        return self

    async def __aexit__(self, *exc_info: object) -> None:
        """Close it."""
        self._worker.end()

    async def frames(self) -> AsyncIterator[CameraFrame]:
        """Images as they come, always the latest; their vehicle time is unknown.

        Raises:
            CameraError: the stream ended, or no image came in time.
        """
        loop = asyncio.get_running_loop()
        deadline_s = loop.time() + self._timeout_s
        while True:
            try:
                async with asyncio.timeout_at(deadline_s):
                    answer = await self._ask(Request.NEXT)
            except TimeoutError:
                raise CameraError(f"{self._name}: no image for {self._timeout_s:g} s") from None
            if answer.reply is Reply.END_OF_FILE:
                return
            if answer.reply is Reply.END_OF_STREAM:
                raise CameraError(f"{self._name}: the stream ended")
            if answer.image is None:
                self._bad_frames += 1
                continue
            yield CameraFrame(answer.image, None, answer.received_s)
            deadline_s = loop.time() + self._timeout_s

    async def _ask(self, request: Request, data: bytes = b"") -> Answer:
        try:
            return await self._worker.ask(request, data)
        except WorkerEndedError:
            raise CameraError(f"{self._name}: OpenCV crashed or ran out of memory on it") from None
