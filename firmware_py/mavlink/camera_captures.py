"""Pictures of a camera: single ones, series in time, series by distance."""

from __future__ import annotations

from collections import OrderedDict
from math import dist, inf, isfinite

from firmware_py.mavlink import camera_messages
from firmware_py.mavlink.camera_model import CAMERA_COMPONENT_ID, CameraModel, CaptureSink
from firmware_py.mavlink.exchange import Exchange
from firmware_py.status import CommandResult
from geometry.vectors import Vec3
from wire.dialect import Message

_REMEMBERED = 1000  # pictures that can be told again
_LONGEST_S = 86400.0
_MOST = 1_000_000


class Captures:
    """Takes pictures when they are due and tells everybody.

    Attributes:
        count: pictures taken since boot.
        interval_s: of the series under way; 0: none.
    """

    def __init__(self, exchange: Exchange, camera: CameraModel, sink: CaptureSink) -> None:
        self._exchange = exchange
        self._shortest_s = 1.0 / camera.rate_hz
        self._sink = sink
        self._told: OrderedDict[int, Message] = OrderedDict()
        self._left = 0.0
        self._due_us = 0
        self._spacing_m = 0.0
        self._last_place_ned_m: Vec3 | None = None
        self.count = 0
        self.interval_s = 0.0

    def start(self, interval_s: float, count: int) -> CommandResult:
        """Take pictures from now on, instead of a series under way.

        Args:
            interval_s: between them, in vehicle time; not less than the camera needs.
            count: how many; 0: until stopped.

        Returns:
            ACCEPTED; FAILED if the one picture could not be taken; DENIED for a time or count that is none.
        """
        if not (0.0 <= interval_s <= _LONGEST_S and 0 <= count <= _MOST):
            return CommandResult.DENIED
        if count == 1:
            return CommandResult.ACCEPTED if self._take() else CommandResult.FAILED
        self.interval_s = max(interval_s, self._shortest_s)
        self._left = count or inf
        self._due_us = self._exchange.time_us
        return CommandResult.ACCEPTED

    def every(self, spacing_m: float) -> CommandResult:
        """Take a picture each time the vehicle has gone so far; 0: no more."""
        if not 0.0 <= spacing_m < inf:
            return CommandResult.DENIED
        self._spacing_m = spacing_m
        self._last_place_ned_m = None
        return CommandResult.ACCEPTED

    def stop(self) -> None:
        """End all series."""
        self.interval_s = 0.0
        self._spacing_m = 0.0

    def told(self, index: int) -> Message | None:
        """What was told of a picture; None if that is forgotten, or there is none."""
        return self._told.get(index)

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
        place = self._exchange.autopilot.state.position_ned_m
        last = self._last_place_ned_m
        if last is None or dist(place, last) >= self._spacing_m:
            self._last_place_ned_m = place
            self._take()

    def _take(self) -> bool:
        exchange, index = self._exchange, self.count
        url = self._sink.capture(exchange.time_us, index)
        message = camera_messages.image_captured(exchange, index, url)
        if url is not None:
            self.count += 1
            self._told[index] = message
            if len(self._told) > _REMEMBERED:
                self._told.popitem(last=False)
        exchange.broadcast(message, CAMERA_COMPONENT_ID)
        return url is not None


def whole_count(number: float) -> int:
    """A count as commands carry it; -1 for what is none."""
    return int(number) if isfinite(number) and 0.0 <= number <= _MOST else -1
