"""Measures a camera for some seconds: rate, gaps and age of its images; what is known of its calibration."""

from __future__ import annotations

import asyncio
import contextlib
from dataclasses import dataclass
from datetime import date
from itertools import pairwise
from statistics import median

from framerunner.camera_calibration.camera_delay import CameraDelay, delay_of
from offboard.safety.check import Check
from offboard.safety.vehicle_checks import (
    CameraFacts,
    calibration_checks,
    camera_checks,
)
from vision.calibration.model import Calibration
from vision.sources import open_source
from vision.types import CameraError

_FIRST_S = 5.0
LOOK_S = 3.0
"""For how long images are received."""


@dataclass(frozen=True, slots=True)
class CameraTimes:
    """When images arrived, and their own time stamps where they have one.

    Attributes:
        received_s: monotonic wall time of each arrival.
        stamps_us: vehicle time at which each image was exposed; None: not told.
        size_px: width and height.
        problem: why there are no images; empty if there are some.
    """

    received_s: tuple[float, ...] = ()
    stamps_us: tuple[int | None, ...] = ()
    size_px: tuple[int, int] = (0, 0)
    problem: str = ""

    def facts(self, clock_ms: tuple[int, float] | None, delay: CameraDelay) -> CameraFacts:
        """What the checks need.

        Args:
            clock_ms: vehicle time in milliseconds at a monotonic wall time, seconds; None: not known.
            delay: of an image without a time stamp.
        """
        if self.problem:
            return CameraFacts(problem=self.problem)
        gaps = [after - before for before, after in pairwise(self.received_s)]
        if not gaps:
            return CameraFacts(problem="it gave only one image")
        span_s = self.received_s[-1] - self.received_s[0]
        ages = [
            at - (clock_ms[1] + (stamp / 1000 - clock_ms[0]) / 1000)
            for at, stamp in zip(self.received_s, self.stamps_us, strict=True)
            if stamp is not None and clock_ms is not None
        ]
        age_s = median(ages) if ages else float("nan")
        return CameraFacts(
            len(gaps) / span_s,
            max(gaps),
            age_s,
            any(stamp is not None for stamp in self.stamps_us),
            delay.age_s,
            delay.measured_by,
            self.size_px,
        )


async def measure_camera(url: str, seconds: float, size_px: tuple[int, int] | None = None) -> CameraTimes:
    """Watch a camera for some seconds of wall time after its first image."""
    received: list[float] = []
    stamps: list[int | None] = []
    size = (0, 0)
    try:
        async with open_source(url, size_px=size_px) as source:
            frames = source.frames()
            loop = asyncio.get_running_loop()
            end_s = loop.time() + _FIRST_S
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout_at(end_s) as limit:
                    async for frame in frames:
                        if not received:
                            limit.reschedule(loop.time() + seconds)
                            size = (frame.image.shape[1], frame.image.shape[0])
                        received.append(frame.received_s)
                        stamps.append(frame.time_us)
    except CameraError as error:
        return CameraTimes(problem=str(error))
    if not received:
        return CameraTimes(problem=f"no image within {_FIRST_S:g} s")
    return CameraTimes(tuple(received), tuple(stamps), size)


def examine_camera(
    times: CameraTimes | None, calibration: Calibration | None, clock_ms: tuple[int, float] | None
) -> list[Check]:
    """What was measured of the camera, and whether its lens, mounting and delay are known.

    Args:
        times: of its images; None: no camera was given.
        calibration: None: none was given.
        clock_ms: vehicle time in milliseconds at a monotonic wall time, seconds; None: not known.
    """
    checks: list[Check] = []
    if times is not None:
        checks += camera_checks(times.facts(clock_ms, delay_of(None, calibration)))
    size_px = (0, 0) if times is None else times.size_px
    return checks + calibration_checks(calibration, size_px, days_since)


def days_since(day: str | None) -> int | None:
    """Days from a day, year-month-day, to today; None: there is no such day."""
    with contextlib.suppress(ValueError):  # such as the 30th of February
        if day is not None:
            return (date.today() - date.fromisoformat(day)).days
    return None
