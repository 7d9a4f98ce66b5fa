"""MJPEG over HTTP as a camera source, with the vehicle time of each image where the sender gives it."""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import AsyncIterator
from contextlib import suppress
from typing import Generic, Self, TypeVar

import aiohttp

from framerunner.wire.mjpeg import MjpegPart, MjpegReader, StreamError
from vision.decoder import ImageDecoder
from vision.jpeg import ImageError
from vision.types import CameraError, CameraFrame, shown_url

_FEED_BYTES = 16 * 1024  # of the stream, between which other tasks run
_MAX_PARTS_PER_S = 1000
T = TypeVar("T")


class Latest(Generic[T]):
    """Holds the newest item until it is taken; an older one is dropped. For one event loop's thread."""

    def __init__(self) -> None:
        self._item: T | None = None
        self._error: CameraError | None = None
        self._changed = asyncio.Event()

    def put(self, item: T) -> None:
        """Replace the item."""
        self._item = item
        self._changed.set()

    def end(self, error: CameraError) -> None:
        """No item follows the one held now."""
        self._error = error
        self._changed.set()

    async def get(self) -> T:
        """Take the item; wait for one if there is none. After the last one, raises the error of `end`."""
        while self._item is None:
            if self._error is not None:
                raise self._error
            self._changed.clear()
            await self._changed.wait()
        item, self._item = self._item, None
        return item


class HttpSource:
    """Reads the stream in a task and decodes only the images that the consumer takes.

    Args:
        url: http:// or https://
        timeout_s: how long to wait for the connection, and for each image.
        size_px: width and height of its images, others are skipped; None for any.

    Attributes:
        bad_frames: images skipped so far because they are damaged or not of this camera.
    """

    def __init__(self, url: str, timeout_s: float = 5.0, size_px: tuple[int, int] | None = None) -> None:
        self.bad_frames = 0
        self._url = url
        self._name = f"camera {shown_url(url)}"
        self._timeout_s = timeout_s
        self._latest: Latest[tuple[MjpegPart, float]] = Latest()
        self._session: aiohttp.ClientSession | None = None
        self._task: asyncio.Task[None] | None = None
        self._decoder = ImageDecoder(size_px)
        self._last_refused = ""

    async def __aenter__(self) -> Self:
        """Connect; raises `CameraError` if there is no answer, or it is not MJPEG."""
        try:
            await self.open()
        except BaseException:
            await self.__aexit__()
            raise
        return self

    async def __aexit__(self, *exc_info: object) -> None:
        """Disconnect."""
        self._decoder.close()
        await self._stop_reading()
        if self._session is not None:
            await self._session.close()

    async def open(self) -> None:
        """Connect, for the first time or after the stream ended or failed; raises `CameraError`."""
        await self._stop_reading()
        self._latest = Latest()
        if self._session is None:
            limits = aiohttp.ClientTimeout(total=None, connect=self._timeout_s, sock_connect=self._timeout_s)
            self._session = aiohttp.ClientSession(timeout=limits, auto_decompress=False)
        response, reader = await self._connect(self._session)
        self._task = asyncio.create_task(self._read(response, reader), name=self._name)

    async def frames(self) -> AsyncIterator[CameraFrame]:
        """Always the latest image; raises `CameraError` when the stream fails or no image arrives in time."""
        loop = asyncio.get_running_loop()
        deadline_s = loop.time() + self._timeout_s
        while True:
            try:
                async with asyncio.timeout_at(deadline_s):
                    part, received_s = await self._latest.get()
            except TimeoutError:
                problem = f"{self._name}: no image for {self._timeout_s:g} s"
                if self.bad_frames:
                    last = f"the last one is {self._last_refused}"
                    problem += f" ({self.bad_frames} images were skipped; {last})"
                raise CameraError(problem) from None
            try:
                image = await self._decoder.decode_jpeg(part.data)
            except ImageError as error:
                self.bad_frames += 1
                self._last_refused = str(error)
                await asyncio.sleep(0)  # other tasks run even while every image is refused
                continue
            yield CameraFrame(image, part.time_us, received_s, part.data)
            deadline_s = loop.time() + self._timeout_s

    async def _stop_reading(self) -> None:
        if self._task is not None:
            self._task.cancel()
            with suppress(asyncio.CancelledError):
                await self._task

    async def _connect(self, session: aiohttp.ClientSession) -> tuple[aiohttp.ClientResponse, MjpegReader]:
        try:
            async with asyncio.timeout(self._timeout_s):
                response = await session.get(self._url, max_redirects=3)
            try:
                return response, self._reader_of(response)
            except BaseException:
                response.close()
                raise
        except TimeoutError as error:
            raise CameraError(f"{self._name}: no answer within {self._timeout_s:g} s") from error
        except aiohttp.ClientConnectorError as error:
            number = error.errno or 0
            reason = os.strerror(number) if number > 0 else _first_line(error.strerror)
            raise CameraError(f"{self._name}: cannot connect: {reason.lower()}") from error
        except aiohttp.InvalidURL as error:
            raise CameraError(f"{self._name}: not a valid URL") from error
        except (aiohttp.ClientError, OSError, ValueError) as error:
            raise CameraError(f"{self._name}: {_first_line(error)}") from error

    def _reader_of(self, response: aiohttp.ClientResponse) -> MjpegReader:
        if response.status != 200:
            problem = f"HTTP {response.status} {_first_line(response.reason)}"
            login = "; write user and password as http://USER:PASSWORD@HOST/PATH"
            raise CameraError(f"{self._name}: {problem}{login if response.status == 401 else ''}")
        return MjpegReader(response.headers.get("Content-Type", ""))

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
        except aiohttp.ClientPayloadError:  # the server was killed, or closed the connection early
            self._latest.end(CameraError(f"{self._name}: the stream ended"))
        except (StreamError, aiohttp.ClientError, OSError) as error:
            self._latest.end(CameraError(f"{self._name}: the stream failed: {_first_line(error)}"))
        finally:
            response.close()


def _first_line(error: object) -> str:
    """The first line of an error's text, or its type if it has none."""
    lines = str(error).strip().splitlines()
    return lines[0][:200] if lines else type(error).__name__
