"""A network camera whose stream is opened again when it ends, fails or stalls."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from typing import Any, Protocol, Self

from vision.types import CameraError, CameraFrame, CameraSource

_STALLED = 0.4  # the share of the time limit after which a second connection is opened beside a silent one
_FIRST_PAUSE_S = 0.1  # between two attempts; doubled after each
_LONGEST_PAUSE_S = 0.5
_STEADY_S = 5.0  # after a stream that lasted so long, the pauses are short again
logger = logging.getLogger(__name__)


class ReopenableSource(CameraSource, Protocol):
    """A live source that can be opened again before it is closed."""

    async def open(self) -> None:
        """Open the camera, for the first time or after it ended or failed; raises `CameraError`."""
        ...


class ReconnectingSource:
    """Opens a network camera again, in the background.

    What fails before the first image fails as without this. Later a stream that ended or failed is opened
    again. A silent one is kept, as its images may come again, and a second connection is opened beside it;
    the one that gives an image first is used from then on. There is no image meanwhile, and after `timeout_s`
    without one the camera has failed. One line is logged when the stream is lost, and one when it is back.

    Args:
        new_source: makes a source that is not open yet.
        name: what errors of its sources begin with.
        timeout_s: longest time without an image.

    Attributes:
        bad_frames: images that the present connection has skipped so far.
    """

    def __init__(self, new_source: Callable[[], ReopenableSource], name: str, timeout_s: float) -> None:
        self.bad_frames = 0
        self._new_source = new_source
        self._name = name
        self._timeout_s = timeout_s
        self._source = new_source()
        self._size_px: tuple[int, int] | None = None  # width and height of the first image
        self._pause_s = _FIRST_PAUSE_S
        self._opened_s = 0.0
        self._problem = ""  # of the last attempt

    async def __aenter__(self) -> Self:
        """Open the camera; raises `CameraError` if that fails."""
        await self._source.__aenter__()
        self._opened_s = asyncio.get_running_loop().time()
        return self

    async def __aexit__(self, *exc_info: object) -> None:
        """Close it."""
        await self._source.__aexit__(*exc_info)

    async def frames(self) -> AsyncIterator[CameraFrame]:
        """Always the latest image; raises `CameraError` if none comes in time, or one of another size."""
        loop = asyncio.get_running_loop()
        images = self._source.frames()
        while True:
            began_s = loop.time()
            reading = asyncio.create_task(_next_of(images))
            try:
                await asyncio.wait({reading}, timeout=_STALLED * self._timeout_s)
                if self._size_px is None or (reading.done() and reading.exception() is None):
                    frame = await reading
                else:
                    images, frame = await self._recovered(images, reading, began_s)
            finally:
                await _cancel(reading)
            if frame is None:  # the end of a recorded video
                return
            self._check_size(frame)
            self.bad_frames = self._source.bad_frames
            yield frame

    async def _recovered(
        self, images: AsyncIterator[CameraFrame], reading: asyncio.Task[CameraFrame | None], began_s: float
    ) -> tuple[AsyncIterator[CameraFrame], CameraFrame | None]:
        """After a failure or a silence: the images of the connection that gives one first, and that one."""
        loop = asyncio.get_running_loop()
        lost = self._reason(reading) or f"no image for {_STALLED * self._timeout_s:g} s"
        logger.warning("%s: %s; opening it again", self._name, lost)
        source = self._source if reading.done() else self._new_source()
        opening = asyncio.create_task(self._reopened(source))
        try:
            while True:
                left_s = began_s + self._timeout_s - loop.time()
                limit_s = left_s if reading.done() else None  # the source itself has this limit
                waited = {task for task in (reading, opening) if not task.done()}
                await asyncio.wait(waited, timeout=limit_s, return_when=asyncio.FIRST_COMPLETED)
                if reading.done() and reading.exception() is None:
                    frame = reading.result()
                    break
                if opening.done():
                    images, frame = opening.result()
                    self._source, source = source, self._source
                    break
                if loop.time() >= began_s + self._timeout_s:
                    raise self._failure(self._reason(reading))
        finally:
            await _cancel(opening)
            if source is not self._source:
                await source.__aexit__()
        self._check_size(frame)
        logger.warning("%s: there are images again, after %.1f s", self._name, loop.time() - began_s)
        return images, frame

    async def _reopened(self, source: ReopenableSource) -> tuple[AsyncIterator[CameraFrame], CameraFrame]:
        """Try to open a source until it gives an image; gives its images and the first of them."""
        loop = asyncio.get_running_loop()
        if loop.time() - self._opened_s > _STEADY_S:
            self._pause_s = _FIRST_PAUSE_S
        self._problem = ""
        while True:
            await asyncio.sleep(self._pause_s)
            self._pause_s = min(2.0 * self._pause_s, _LONGEST_PAUSE_S)
            try:
                await source.open()
                self._opened_s = loop.time()
                images = source.frames()
                if (frame := await _next_of(images)) is not None:
                    return images, frame
            except CameraError as error:
                self._problem = self._without_name(error)

    def _reason(self, reading: asyncio.Task[CameraFrame | None]) -> str:
        """Why a stream has failed; empty if it has not. Raises what is no camera's error."""
        if not reading.done() or (error := reading.exception()) is None:
            return ""
        if not isinstance(error, CameraError):
            raise error
        return self._without_name(error)

    def _failure(self, lost: str) -> CameraError:
        silent = f"no image for {self._timeout_s:g} s"
        told = lost if lost.startswith(silent) else f"{lost}, and {silent}"
        again = f"; opening it again failed: {self._problem}" if self._problem else ""
        return CameraError(f"{self._name}: {told}{again}")

    def _check_size(self, frame: CameraFrame | None) -> None:
        if frame is None:
            return
        height, width = frame.image.shape[:2]
        first = self._size_px = self._size_px or (width, height)
        if first != (width, height):
            now, before = f"{width} × {height}", f"{first[0]} × {first[1]}"
            raise CameraError(
                f"{self._name}: it now sends images of {now} pixels, before {before}; let it keep its size"
            )

    def _without_name(self, error: CameraError) -> str:
        return str(error).removeprefix(f"{self._name}: ")


async def _next_of(images: AsyncIterator[CameraFrame]) -> CameraFrame | None:
    return await anext(images, None)


async def _cancel(task: asyncio.Task[Any]) -> None:
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
