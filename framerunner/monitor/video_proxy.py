"""`/video/ID`: a drone's MJPEG, read over one connection while there are viewers, and forwarded to them.

Images are not compressed again; a slow viewer misses some.
"""

from __future__ import annotations

import asyncio
import logging
import struct
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import aclosing
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import aiohttp
from fastapi import Request
from fastapi.responses import PlainTextResponse, Response, StreamingResponse

from framerunner.monitor.addresses import Places, client_address
from framerunner.wire.mjpeg import (
    JPEG_START,
    STREAM_HEADERS,
    STREAM_START,
    MjpegPart,
    MjpegReader,
    StreamError,
    write_part,
)

if TYPE_CHECKING:
    from framerunner.monitor.server import Monitor

MAX_VIEWERS = 100  # of one drone
MAX_VIEWERS_PER_ADDRESS = 30
MAX_IMAGE_BYTES = 4 << 20
FIRST_IMAGE_S = 5.0
_RETRY_S = 1.0
_SILENCE_S = 5.0  # without data; then the connection is made again
_CHUNK_BYTES = 1 << 16
_FRAME_HEAD = struct.Struct("<qI")  # time of exposure in microseconds or -1, length of the JPEG
_log = logging.getLogger(__name__)


class VideoRelay:
    """The newest image of one drone, updated while there are viewers.

    Args:
        find_url: returns the URL of the video; None if there is none now.
    """

    def __init__(self, find_url: Callable[[], str | None]) -> None:
        self._find_url = find_url
        self._latest: MjpegPart | None = None
        self._before: MjpegPart | None = None  # the last one when the last viewer left
        self._arrived = asyncio.Event()
        self._places = Places(MAX_VIEWERS, MAX_VIEWERS_PER_ADDRESS)
        self._fetching: asyncio.Task[None] | None = None

    def problem(self, address: str) -> str:
        """Why there is no place for another viewer from an address, in one line; "" if there is."""
        return self._places.problem(address)

    async def images(self, address: str, *, kept: bool = False) -> AsyncGenerator[MjpegPart, None]:
        """The newest images as they are received, without end; none if there is no place for the viewer.

        Args:
            address: of the viewer.
            kept: begin with the last image from before, however old it is.
        """
        if self._places.take(address):
            return
        if self._fetching is None:
            self._before, self._latest = self._latest or self._before, None
            self._fetching = asyncio.create_task(self._fetch())
        last: MjpegPart | None = None
        try:
            if kept and self._latest is None and self._before is not None:
                yield self._before
            while True:
                while self._latest is None or self._latest is last:
                    await self._arrived.wait()
                last = self._latest
                yield last
        finally:
            self._places.give_back(address)
            if len(self._places) == 0:
                self.stop()

    def stop(self) -> None:
        """Close the connection to the drone."""
        if self._fetching is not None:
            self._fetching.cancel()
            self._fetching = None

    async def _fetch(self) -> None:
        """Read the drone's video until cancelled; connect again when that fails."""
        timeout = aiohttp.ClientTimeout(total=None, sock_connect=_SILENCE_S, sock_read=_SILENCE_S)
        jar = aiohttp.DummyCookieJar()
        async with aiohttp.ClientSession(timeout=timeout, cookie_jar=jar, auto_decompress=False) as session:
            while True:
                url = self._find_url()
                if url is not None and can_be_forwarded(url):
                    try:
                        await self._read(session, url)
                    except (aiohttp.ClientError, OSError, ValueError) as error:
                        _log.info("video %s: %s", url, error)
                await asyncio.sleep(_RETRY_S)

    async def _read(self, session: aiohttp.ClientSession, url: str) -> None:
        # A redirection is not followed: it could lead to any host.
        async with session.get(url, allow_redirects=False) as response:
            if response.status != 200:
                raise StreamError(f"status {response.status}")
            reader = MjpegReader(response.headers.get("Content-Type", ""), MAX_IMAGE_BYTES)
            async for chunk in response.content.iter_chunked(_CHUNK_BYTES):
                images = [part for part in reader.feed(chunk) if part.data.startswith(JPEG_START)]
                if images:
                    self._latest = images[-1]
                    self._arrived.set()  # wakes all viewers that wait now
                    self._arrived.clear()


def can_be_forwarded(url: str | None) -> bool:
    """Whether this module can read a video's URL."""
    try:
        return url is not None and urlsplit(url).scheme in ("http", "https") and bool(urlsplit(url).hostname)
    except ValueError:
        return False


def register(monitor: Monitor) -> None:
    """Add `/video/ID`, `/video/ID/frames` and `/video/ID/image.jpg`."""
    videos: dict[int, VideoRelay] = {}

    def add(path: str, answer: Callable[[VideoRelay, str], Awaitable[Response]]) -> None:
        @monitor.web.get(path)
        async def respond(request: Request, drone_id: int) -> Response:
            problem = _problem(monitor, drone_id)
            if problem:
                return PlainTextResponse(f"{problem}\n", 404)
            if drone_id not in videos:
                videos[drone_id] = VideoRelay(lambda: monitor.fleet.video_url(drone_id))
            address = client_address(request.scope)
            problem = videos[drone_id].problem(address)
            if problem:
                return PlainTextResponse(f"{problem}\n", 503)
            return await answer(videos[drone_id], address)

    def stop() -> None:
        for video in videos.values():
            video.stop()

    add("/video/{drone_id}", _stream)
    add("/video/{drone_id}/frames", _frames)
    add("/video/{drone_id}/image.jpg", _image)
    monitor.at_end(stop)


def _problem(monitor: Monitor, drone_id: int) -> str:
    """Why a drone's video cannot be shown; "" if it can."""
    if drone_id not in monitor.fleet.drone_ids():
        return f"no drone {drone_id} was heard"
    url = monitor.fleet.video_url(drone_id)
    if url is None:
        return f"drone {drone_id} has no video"
    if not can_be_forwarded(url):
        kind = url.partition("://")[0] if "://" in url else "another kind"
        return f"the video of drone {drone_id} is {kind[:20]}; only MJPEG over http can be shown"
    return ""


async def _stream(video: VideoRelay, address: str) -> Response:
    """The images as an MJPEG stream."""

    async def parts() -> AsyncGenerator[bytes, None]:
        yield STREAM_START
        async with aclosing(video.images(address)) as images:
            async for image in images:
                yield write_part(image.data, image.time_us)

    return StreamingResponse(parts(), headers=STREAM_HEADERS)


async def _frames(video: VideoRelay, address: str) -> Response:
    """Each image as time of exposure, length and JPEG."""

    async def parts() -> AsyncGenerator[bytes, None]:
        async with aclosing(video.images(address, kept=True)) as images:
            async for image in images:
                time_us = -1 if image.time_us is None else image.time_us
                yield _FRAME_HEAD.pack(time_us, len(image.data)) + image.data

    headers = {"Cache-Control": "no-store", "Connection": "close"}
    return StreamingResponse(parts(), media_type="application/octet-stream", headers=headers)


async def _image(video: VideoRelay, address: str) -> Response:
    """The newest image."""
    async with aclosing(video.images(address)) as images:
        try:
            async with asyncio.timeout(FIRST_IMAGE_S):
                newest = await anext(images)
        except (TimeoutError, StopAsyncIteration):
            return PlainTextResponse("no image came\n", 503, {"Retry-After": "1"})
    headers = {"Cache-Control": "no-store"}
    if newest.time_us is not None:
        headers["X-Time-Us"] = str(newest.time_us)
    return Response(newest.data, media_type="image/jpeg", headers=headers)
