"""The camera in time: exposures on a grid, each image out a latency later, as real cameras and links are."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

from scenarios.models import Scenario, TrueState
from sitl.camera import Camera, Image
from sitl.solids import Solid

FIRST_EXPOSURE_US = 36_000


class CameraFeed:
    """Takes images at the camera's rate and hands each out when its latency is over.

    Exposures are on a grid of the camera's period that begins 36 ms after the clock, each once; a rate
    above the control rate gives one image a tick. The navigator's ticks, 50 ms apart, begin with the clock:
    with the default latency an image is out 14 ms before one. That is fresh, which the paper's navigator
    needs to keep its height before a frame, and still no race between video and telemetry.

    Args:
        scenario: camera settings and what is to be seen.
        drones: asked at each exposure for the boxes of other drones.

    Attributes:
        next_us: before this time there is nothing to do.
    """

    def __init__(self, scenario: Scenario, drones: Callable[[], Sequence[Solid]] = tuple) -> None:
        self._camera = Camera(scenario)
        self._drones = drones
        self._period_us = 1e6 / scenario.camera.rate_hz
        self._latency_us = round(scenario.camera.latency_s * 1e6)
        self._taken = 0
        self.next_us = 0
        self._on_its_way: deque[tuple[int, Image]] = deque()

    def step(self, truth: TrueState) -> tuple[int, Image] | None:
        """Take the image that is due at this tick, and return the one that arrives.

        Args:
            truth: where the camera is.

        Returns:
            Time of exposure, microseconds, and the image; None if none arrives at this tick.
        """
        if truth.time_us < self.next_us:
            return None
        index = int((truth.time_us - FIRST_EXPOSURE_US) // self._period_us)
        if index >= self._taken:
            self._taken = index + 1
            image = self._camera.render(truth.position_arena_m, truth.attitude_arena, self._drones())
            self._on_its_way.append((truth.time_us, image))
        arrived = None
        if self._on_its_way and self._on_its_way[0][0] + self._latency_us <= truth.time_us:
            arrived = self._on_its_way.popleft()
        self.next_us = int(FIRST_EXPOSURE_US + self._taken * self._period_us)
        if self._on_its_way:
            self.next_us = min(self.next_us, self._on_its_way[0][0] + self._latency_us)
        return arrived
