"""Images, camera sources and detections."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from math import inf
from typing import Protocol, Self
from urllib.parse import urlsplit

import numpy as np
import numpy.typing as npt

from errors import UserError

Image = npt.NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Detection:
    """The paper's six numbers of one colour; the defaults mean "not seen".

    Attributes:
        n: upper edge of its bounding box, pixels above the image centre.
        s: lower edge, pixels above the centre.
        e: right edge, pixels right of the centre.
        w: left edge, pixels right of the centre.
        d: distance, metres; +inf unless the whole frame is in view.
        a: unsigned angle between line of sight and the frame's normal, degrees; +inf unless whole.
    """

    n: float = -inf
    s: float = inf
    e: float = -inf
    w: float = inf
    d: float = inf
    a: float = inf

    @property
    def seen(self) -> bool:
        """Whether any pixel of the colour was seen."""
        return self.n > -inf


NOT_SEEN = Detection()


@dataclass(frozen=True, slots=True)
class Detections:
    """What one image showed.

    Attributes:
        time_us: vehicle time of the image, microseconds; None if the source does not send it.
    """

    red: Detection = NOT_SEEN
    green: Detection = NOT_SEEN
    blue: Detection = NOT_SEEN
    time_us: int | None = None


@dataclass(frozen=True, slots=True)
class CameraFrame:
    """One image of a camera source.

    Attributes:
        image: BGR, shape (height, width, 3), uint8.
        time_us: vehicle time of its exposure, microseconds; None if the source does not send it.
        received_s: monotonic wall time of its arrival, seconds.
        jpeg: the compressed image as received, if it was; for recording without compressing again.
    """

    image: Image
    time_us: int | None
    received_s: float
    jpeg: bytes | None = field(default=None, repr=False)


class CameraError(UserError):
    """A camera cannot be opened or has failed; the message is one line that names it."""


class CameraSource(Protocol):
    """A camera: `async with source: async for frame in source.frames()`.

    A live source gives the latest image, however long the consumer took. `__aenter__` and `frames` raise
    `CameraError` if the camera cannot be opened or fails.

    Attributes:
        bad_frames: images skipped so far because they could not be decoded.
    """

    bad_frames: int

    async def __aenter__(self) -> Self:
        """Open the camera."""
        ...

    async def __aexit__(self, *exc_info: object) -> None:
        """Close it."""

    def frames(self) -> AsyncIterator[CameraFrame]:
        """Images in order of arrival."""
        ...


def shown_url(url: str) -> str:
    """A URL for messages: without its password, on one line, at most 120 characters."""
    text = url
    try:
        parts = urlsplit(url)
        if parts.password is not None:
            text = url.replace(f":{parts.password}@", ":***@", 1)
    except ValueError:
        pass  # not a URL; shown as it is
    text = text.encode("unicode_escape").decode("ascii")
    return text if len(text) <= 120 else text[:117] + "..."
