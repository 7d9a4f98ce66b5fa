"""From camera images to the navigator's latest detections, and the word when the camera is dead."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from typing import Protocol

from errors import UserError
from vision.detector import detect
from vision.types import CameraFrame, Detections, Image
from wire.vehicle_telemetry import MessageOrder

CAMERA_DEAD_S = 1.0
FIRST_IMAGE_S = 5.0

Detector = Callable[[Image, int | None], Detections]


class CameraLostError(UserError):
    """There are no fresh images; the message is one line for people."""


class Camera(Protocol):
    """A source of images, as in `vision.sources`."""

    def frames(self) -> AsyncIterator[CameraFrame]:
        """Images as they come."""
        ...


class Eyes(Protocol):
    """What the flight needs of vision."""

    async def open(self) -> None:
        """Be ready to see; raises `CameraLostError`."""

    def latest(self, time_us: int) -> Detections:
        """What the latest image showed; raises `CameraLostError` if it is too old at this vehicle time."""
        ...

    async def close(self) -> None:
        """Let go of the camera."""


class ClosedEyes:
    """For missions without a camera: nothing is ever seen."""

    async def open(self) -> None:
        """Nothing to do."""

    def latest(self, time_us: int) -> Detections:
        """Nothing seen."""
        return Detections()

    async def close(self) -> None:
        """Nothing to do."""


class CameraEyes:
    """Runs the detector on each image as it arrives and keeps the last result.

    The age of an image counts vehicle time: from its own time stamp where the source gives one (a picture
    that waited in a buffer is old, too), else from the tick after its arrival.

    Attributes:
        oldest_s: age of the oldest image that was used, seconds.
    """

    def __init__(self, camera: Camera, detector: Detector = detect) -> None:
        """Prepare.

        Args:
            camera: gives the images.
            detector: image and its vehicle time to detections.
        """
        self._camera = camera
        self._detector = detector
        self._detections = Detections()
        self._image_us: int | None = None
        self._order = MessageOrder()
        self._images = 0
        self._images_known = 0
        self._first = asyncio.Event()
        self._arrived = asyncio.Event()
        self.oldest_s = 0.0
        self._seen_us = 0
        self._ended = ""
        self._task: asyncio.Task[None] | None = None

    async def open(self) -> None:
        """Wait for the first image.

        Raises:
            CameraLostError: none came.
        """
        self._task = asyncio.create_task(self._watch(), name="camera")
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._first.wait(), FIRST_IMAGE_S)
        if not self._images:
            raise CameraLostError(self._ended or f"the camera gave no image within {FIRST_IMAGE_S:g} s")

    def latest(self, time_us: int) -> Detections:
        """What the latest image showed.

        Args:
            time_us: vehicle time now.

        Raises:
            CameraLostError: the camera ended, failed, or its last image is older than a second.
        """
        if self._images != self._images_known:
            self._images_known = self._images
            self._seen_us = time_us if self._image_us is None else self._image_us
        if self._ended:
            raise CameraLostError(self._ended)
        age_s = (time_us - self._seen_us) / 1e6
        self.oldest_s = max(self.oldest_s, age_s)
        if age_s > CAMERA_DEAD_S:
            raise CameraLostError(f"the camera is dead: no image for {age_s:.1f} s")
        return self._detections

    async def seen(self, image_us: int, limit_s: float) -> bool:
        """Wait until an image exposed at a vehicle time, or a later one, has been looked at.

        Returns:
            False if it was not within `limit_s` of wall time, or the camera has failed.
        """
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(limit_s):
                while not self._ended and (self._image_us is None or self._image_us < image_us):
                    self._arrived.clear()
                    await self._arrived.wait()
        return self._image_us is not None and self._image_us >= image_us

    async def close(self) -> None:
        """Stop watching."""
        if self._task is not None:
            self._task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._task
            self._task = None

    async def _watch(self) -> None:
        try:
            async for frame in self._camera.frames():
                if frame.time_us is not None and not self._order.is_next(frame.time_us):
                    continue  # a link may swap images, too
                self._detections = self._detector(frame.image, frame.time_us)
                self._image_us = frame.time_us
                self._images += 1
                self._first.set()
                self._arrived.set()
            self._ended = "the camera's stream ended"
        except Exception as error:  # whatever a source raises, the flight must hear of it
            self._ended = f"the camera failed: {error or type(error).__name__}"
        self._first.set()
        self._arrived.set()
