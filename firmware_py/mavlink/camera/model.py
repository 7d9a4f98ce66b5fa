"""What a camera component needs to know: its camera, its video streams, and who keeps its pictures."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import tan
from typing import Protocol

from firmware_py.missions.flight import SevenParams
from firmware_py.status import CommandResult

CAMERA_COMPONENT_ID = 100  # MAV_COMP_ID_CAMERA
_SENSOR_WIDTH_MM = 6.17  # nominal, of a 1/2.3 inch sensor: a pinhole has an angle of view but no size


@dataclass(frozen=True, slots=True)
class CameraModel:
    """A camera fixed to the vehicle, looking along its x axis.

    Attributes:
        width_px: columns of an image.
        height_px: rows of an image.
        horizontal_fov_rad: angle of view over the width.
        rate_hz: images a second; pictures cannot follow each other faster.
        vendor: who made it, at most 32 bytes.
        name: of the model, at most 32 bytes.
    """

    width_px: int
    height_px: int
    horizontal_fov_rad: float
    rate_hz: float
    vendor: str = "framerunner"
    name: str = "pinhole"

    @property
    def sensor_size_mm(self) -> tuple[float, float]:
        """Width and height of the sensor, for square pixels."""
        return _SENSOR_WIDTH_MM, _SENSOR_WIDTH_MM * self.height_px / self.width_px

    @property
    def focal_length_mm(self) -> float:
        """From the angle of view: half the width over the tangent of half the angle."""
        return _SENSOR_WIDTH_MM / 2.0 / tan(self.horizontal_fov_rad / 2.0)


class VideoEncoding(Enum):
    """How the images travel."""

    MJPEG_HTTP = "MJPEG over HTTP"
    H264_RTP = "H.264 in RTP over UDP"


@dataclass(frozen=True, slots=True)
class VideoStream:
    """One stream of the camera.

    Attributes:
        uri: where a watcher finds it: `http://host:port/video`; of RTP, which is sent unasked, the UDP port
            to listen on as text ("5600"), which is what VIDEO_STREAM_INFORMATION wants there.
        encoding: how the images travel.
        width_px: of an image.
        height_px: of an image.
        rate_hz: images a second.
        field_of_view_deg: horizontal.
    """

    uri: str
    encoding: VideoEncoding
    width_px: int
    height_px: int
    rate_hz: float
    field_of_view_deg: float


@dataclass(frozen=True, slots=True)
class PictureSpace:
    """The storage of pictures, in MiB."""

    total_mib: float
    used_mib: float


class CaptureSink(Protocol):
    """Takes pictures and keeps them; never raises."""

    def capture(self, time_us: int, index: int) -> str | None:
        """Take a picture.

        Args:
            time_us: vehicle time.
            index: counts pictures from 0.

        Returns:
            Where it can be fetched, a URL of at most 205 bytes; empty if it is not kept; None if none could
            be taken.
        """

    def space(self) -> PictureSpace | None:
        """How much room there is; None if pictures are not kept."""


class CountingSink:
    """Keeps no pictures; they are only counted."""

    def capture(self, time_us: int, index: int) -> str | None:
        """Take nothing."""
        return ""

    def space(self) -> PictureSpace | None:
        """Nowhere."""
        return None


class CameraControl(Protocol):
    """What a mission can do with the camera."""

    def run(self, command: int, params: SevenParams) -> CommandResult:
        """Do what a MAV_CMD to the camera says; UNSUPPORTED if it is not the camera's."""
