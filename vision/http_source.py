"""MJPEG over HTTP as a camera source, with the vehicle time of each image where the sender gives it."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import AsyncIterator
from contextlib import suppress
from typing import Self

import aiohttp

from vision.decoder import ImageDecoder
from vision.jpeg import ImageError
from vision.latest import CameraError, Latest, first_line, shown
from vision.types import CameraFrame
from wire.mjpeg import MjpegReader, Part, StreamError

_FEED_BYTES = 16 * 1024  # of the stream, between which others run
_MAX_PARTS_PER_S = 1000


class HttpSource:
    """Reads the stream in a task of its own and decodes only what the consumer asks for."""

    def __init__(self, url: str, timeout_s: float = 5.0, size_px: tuple[int, int] | None = None) -> None:
        """Prepare; nothing is opened yet.

        Args:
            url: http:// or https://
            timeout_s: how long to wait for the connection, and for each image.
            size_px: width and height of its images, others are skipped; None for any.
        """
        self._url = url
        self._name = f"camera {shown(url)}"
        self._timeout_s = timeout_s
        self._latest: Latest[tuple[Part, float]] = Latest()
        self._session: aiohttp.ClientSession | None = None
        self._task: asyncio.Task[None] | None = None
        self._decoder = ImageDecoder(size_px)
        self._bad_frames = 0
        self._last_refused = ""

    @property
    def bad_frames(self) -> int:
        """Images skipped so far because they are damaged or not of this camera."""
        return self._bad_frames

    async def __aenter__(self) -> Self:
        """Connect.

        Raises:
            CameraError: nobody answers, or the answer is not MJPEG.
        """
        limits = aiohttp.ClientTimeout(total=None, connect=self._timeout_s, sock_connect=self._timeout_s)
        self._session = aiohttp.ClientSession(timeout=limits, auto_decompress=False)
        try:
            response = await self._connect(self._session)
            reader = self._reader(response)
        except BaseException:
            await self._session.close()
            raise
        self._task = asyncio.create_task(self._read(response, reader), name=self._name)
        return self

    async def __aexit__(self, *exc_info: object) -> None:
        """Disconnect."""
        self._decoder.close()
        if self._task is not None:
            self._task.cancel()
            with suppress(asyncio.CancelledError):
                await self._task
        if self._session is not None:
            await self._session.close()

    async def frames(self) -> AsyncIterator[CameraFrame]:
        """Images as they come, always the latest.

        Raises:
            CameraError: the stream ended or cannot be read, or no image came in time.
        """
        loop = asyncio.get_running_loop()
        deadline_s = loop.time() + self._timeout_s
        while True:
            try:
                async with asyncio.timeout_at(deadline_s):
                    taken = await self._latest.get()
            except TimeoutError:
                raise CameraError(
                    f"{self._name}: no image for {self._timeout_s:g} s{self._skipped()}"
                ) from None
            if taken is None:
                return
            part, received_s = taken
            try:
                image = await self._decoder.decode_jpeg(part.data)
            except ImageError as error:
                self._bad_frames += 1
                self._last_refused = str(error)
                await asyncio.sleep(0)  # a flood of garbage must not keep others from running
                continue
            yield CameraFrame(image, part.time_us, received_s, part.data)
            deadline_s = loop.time() + self._timeout_s

    async def _connect(self, session: aiohttp.ClientSession) -> aiohttp.ClientResponse:
        try:
            async with asyncio.timeout(self._timeout_s):
                return await session.get(self._url, max_redirects=3)
        except TimeoutError as error:
            raise CameraError(f"{self._name}: no answer within {self._timeout_s:g} s") from error
        except aiohttp.ClientConnectorError as error:
            number = error.errno or 0
            reason = os.strerror(number) if number > 0 else first_line(error.strerror)
            raise CameraError(f"{self._name}: cannot connect: {reason.lower()}") from error
        except aiohttp.InvalidURL as error:
            raise CameraError(f"{self._name}: not a valid URL") from error
        except (aiohttp.ClientError, OSError, ValueError) as error:
            raise CameraError(f"{self._name}: {first_line(error)}") from error

    def _skipped(self) -> str:
        if not self._bad_frames:
            return ""
        return f" ({self._bad_frames} images were skipped; the last one is {self._last_refused})"

    def _reader(self, response: aiohttp.ClientResponse) -> MjpegReader:
        if response.status != 200:
            raise CameraError(f"{self._name}: HTTP {response.status} {first_line(response.reason)}")
        try:
            return MjpegReader(response.headers.get("Content-Type", ""))
        except StreamError as error:
            raise CameraError(f"{self._name}: {error}") from None

    async def _read(self, response: aiohttp.ClientResponse, reader: MjpegReader) -> None:
        parts, since_s = 0, time.monotonic()
        try:
            async for chunk in response.content.iter_any():
                for at in range(0, len(chunk), _FEED_BYTES):
                    found = reader.feed(chunk[at : at + _FEED_BYTES])
                    now_s = time.monotonic()
                    if found:
                        self._latest.put((found[-1], now_s))
                    if now_s - since_s > 1.0:
                        parts, since_s = 0, now_s
                    parts += len(found)
                    if parts > _MAX_PARTS_PER_S:
                        raise StreamError(f"more than {_MAX_PARTS_PER_S} images a second")
                    await asyncio.sleep(0)
            self._latest.end(CameraError(f"{self._name}: the stream ended"))
        except (StreamError, aiohttp.ClientError, OSError) as error:
            self._latest.end(CameraError(f"{self._name}: the stream broke: {first_line(error)}"))
