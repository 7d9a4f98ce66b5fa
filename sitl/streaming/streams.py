"""The video streams that a drone's camera offers."""

from __future__ import annotations

import socket
from dataclasses import replace
from math import degrees

from firmware_py.mavlink.camera.model import VideoEncoding, VideoStream
from framerunner.errors import UserError
from framerunner.wire.simulator_api import VIDEO_PATH
from framerunner.wire.transports.urls import in_url, is_loopback
from scenarios.models import Camera
from sitl.server_settings import ServerSettings


class VideoError(UserError):
    """Video cannot be served; the message is one line for people."""


def video_streams(settings: ServerSettings, camera: Camera) -> tuple[VideoStream, ...]:
    """What a camera component announces; QGroundControl takes the first that it can show.

    Args:
        settings: of the drone.
        camera: of the scenario.
    """
    place = in_url(_public_address(settings), settings.http_port)
    page = VideoStream(
        f"http://{place}{VIDEO_PATH}",
        VideoEncoding.MJPEG_HTTP,
        width_px=camera.width_px,
        height_px=camera.height_px,
        rate_hz=camera.rate_hz,
        field_of_view_deg=degrees(camera.horizontal_fov_rad),
    )
    if settings.video_rtp is None:
        return (page,)
    return (replace(page, uri=str(settings.video_rtp[1]), encoding=VideoEncoding.H264_RTP), page)


def _public_address(settings: ServerSettings) -> str:
    """The address under which a ground station reaches this machine, when all addresses are listened on."""
    if settings.bind != "0.0.0.0":
        return settings.bind
    remote = settings.ground.remote
    if remote is None or is_loopback(remote[0]):
        return "127.0.0.1"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(remote)  # sends nothing; the system chooses the route
            return str(probe.getsockname()[0])
        except OSError:
            return "127.0.0.1"
