"""A camera's recordings of video, and the reports while one lasts."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from firmware_py.mavlink.camera.model import CaptureSink
from firmware_py.missions.flight import SevenParams
from firmware_py.status import CommandResult
from framerunner.wire.exchange import Exchange

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
