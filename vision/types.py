"""What vision gives to the navigator."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf

import numpy as np
import numpy.typing as npt

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
        time_us: vehicle time of the image, microseconds; None where the source does not tell.
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
        time_us: vehicle time of its exposure, microseconds; None where the source does not tell.
        received_s: monotonic wall time of its arrival, seconds.
        jpeg: the compressed image as received, if it was; for recording without compressing again.
    """

    image: Image
    time_us: int | None
    received_s: float
    jpeg: bytes | None = field(default=None, repr=False)
