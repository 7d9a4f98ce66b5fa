"""The latest detections of a camera's images, and an error when the camera is lost."""

from __future__ import annotations

import asyncio
import contextlib
from collections import deque
from collections.abc import AsyncIterator, Callable
from typing import Protocol

from framerunner.errors import UserError
from framerunner.wire.vehicle_telemetry import MessageOrder
from vision.base.detector import BaseExpectations, expect_base
from vision.detectors import Detector, new_detector
from vision.types import CameraFrame, Detections

CAMERA_DEAD_S = 1.0
FIRST_IMAGE_S = 5.0
IMAGES_KEPT = 16  # until they are taken


class CameraLostError(UserError):
    """There are no fresh images; the message is one line for people."""


class CameraSilentError(CameraLostError):
    """The latest image is too old, by `age_s`; another one may still come."""

    def __init__(self, age_s: float) -> None:
        super().__init__(f"the camera is dead: no image for {age_s:.1f} s")
        self.age_s = age_s


class ImageSource(Protocol):
    """A source of images, such as an open `vision.types.CameraSource`."""

    def frames(self) -> AsyncIterator[CameraFrame]:
        """Images in order of arrival."""
        ...


class Perception(Protocol):
    """What a flight needs of vision."""

    async def open(self) -> None:
        """Wait until there are detections; raises `CameraLostError`."""

    def latest(self, time_us: int) -> Detections:
        """What the latest image that was processed showed.

        Raises:
            CameraSilentError: the latest image is too old at this vehicle time.
            CameraLostError: no other one will come.
        """
        ...

    def take(self) -> tuple[Detections, ...]:
        """What each image processed since the last call showed, oldest first.

        Of many only the last `IMAGES_KEPT`. Call it after `latest`, whose image belongs to them.
        """
        ...

    def space_images(self, period_s: float) -> None:
        """From now on process at most one image in this time, vehicle time; 0: all of them.

        An image that is not processed still shows that the camera is alive.
        """

    def expect_base(self, expected: BaseExpectations) -> None:
        """Say where in an image the base is to be looked for."""

    async def close(self) -> None:
        """Release the camera."""


class ImageChoice:
    """Which images are processed: no more than one in a period, by their own time stamps.

    Attributes:
        period_s: of vehicle time; 0: all images.
    """

    def __init__(self) -> None:
        self.period_s = 0.0
        self._chosen_us: int | None = None

    def takes(self, time_us: int | None) -> bool:
        """Whether to process an image exposed at this vehicle time; one without a time always is."""
        last_us = self._chosen_us
        if time_us is not None:
            if last_us is not None and 0 <= time_us - last_us < self.period_s * 1e6:
                return False
            self._chosen_us = time_us
        return True


class CameraPerception:
    """Runs the detector on each image as it arrives and keeps the last result.

    The age of an image counts vehicle time: from its own time stamp if the source gives one, because an image
    that waited in a buffer is old; otherwise from the time that `assume_times` gives it or, without that,
    from the tick after its arrival.

    Args:
        camera: gives the images.
        detector: by default the paper's.
        patient: vehicle time waits for the images, so at the start none is waited for.

    Attributes:
        oldest_s: age of the oldest image that was used, seconds.
    """

    def __init__(
        self, camera: ImageSource, detector: Detector | None = None, *, patient: bool = False
    ) -> None:
        self.oldest_s = 0.0
        self._patient = patient
        self._camera = camera
        self._detector = detector or new_detector("boxes")
        self._detections = Detections()
        self._untaken: deque[Detections] = deque(maxlen=IMAGES_KEPT)
        self._choice = ImageChoice()
        self._image_us: int | None = None
        self._vehicle_time_us: Callable[[float], int | None] = lambda _wall_s: None
        self._delay_us = 0
        self._order = MessageOrder()
        self._images = 0
        self._images_used = 0
        self._arrived = asyncio.Event()
        self._used_us = 0
        self._ended = ""
        self._task: asyncio.Task[None] | None = None

    def assume_times(self, vehicle_time_us: Callable[[float], int | None], delay_s: float) -> None:
        """Give images without time stamps the vehicle time at which they arrived, less a fixed delay.

        Args:
            vehicle_time_us: vehicle time at a monotonic wall time; None if it is not known.
            delay_s: from exposure to arrival.
        """
        self._vehicle_time_us = vehicle_time_us
        self._delay_us = round(delay_s * 1e6)

    async def open(self) -> None:
        """Wait for the first image; raises `CameraLostError` if there is none."""
        self._task = asyncio.create_task(self._watch(), name="camera")
        if self._patient:
            return
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(FIRST_IMAGE_S):
                await self._arrived.wait()
        if not self._images:
            raise CameraLostError(self._ended or f"the camera gave no image within {FIRST_IMAGE_S:g} s")

    def latest(self, time_us: int) -> Detections:
        """What the latest image showed; `CameraLostError` if the camera ended or failed, or it is too old."""
        if self._images != self._images_used:
            self._images_used = self._images
            self._used_us = time_us if self._image_us is None else self._image_us
        if self._ended:
            raise CameraLostError(self._ended)
        age_s = (time_us - self._used_us) / 1e6
        self.oldest_s = max(self.oldest_s, age_s)
        if age_s > CAMERA_DEAD_S:
            raise CameraSilentError(age_s)
        return self._detections

    def take(self) -> tuple[Detections, ...]:
        """What each image since the last call showed."""
        taken = tuple(self._untaken)
        self._untaken.clear()
        return taken

    def space_images(self, period_s: float) -> None:
        """From now on process at most one image in this time, vehicle time; 0: all of them."""
        self._choice.period_s = period_s

    def expect_base(self, expected: BaseExpectations) -> None:
        """Say where in an image the base is to be looked for."""
        expect_base(self._detector, expected)

    async def seen(self, image_us: int, limit_s: float) -> bool:
        """Wait until the image exposed at a vehicle time, or a later one, has been processed or left out.

        False if it was not within `limit_s` of wall time, or the camera has failed.
        """
        if image_us < 0:  # there is none yet
            return True
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(limit_s):
                while not self._ended and (self._image_us is None or self._image_us < image_us):
                    self._arrived.clear()
                    await self._arrived.wait()
        return self._image_us is not None and self._image_us >= image_us

    async def close(self) -> None:
        """Stop reading the camera."""
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
                time_us = frame.time_us if frame.time_us is not None else self._assumed_us(frame.received_s)
                if self._choice.takes(time_us):
                    self._detections = self._detector(frame.image, time_us)
                    self._untaken.append(self._detections)
                self._image_us = time_us
                self._images += 1
                self._arrived.set()
            self._ended = "the camera's stream ended"
        except Exception as error:  # whatever a source raises must end the flight
            self._ended = f"the camera failed: {error or type(error).__name__}"
        self._arrived.set()

    def _assumed_us(self, received_s: float) -> int | None:
        arrived_us = self._vehicle_time_us(received_s)
        return None if arrived_us is None else max(0, arrived_us - self._delay_us)
