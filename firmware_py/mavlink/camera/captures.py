"""A camera's pictures: single ones, series by time and by distance, and a message for each."""

from __future__ import annotations

from collections import OrderedDict
from math import dist, inf

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.camera import messages
from firmware_py.mavlink.camera.model import CAMERA_COMPONENT_ID, CameraModel, CaptureSink
from firmware_py.status import CommandResult
from framerunner.geometry.vectors import Vec3
from framerunner.wire.dialect import Message
from framerunner.wire.exchange import Exchange

MAX_COUNT = 1_000_000
_REMEMBERED = 1000  # pictures whose messages can be requested again
_MAX_INTERVAL_S = 86400.0


class Captures:
    """Takes pictures when they are due and broadcasts a message for each.

    Attributes:
        count: pictures taken since boot, or since the storage was formatted.
        interval_s: of the present series; 0: none.
    """

    def __init__(
        self, autopilot: Autopilot, exchange: Exchange, camera: CameraModel, sink: CaptureSink | None
    ) -> None:
        self._autopilot = autopilot
        self._exchange = exchange
        self._min_interval_s = 1.0 / camera.rate_hz
        self._sink = sink
        self._sent: OrderedDict[int, Message] = OrderedDict()
        self._left = 0.0
        self._due_us = 0
        self._spacing_m = 0.0
        self._last_place_ned_m: Vec3 | None = None
        self.count = 0
        self.interval_s = 0.0

    def start(self, interval_s: float, count: int) -> CommandResult:
        """Take pictures from now on, instead of the present series.

        Args:
            interval_s: between them, in vehicle time; the camera's minimum replaces a smaller one.
            count: of pictures; 0: until stopped.

        Returns:
            ACCEPTED; FAILED if a single picture could not be taken; DENIED for an invalid interval or count.
        """
        if not (0.0 <= interval_s <= _MAX_INTERVAL_S and 0 <= count <= MAX_COUNT):
            return CommandResult.DENIED
        if count == 1:
            return CommandResult.ACCEPTED if self._take() else CommandResult.FAILED
        self.interval_s = max(interval_s, self._min_interval_s)
        self._left = count or inf
        self._due_us = self._exchange.time_us
        return CommandResult.ACCEPTED

    def every(self, spacing_m: float) -> CommandResult:
        """Take a picture each time the vehicle has moved by a distance; 0: no more."""
        if not 0.0 <= spacing_m < inf:
            return CommandResult.DENIED
        self._spacing_m = spacing_m
        self._last_place_ned_m = None
        return CommandResult.ACCEPTED

    def stop(self) -> None:
        """End all series."""
        self.interval_s = 0.0
        self._spacing_m = 0.0

    def forget(self) -> None:
        """End all series and count from 0 again: the storage was formatted."""
        self.stop()
        self._sent.clear()
        self.count = 0

    def sent(self, index: int) -> Message | None:
        """The message of a picture; None if it is too old, or there is no such picture."""
        return self._sent.get(index)

    def update(self) -> None:
        """Take what is due."""
        if self.interval_s > 0.0 and self._exchange.time_us >= self._due_us:
            self._take()
            self._due_us = max(self._due_us + round(self.interval_s * 1e6), self._exchange.time_us)
            self._left -= 1
            if self._left <= 0:
                self.interval_s = 0.0
        if self._spacing_m > 0.0:
            self._take_by_distance()

    def _take_by_distance(self) -> None:
        place = self._autopilot.state.position_ned_m
        last = self._last_place_ned_m
        if last is None or dist(place, last) >= self._spacing_m:
            self._last_place_ned_m = place
            self._take()

    def _take(self) -> bool:
        exchange, index = self._exchange, self.count
        url = "" if self._sink is None else self._sink.capture(exchange.time_us, index)
        message = messages.image_captured(self._autopilot, exchange, index, url)
        if url is not None:
            self.count += 1
            self._sent[index] = message
            if len(self._sent) > _REMEMBERED:
                self._sent.popitem(last=False)
        exchange.broadcast(message, CAMERA_COMPONENT_ID)
        return url is not None
