"""A recorded flight, read once and kept, so that its events can be read in any order."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from tempfile import TemporaryFile
from typing import BinaryIO, cast

import cv2
import numpy as np

from framerunner.recording.events import Crossed, Recorded, RecordedImage, RecordingError, TruePlace
from framerunner.recording.tlog_reader import MAX_TICKS, TlogRecording, motors_on_us
from offboard.app import Moment
from scenarios.result import FlightResult
from vision.types import Image

JPEG_QUALITY = 90
_MAX_IMAGES_BYTES = 2_000_000_000


class ImageFile:
    """The images of a flight, compressed, in a file: they may not fit into memory.

    Args:
        file: opened for reading and writing; closed with this. By default a temporary one.

    Attributes:
        time_us: vehicle time of each image, microseconds, not decreasing.
        spans: offset and length of each image in the file, bytes.
    """

    def __init__(self, file: BinaryIO | None = None) -> None:
        if file is None:
            file = cast(BinaryIO, TemporaryFile(prefix="framerunner-"))  # noqa: SIM115 - `close` closes it
        self._file = file
        self._end = 0
        self.time_us: list[int] = []
        self.spans: list[tuple[int, int]] = []

    def __len__(self) -> int:
        return len(self.spans)

    def add(self, recorded: RecordedImage) -> None:
        """Add an image.

        Raises:
            RecordingError: it cannot be written.
        """
        if self._end > _MAX_IMAGES_BYTES:
            raise RecordingError(f"recording: more than {_MAX_IMAGES_BYTES // 1_000_000_000} GB of images")
        done, data = cv2.imencode(".jpg", recorded.image, (cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY))
        if not done:
            raise RecordingError("recording: an image cannot be compressed")
        try:
            self._file.seek(self._end)
            self._file.write(data.tobytes())
        except OSError as error:
            raise RecordingError(f"recording: no room to unpack its images: {error.strerror}") from None
        self.time_us.append(recorded.time_us)
        self.spans.append((self._end, len(data)))
        self._end += len(data)

    def image(self, index: int) -> Image:
        """An image, BGR, shape (height, width, 3), uint8."""
        start, length = self.spans[index]
        self._file.seek(start)
        decoded = cv2.imdecode(np.frombuffer(self._file.read(length), np.uint8), cv2.IMREAD_COLOR)
        return np.asarray(decoded, np.uint8)

    def latest_at(self, time_us: int) -> int | None:
        """Index of the last image taken at this time or before; None if there is none."""
        number = bisect_right(self.time_us, time_us)
        return number - 1 if number else None

    def close(self) -> None:
        """Close the file."""
        self._file.close()


@dataclass(frozen=True, slots=True)
class CollectedFlight:
    """A complete flight; as a context, closes its images.

    Attributes:
        title: what was flown, for people.
        result: None if the flight left none.
        moments: every tick, in order of time; at least one.
        images: of the camera.
        crossings: of gates, in order of time.
        true_path: where a simulated drone truly was, likewise; empty if that is not known.
        began_us: vehicle time of motors on, from which the referee counts, microseconds; of the first
            tick if the motors were never on.
        mission_is_known: whether states and commands are the mission's; a MAVLink log contains neither.
    """

    title: str
    result: FlightResult | None
    moments: tuple[Moment, ...]
    images: ImageFile
    crossings: tuple[Crossed, ...]
    true_path: tuple[TruePlace, ...]
    began_us: int
    mission_is_known: bool

    def __enter__(self) -> CollectedFlight:
        return self

    def __exit__(self, *_error: object) -> None:
        self.images.close()


def collect(recorded: Recorded, images: ImageFile | None = None) -> CollectedFlight:
    """Read a flight to its end, its images by default into a temporary file.

    Raises:
        RecordingError: it is damaged, holds no telemetry, or there is no room for its images.
    """
    images = ImageFile() if images is None else images
    moments: list[Moment] = []
    crossings: list[Crossed] = []
    true_path: list[TruePlace] = []
    for event in recorded.events():
        if isinstance(event, Moment):
            moments.append(event)
            if len(moments) > MAX_TICKS:
                raise RecordingError(
                    f"recording '{recorded.title}': longer than eight hours; it must be damaged"
                )
        elif isinstance(event, RecordedImage):
            images.add(event)
        elif isinstance(event, TruePlace):
            true_path.append(event)
        else:
            crossings.append(event)
    if not moments:
        raise RecordingError(f"recording '{recorded.title}': holds no telemetry; nothing can be shown")
    result = recorded.result
    began_us = _began_us(moments, crossings, {} if result is None else result.times_s)
    is_known = not isinstance(recorded, TlogRecording)
    return CollectedFlight(
        recorded.title,
        result,
        tuple(moments),
        images,
        tuple(crossings),
        tuple(true_path),
        began_us,
        is_known,
    )


def _began_us(moments: list[Moment], crossings: list[Crossed], times_s: dict[str, float]) -> int:
    """When the motors went on: by the referee's time of the first crossing, else by the mission's time."""
    if crossings and crossings[0].colour in times_s:
        return crossings[0].time_us - round(times_s[crossings[0].colour] * 1e6)
    return motors_on_us(moments)
