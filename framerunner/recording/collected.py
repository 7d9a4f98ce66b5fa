"""A recorded flight, read once and kept whole: for those who go to and fro in it."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from math import ceil
from tempfile import TemporaryFile
from types import TracebackType
from typing import BinaryIO, cast

import cv2
import numpy as np

from framerunner.recording.errors import RecordingError
from framerunner.recording.events import Crossed, Picture, Recorded
from framerunner.recording.tlog_reader import TlogRecording
from offboard.app import Moment
from scenarios.result import FlightResult
from vision.types import Image

JPEG_QUALITY = 90
_TICKS_AT_MOST = 576_000  # eight hours: a file that claims more is damaged
_MAX_IMAGES_BYTES = 2_000_000_000


class ImageFile:
    """The images of a flight, compressed, in a file of their own: there may be more than memory holds.

    Args:
        file: opened for reading and writing; closed with this. By default one that vanishes.

    Attributes:
        time_us: vehicle time of each image, microseconds, not decreasing.
        spans: where each begins in the file, and how long it is, bytes.
    """

    def __init__(self, file: BinaryIO | None = None) -> None:
        if file is None:
            file = cast(BinaryIO, TemporaryFile(prefix="framerunner-"))  # noqa: SIM115 - `close` closes it
        self._file = file
        self._end = 0
        self.time_us: list[int] = []
        self.spans: list[tuple[int, int]] = []

    def __len__(self) -> int:
        """How many images there are."""
        return len(self.spans)

    def add(self, picture: Picture) -> None:
        """Keep an image.

        Raises:
            RecordingError: it cannot be written.
        """
        if self._end > _MAX_IMAGES_BYTES:
            raise RecordingError(f"recording: more than {_MAX_IMAGES_BYTES // 1_000_000_000} GB of images")
        done, data = cv2.imencode(".jpg", picture.image, (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))
        if not done:
            raise RecordingError("recording: an image cannot be compressed")
        try:
            self._file.seek(self._end)
            self._file.write(data.tobytes())
        except OSError as error:
            raise RecordingError(f"recording: no room to unpack its images: {error.strerror}") from None
        self.time_us.append(picture.time_us)
        self.spans.append((self._end, len(data)))
        self._end += len(data)

    def jpeg(self, index: int) -> bytes:
        """One of the images."""
        start, length = self.spans[index]
        self._file.seek(start)
        return self._file.read(length)

    def image(self, index: int) -> Image:
        """One of the images, BGR, shape (height, width, 3), uint8."""
        decoded = cv2.imdecode(np.frombuffer(self.jpeg(index), np.uint8), cv2.IMREAD_COLOR)
        return np.asarray(decoded, np.uint8)

    def latest_at(self, time_us: int) -> int | None:
        """The last image taken at a time or before; None if there is none."""
        number = bisect_right(self.time_us, time_us)
        return number - 1 if number else None

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()


@dataclass(frozen=True, slots=True)
class CollectedFlight:
    """All of a flight.

    Attributes:
        title: what was flown, for people.
        result: None if the flight left none.
        moments: every tick, in order of time; at least one.
        images: of the camera.
        crossings: of frames, in order of time.
        began_us: vehicle time of motors on, from which the referee counts, microseconds; of the first
            tick if the motors were never on.
        mission_is_known: whether states and commands are the mission's; a MAVLink log knows neither.
    """

    title: str
    result: FlightResult | None
    moments: tuple[Moment, ...]
    images: ImageFile
    crossings: tuple[Crossed, ...]
    began_us: int
    mission_is_known: bool

    def __enter__(self) -> CollectedFlight:
        """Have it until the end of the block."""
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        """Let go of the images."""
        self.images.close()


def collect(recorded: Recorded, images: ImageFile | None = None) -> CollectedFlight:
    """Read a flight to its end.

    Args:
        recorded: the flight.
        images: where to keep its images; by default in a file that vanishes.

    Raises:
        RecordingError: it is damaged, holds no telemetry, or there is no room for its images.
    """
    images = ImageFile() if images is None else images
    moments: list[Moment] = []
    crossings: list[Crossed] = []
    for event in recorded.events():
        if isinstance(event, Moment):
            moments.append(event)
            if len(moments) > _TICKS_AT_MOST:
                raise RecordingError(
                    f"recording '{recorded.title}': longer than eight hours; it must be damaged"
                )
        elif isinstance(event, Picture):
            images.add(event)
        else:
            crossings.append(event)
    if not moments:
        raise RecordingError(f"recording '{recorded.title}': holds no telemetry; nothing can be shown")
    began_us = _began(moments, crossings, recorded.result)
    crossings = crossings or _crossings_of(recorded.result, began_us)
    known = not isinstance(recorded, TlogRecording)
    return CollectedFlight(
        recorded.title, recorded.result, tuple(moments), images, tuple(crossings), began_us, known
    )


def _began(moments: list[Moment], crossings: list[Crossed], result: FlightResult | None) -> int:
    """When the motors went on: by the referee's own clock if crossings tell it, else by the mission's."""
    times_s = {} if result is None else result.times_s
    if crossings and crossings[0].colour in times_s:
        return crossings[0].time_us - round(times_s[crossings[0].colour] * 1e6)
    for moment in moments:
        if moment.flight_time_s > 0.0:
            return moment.state.time_us - round(moment.flight_time_s * 1e6)
    return moments[0].state.time_us


def _crossings_of(result: FlightResult | None, began_us: int) -> list[Crossed]:
    times_s = {} if result is None else result.times_s
    return [Crossed(began_us + ceil(time_s * 1e6), colour) for colour, time_s in times_s.items()]
