"""A camera's pictures and recordings of video: single ones and series, and a message for each."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from math import dist, inf

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.camera import camera_messages
from firmware_py.mavlink.camera.model import CAMERA_COMPONENT_ID, CaptureSink, FixedCamera
from firmware_py.missions.flight import SevenParams
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
        self, autopilot: Autopilot, exchange: Exchange, camera: FixedCamera, sink: CaptureSink | None
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
        message = camera_messages.image_captured(self._autopilot, exchange, index, url)
        if url is not None:
            self.count += 1
            self._sent[index] = message
            if len(self._sent) > _REMEMBERED:
                self._sent.popitem(last=False)
        exchange.broadcast(message, CAMERA_COMPONENT_ID)
        return url is not None


_MIN_REPORT_S = 0.1


class Recordings:
    """Starts and stops recordings.

    Args:
        exchange: for vehicle time.
        sink: records; None: nothing does.
        report: called when recording begins or ends, and while it lasts as often as the command wanted.

    Attributes:
        can_record: whether there is a recorder.
    """

    def __init__(self, exchange: Exchange, sink: CaptureSink | None, report: Callable[[], None]) -> None:
        self._exchange = exchange
        self._sink = sink
        self._report = report
        self._count = 0
        self._began_us: int | None = None
        self._report_s = inf
        self._report_due_us = 0
        self.can_record = sink is not None and sink.can_record

    @property
    def recorded_us(self) -> int | None:
        """For how long the present recording has lasted, vehicle time; None: there is none."""
        return None if self._began_us is None else self._exchange.time_us - self._began_us

    def start(self, params: SevenParams) -> CommandResult:
        """VIDEO_START_CAPTURE: param 2 is the rate of reports in Hz, 0: none; a second start changes it only.

        FAILED: it cannot be recorded, as there is no image yet or no room.
        """
        if self._sink is None or not self.can_record:
            return CommandResult.UNSUPPORTED
        if self._began_us is None:
            if not self._sink.start_video(self._count):
                return CommandResult.FAILED
            self._count += 1
            self._began_us = self._exchange.time_us
        rate_hz = params[1]
        self._report_s = max(1.0 / rate_hz, _MIN_REPORT_S) if 0.0 < rate_hz < inf else inf
        self._tell()
        return CommandResult.ACCEPTED

    def stop(self, _params: SevenParams) -> CommandResult:
        """VIDEO_STOP_CAPTURE; it is accepted too when nothing is recorded."""
        if self._sink is None or not self.can_record:
            return CommandResult.UNSUPPORTED
        if self._began_us is not None:
            self._sink.stop_video()
            self._end()
        return CommandResult.ACCEPTED

    def update(self) -> None:
        """Report when that is due, and when the recorder has stopped by itself."""
        if self._began_us is None or self._sink is None:
            return
        if not self._sink.is_recording:
            self._end()
        elif self._exchange.time_us >= self._report_due_us:
            self._tell()

    def _end(self) -> None:
        self._began_us = None
        self._report()

    def _tell(self) -> None:
        wait_s = self._report_s
        self._report_due_us = (1 << 62) if wait_s == inf else self._exchange.time_us + round(wait_s * 1e6)
        self._report()
