"""The eyes of a lockstep flight: the simulated camera and the detector, without a link between them."""

from __future__ import annotations

from collections.abc import Callable

from offboard.eyes import CAMERA_DEAD_S, CameraLostError
from scenarios.models import Scenario
from scenarios.truth import TrueState
from sitl.camera_feed import CameraFeed
from vision.detector import detect
from vision.types import Detections, Image

ImageObserver = Callable[[int, Image], None]


class LockstepEyes:
    """Sees each image when the camera's latency is over; fed with the truth of every control tick.

    Args:
        scenario: camera settings and what is to be seen.
        on_image: called with time of exposure (microseconds) and image as each arrives.
    """

    def __init__(self, scenario: Scenario, on_image: ImageObserver | None = None) -> None:
        self._feed = CameraFeed(scenario)
        self._on_image = on_image
        self._arrived: tuple[int, Image] | None = None
        self._image_us = 0
        self._detections = Detections()

    def follow(self, truth: TrueState) -> None:
        """Let the camera take the control tick that has just passed."""
        if truth.time_us < self._feed.next_us:
            return
        arrived = self._feed.step(truth)
        if arrived is not None:
            self._arrived = arrived
            if self._on_image is not None:
                self._on_image(*arrived)

    async def open(self) -> None:
        """Nothing to wait for: images come while the drone gets ready."""

    def latest(self, time_us: int) -> Detections:
        """What the latest image showed; the detector looks only at images that are asked for.

        Args:
            time_us: vehicle time now.

        Raises:
            CameraLostError: the last image is older than a second.
        """
        if self._arrived is not None:
            self._image_us, image = self._arrived
            self._arrived = None
            self._detections = detect(image, self._image_us)
        age_s = (time_us - self._image_us) / 1e6
        if age_s > CAMERA_DEAD_S:
            raise CameraLostError(f"the camera is dead: no image for {age_s:.1f} s")
        return self._detections

    async def close(self) -> None:
        """Nothing to let go of."""
