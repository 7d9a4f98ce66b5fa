"""What a camera component needs: its camera, its video streams, and the storage of pictures and videos."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import tan
from typing import Protocol

CAMERA_COMPONENT_ID = 100  # MAV_COMP_ID_CAMERA
_SENSOR_WIDTH_MM = 6.17  # nominal, of a 1/2.3 inch sensor: a pinhole has an angle of view but no size


@dataclass(frozen=True, slots=True)
class FixedCamera:
    """A camera fixed to the vehicle, looking along its x axis."""

    width_px: int
    height_px: int
    horizontal_fov_rad: float
    rate_hz: float  # of images; pictures cannot be taken faster
    vendor: str = "framerunner"  # at most 32 bytes
    name: str = "pinhole"  # of the model, at most 32 bytes

    @property
    def sensor_size_mm(self) -> tuple[float, float]:
        """Width and height of the sensor, for square pixels."""
        return _SENSOR_WIDTH_MM, _SENSOR_WIDTH_MM * self.height_px / self.width_px

    @property
    def focal_length_mm(self) -> float:
        """From the angle of view: half the width over the tangent of half the angle."""
        return _SENSOR_WIDTH_MM / 2.0 / tan(self.horizontal_fov_rad / 2.0)


class VideoEncoding(Enum):
    """How the images are sent."""

    MJPEG_HTTP = "MJPEG over HTTP"
    H264_RTP = "H.264 in RTP over UDP"


@dataclass(frozen=True, slots=True)
class VideoStream:
    """One stream of the camera.

    Attributes:
        uri: its address: `http://host:port/video`; of RTP, which is sent unrequested, the UDP port to listen
            on as text ("5600"), as VIDEO_STREAM_INFORMATION requires.
    """

    uri: str
    encoding: VideoEncoding
    width_px: int
    height_px: int
    rate_hz: float  # of images
    field_of_view_deg: float  # horizontal


@dataclass(frozen=True, slots=True)
class PictureSpace:
    """The storage of pictures, in MiB."""

    total_mib: float
    used_mib: float

    @property
    def free_mib(self) -> float:
        """What is left of it."""
        return max(0.0, self.total_mib - self.used_mib)


class CaptureSink(Protocol):
    """Takes pictures and records video, and keeps them; never raises."""

    @property
    def can_record(self) -> bool:
        """Whether it can record video."""

    @property
    def is_recording(self) -> bool:
        """Whether video is being recorded; it ends by itself when the storage is full."""

    def capture(self, time_us: int, index: int) -> str | None:
        """Take a picture.

        Args:
            time_us: vehicle time.
            index: counts pictures from 0.

        Returns:
            A URL to download it, of at most 205 bytes; empty if it is not kept; None if it could not be
            taken.
        """

    def start_video(self, index: int) -> bool:
        """Record video from the next image on.

        Args:
            index: counts recordings from 0.

        Returns:
            Whether it records now.
        """

    def stop_video(self) -> None:
        """Finish the recording, if there is one."""

    def format(self) -> bool:
        """Delete all pictures and recordings; False if that failed."""

    def space(self) -> PictureSpace | None:
        """The storage; None if pictures are not kept."""
