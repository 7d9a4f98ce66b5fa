"""What a camera component tells about a video stream: where it really is, and what is in it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


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
