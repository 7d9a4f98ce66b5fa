"""`/video/ID`: a drone's MJPEG passed on, over one connection to the drone however many watch.

Images are not compressed again; whoever is slow misses some. The drone is asked while somebody watches.
"""

from __future__ import annotations

import asyncio
import logging
import struct
from collections.abc import AsyncGenerator, Callable
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import aiohttp
from fastapi import Request
from fastapi.responses import PlainTextResponse, Response, StreamingResponse

from monitor.addresses import Places, client_address
from wire.mjpeg import JPEG_START, STREAM_HEADERS, STREAM_START, MjpegReader, Part, StreamError, write_part

if TYPE_CHECKING:
    from monitor.server import Monitor

MAX_VIEWERS = 100  # of one drone
MAX_VIEWERS_PER_ADDRESS = 30
MAX_IMAGE_BYTES = 4 << 20
FIRST_IMAGE_S = 5.0
_RETRY_S = 1.0
_SILENCE_S = 5.0  # then the connection is made again
_CHUNK_BYTES = 1 << 16
_FRAME_HEAD = struct.Struct("<qI")  # time of exposure in microseconds or -1, length of the JPEG
_log = logging.getLogger(__name__)


class DroneVideo:
    """The newest image of one drone, kept new while somebody watches.

    Args:
        find_url: tells where the video is now; None if nowhere.
    """

    def __init__(self, find_url: Callable[[], str | None]) -> None:
        self._find_url = find_url
        self._latest: Part | None = None
        self._before: Part | None = None  # the last one when nobody watched any more
        self._arrived = asyncio.Event()
        self._places = Places(MAX_VIEWERS, MAX_VIEWERS_PER_ADDRESS)
        self._fetching: asyncio.Task[None] | None = None

    def problem(self, address: str) -> str:
        """Say in one line why nobody else may watch from an address; "" if somebody may."""
        return self._places.problem(address)

    async def images(self, address: str, *, kept: bool = False) -> AsyncGenerator[Part, None]:
        """Give images as they come, the newest each time; without end, so close it.

        None come if there is no place for another watcher from this address.

        Args:
            address: of the watcher.
            kept: begin with the last one of before, if there is one, however old it is.
        """
        if self._places.take(address):
            return
        if self._fetching is None:
            self._before, self._latest = self._latest or self._before, None
            self._fetching = asyncio.create_task(self._fetch())
        last: Part | None = None
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
        """Let go of the drone."""
        if self._fetching is not None:
            self._fetching.cancel()
            self._fetching = None

    async def _fetch(self) -> None:
        """Read the drone's video, again and again, until cancelled."""
        timeout = aiohttp.ClientTimeout(total=None, sock_connect=_SILENCE_S, sock_read=_SILENCE_S)
        jar = aiohttp.DummyCookieJar()
        async with aiohttp.ClientSession(timeout=timeout, cookie_jar=jar, auto_decompress=False) as session:
            while True:
                url = self._find_url()
                if url is not None:
                    try:
                        await self._read(session, url)
                    except (aiohttp.ClientError, OSError, ValueError) as error:
                        _log.info("video %s: %s", url, error)
                await asyncio.sleep(_RETRY_S)

    async def _read(self, session: aiohttp.ClientSession, url: str) -> None:
        # A redirection could lead anywhere: it is not followed.
        async with session.get(url, allow_redirects=False) as response:
            if response.status != 200:
                raise StreamError(f"status {response.status}")
            reader = MjpegReader(response.headers.get("Content-Type", ""), MAX_IMAGE_BYTES)
            async for chunk in response.content.iter_chunked(_CHUNK_BYTES):
                images = [part for part in reader.feed(chunk) if part.data.startswith(JPEG_START)]
                if images:
                    self._latest = images[-1]
                    self._arrived.set()  # wakes all that wait now
                    self._arrived.clear()


def can_be_passed_on(url: str | None) -> bool:
    """Whether a video's URL is one that this module reads."""
    try:
        return url is not None and urlsplit(url).scheme in ("http", "https") and bool(urlsplit(url).hostname)
    except ValueError:
        return False


def register(monitor: Monitor) -> None:
    """Add `/video/ID`, `/video/ID/frames` and `/video/ID/image.jpg`."""
    videos: dict[int, DroneVideo] = {}

    def open_video(request: Request, drone_id: int) -> DroneVideo | Response:
        problem = _problem(monitor, drone_id)
        if problem is not None:
            return PlainTextResponse(f"{problem}\n", 404)
        if drone_id not in videos:
            videos[drone_id] = DroneVideo(lambda: _readable(monitor.fleet.video_url(drone_id)))
        problem = videos[drone_id].problem(client_address(request.scope))
        return PlainTextResponse(f"{problem}\n", 503) if problem else videos[drone_id]

    @monitor.web.get("/video/{drone_id}")
    async def stream(request: Request, drone_id: int) -> Response:
        video = open_video(request, drone_id)
        if isinstance(video, Response):
            return video
        return StreamingResponse(_parts(video.images(client_address(request.scope))), headers=STREAM_HEADERS)

    @monitor.web.get("/video/{drone_id}/frames")
    async def frames(request: Request, drone_id: int) -> Response:
        video = open_video(request, drone_id)
        if isinstance(video, Response):
            return video
        images = video.images(client_address(request.scope), kept=True)
        headers = {"Cache-Control": "no-store", "Connection": "close"}
        return StreamingResponse(_frames(images), media_type="application/octet-stream", headers=headers)

    @monitor.web.get("/video/{drone_id}/image.jpg")
    async def image(request: Request, drone_id: int) -> Response:
        video = open_video(request, drone_id)
        if isinstance(video, Response):
            return video
        images = video.images(client_address(request.scope))
        try:
            newest = await asyncio.wait_for(anext(images), FIRST_IMAGE_S)
        except (TimeoutError, StopAsyncIteration):
            return PlainTextResponse("no image came\n", 503, {"Retry-After": "1"})
        finally:
            await images.aclose()
        headers = {"Cache-Control": "no-store"}
        if newest.time_us is not None:
            headers["X-Time-Us"] = str(newest.time_us)
        return Response(newest.data, media_type="image/jpeg", headers=headers)

    async def end() -> None:
        try:
            await asyncio.Event().wait()
        finally:
            for video in videos.values():
                video.stop()

    monitor.jobs.append(end)


def _problem(monitor: Monitor, drone_id: int) -> str | None:
    """Say why a drone's video cannot be had; None if it can."""
    if drone_id not in monitor.fleet.drone_ids():
        return f"no drone {drone_id} was heard"
    url = monitor.fleet.video_url(drone_id)
    if url is None:
        return f"drone {drone_id} tells of no video"
    if not can_be_passed_on(url):
        kind = url.partition("://")[0] if "://" in url else "another kind"
        return f"the video of drone {drone_id} is {kind[:20]}; only MJPEG over http can be shown"
    return None


def _readable(url: str | None) -> str | None:
    return url if can_be_passed_on(url) else None


async def _frames(images: AsyncGenerator[Part, None]) -> AsyncGenerator[bytes, None]:
    """Write images for a page that shows each with what belongs to its moment: head, then JPEG."""
    try:
        async for image in images:
            time_us = -1 if image.time_us is None else image.time_us
            yield _FRAME_HEAD.pack(time_us, len(image.data)) + image.data
    finally:
        await images.aclose()


async def _parts(images: AsyncGenerator[Part, None]) -> AsyncGenerator[bytes, None]:
    """Write images as an MJPEG stream."""
    try:
        yield STREAM_START
        async for image in images:
            yield write_part(image.data, image.time_us)
    finally:
        await images.aclose()
