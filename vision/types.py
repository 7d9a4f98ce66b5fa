"""Images, camera sources and detections."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from math import inf
from typing import Annotated, Literal, Protocol, Self
from urllib.parse import urlsplit

import numpy as np
import numpy.typing as npt
from pydantic import Field
from pydantic.config import JsonDict

from framerunner.errors import UserError
from framerunner.geometry.vectors import Quaternion, Vec3

Image = npt.NDArray[np.uint8]
Vision = Literal["boxes", "frames"]
"""How gates are detected: the paper's box of each colour, or by contour and shape."""
M: JsonDict = {"unit": "m"}
PX: JsonDict = {"unit": "px"}
DEG: JsonDict = {"unit": "deg"}


@dataclass(frozen=True, slots=True)
class Detection:
    """The paper's six numbers of one colour; the defaults mean "not seen"."""

    n: Annotated[
        float,
        Field(description="upper edge of its bounding box, above the image's centre", json_schema_extra=PX),
    ] = -inf
    s: Annotated[float, Field(description="lower edge, above the centre", json_schema_extra=PX)] = inf
    e: Annotated[float, Field(description="right edge, right of the centre", json_schema_extra=PX)] = -inf
    w: Annotated[float, Field(description="left edge, right of the centre", json_schema_extra=PX)] = inf
    d: Annotated[
        float,
        Field(description="distance; infinite unless the whole frame is in view", ge=0, json_schema_extra=M),
    ] = inf
    a: Annotated[
        float,
        Field(
            description="angle between line of sight and the frame's normal, without a sign; "
            "infinite unless the whole frame is in view",
            ge=0,
            json_schema_extra=DEG,
        ),
    ] = inf
    signed_a: Annotated[
        float,
        Field(
            description="that angle, positive if flying left makes it smaller; infinite if not known",
            json_schema_extra=DEG,
        ),
    ] = inf

    @property
    def seen(self) -> bool:
        """Whether any pixel of the colour was seen."""
        return self.n > -inf


NOT_SEEN = Detection()


@dataclass(frozen=True, slots=True)
class GateCorner:
    """A corner of a gate's outer outline: pixels from the optical axis, with standard deviations.

    It is the corner of the rectangle in the gate's middle plane, 0.42 x 0.22 m, half the bars' depth behind
    their front.
    """

    right_px: float
    down_px: float
    std_right_px: float
    std_down_px: float


@dataclass(frozen=True, slots=True)
class GatePose:
    """A pose of a gate that explains its outline, in the camera's axes: forward, left, up."""

    position_flu_m: Vec3  # from the camera to the opening's centre
    normal_flu: Vec3  # unit vector, perpendicular to the opening, on the side from which it is seen
    error_px: float  # root mean square of the distances between the outline and the pose's


@dataclass(frozen=True, slots=True)
class GateSighting:
    """One gate in one image."""

    colour: str  # red, green, blue, or the colour of a gate that is no part of the task
    corners: tuple[GateCorner | None, GateCorner | None, GateCorner | None, GateCorner | None]
    """Upper left, upper right, lower right and lower left as seen; None if it is not sure where one is.

    A corner that is hidden or outside the image is sure where two sides that are seen lead to it.
    """
    whole: bool  # nothing of it is hidden or outside the image
    poses: tuple[GatePose, ...]  # none if too little is seen; else one or two, the better one first


@dataclass(frozen=True, slots=True)
class ObstacleEdge:
    """The lower end of an obstacle in one column of the image, pixels from the optical axis.

    An obstacle stands on the floor, so this is where its column of the image meets the floor.
    """

    right_px: float
    down_px: float
    cut: bool  # where it meets the floor is not seen: below the image, hidden, or past a side of it


@dataclass(frozen=True, slots=True)
class BaseExpectation:
    """Where the camera is expected to be when an image is exposed, in the base's axes.

    These are x and y along its edges, z up, with the origin on the floor under its centre.
    """

    eye_m: Vec3
    attitude: Quaternion  # (w, x, y, z), from the camera's axes forward, left, up to the base's
    eye_std_m: Vec3  # standard deviations along x, y, z
    heading_std_rad: float  # of the turn about z


@dataclass(frozen=True, slots=True, eq=False)
class BaseSighting:
    """Corners of the base in one image. Compare by identity: its arrays have no order.

    Attributes:
        points_m: in the base's axes, shape (n, 3).
        pixels: right of and below the optical axis of an ideal camera, shape (n, 2). A corner may be outside
            the image, where the edges that lead to it meet.
        covariance_px2: of all coordinates, in the order of `pixels.ravel()`, shape (2 n, 2 n). Where only one
            edge that leads to a corner is seen, its variance along that edge is large.
        score: the share of its outline that is seen, 0 to 1.
    """

    points_m: npt.NDArray[np.float64]
    pixels: npt.NDArray[np.float64]
    covariance_px2: npt.NDArray[np.float64]
    score: float


@dataclass(frozen=True, slots=True, eq=False)
class PointTracks:
    """Points that are followed from image to image, in one of them. Compare by identity: it has arrays.

    Attributes:
        numbers: of the points, each its own from its first image to its last, shape (n,).
        pixels: right of and below the optical axis of an ideal camera, shape (n, 2).
        rows_px: in the image as it is, below its middle: when they are read out, shape (n,).
    """

    numbers: npt.NDArray[np.int64]
    pixels: npt.NDArray[np.float64]
    rows_px: npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Detections:
    """What one image showed."""

    red: Annotated[Detection, Field(description="the red frame")] = NOT_SEEN
    green: Annotated[Detection, Field(description="the green frame")] = NOT_SEEN
    blue: Annotated[Detection, Field(description="the blue frame")] = NOT_SEEN
    time_us: Annotated[
        int | None,
        Field(description="vehicle time of the image; None if not known", json_schema_extra={"unit": "µs"}),
    ] = None
    frames: tuple[GateSighting, ...] = ()  # by shape; only from the gate finder
    obstacle_edges: tuple[ObstacleEdge, ...] = ()  # from left to right; only from the gate finder
    base: Annotated[BaseSighting | None, Field(description="the base, where it is expected and seen")] = None
    tracks: Annotated[
        PointTracks | None, Field(description="points that are followed from image to image")
    ] = None


@dataclass(frozen=True, slots=True)
class CameraFrame:
    """One image of a camera source."""

    image: Image  # BGR, shape (height, width, 3), uint8
    time_us: int | None  # vehicle time of its exposure; None if the source does not send it
    received_s: float  # monotonic time of its arrival, without the jitter if the stream has time stamps
    jpeg: bytes | None = field(default=None, repr=False)  # as received, to record it without encoding


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
