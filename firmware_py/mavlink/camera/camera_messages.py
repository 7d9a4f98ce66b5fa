"""The messages of a camera component (https://mavlink.io/en/services/camera.html)."""

from __future__ import annotations

from math import nan

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.camera.model import FixedCamera, PictureSpace, VideoEncoding, VideoStream
from firmware_py.mavlink.telemetry.connection import OWN_VERSION
from framerunner.wire.dialect import Message, boot_ms, degrees_e7, mavlink, millimetres
from framerunner.wire.exchange import Exchange

_STREAMS = mavlink.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM
_RECORDS = (  # pictures are taken while video is recorded, and both in each mode
    mavlink.CAMERA_CAP_FLAGS_CAPTURE_VIDEO
    | mavlink.CAMERA_CAP_FLAGS_HAS_MODES
    | mavlink.CAMERA_CAP_FLAGS_CAN_CAPTURE_IMAGE_IN_VIDEO_MODE
    | mavlink.CAMERA_CAP_FLAGS_CAN_CAPTURE_VIDEO_IN_IMAGE_MODE
)
_RUNNING = mavlink.VIDEO_STREAM_STATUS_FLAGS_RUNNING
# MAVLink has no type for MJPEG over HTTP: the nearest is a stream over TCP of unknown encoding.
_TYPES = {
    VideoEncoding.MJPEG_HTTP: (mavlink.VIDEO_STREAM_TYPE_TCP_MPEG, mavlink.VIDEO_STREAM_ENCODING_UNKNOWN),
    VideoEncoding.H264_RTP: (mavlink.VIDEO_STREAM_TYPE_RTPUDP, mavlink.VIDEO_STREAM_ENCODING_H264),
}
_INTERVAL_SET = 2  # image_status of CAMERA_CAPTURE_STATUS
_URI_BYTES, _NAME_BYTES, _LABEL_BYTES, _FILE_BYTES = 160, 32, 32, 205


def information(camera: FixedCamera, *, streams: bool, records: bool, time_us: int) -> Message:
    """CAMERA_INFORMATION; `streams`: whether there are video streams, `records`: whether it records video."""
    major, minor, patch = OWN_VERSION
    flags = mavlink.CAMERA_CAP_FLAGS_CAPTURE_IMAGE
    flags |= (_STREAMS if streams else 0) | (_RECORDS if records else 0)
    return mavlink.MAVLink_camera_information_message(
        boot_ms(time_us),
        list(_padded(camera.vendor, _LABEL_BYTES)),
        list(_padded(camera.name, _LABEL_BYTES)),
        major | minor << 8 | patch << 16,
        camera.focal_length_mm,
        *camera.sensor_size_mm,
        camera.width_px,
        camera.height_px,
        0,
        flags,
        0,
        b"",
    )


def settings(mode: int, time_us: int) -> Message:
    """CAMERA_SETTINGS: the mode (CAMERA_MODE); there is neither zoom nor focus."""
    return mavlink.MAVLink_camera_settings_message(boot_ms(time_us), mode, nan, nan)


def storage_information(space: PictureSpace | None, time_us: int) -> Message:
    """STORAGE_INFORMATION: one storage, or none."""
    if space is None:
        return mavlink.MAVLink_storage_information_message(
            boot_ms(time_us), 0, 0, mavlink.STORAGE_STATUS_EMPTY, 0.0, 0.0, 0.0, 0.0, 0.0
        )
    return mavlink.MAVLink_storage_information_message(
        boot_ms(time_us),
        1,
        1,
        mavlink.STORAGE_STATUS_READY,
        space.total_mib,
        space.used_mib,
        space.free_mib,
        0.0,
        0.0,
        mavlink.STORAGE_TYPE_OTHER,
        b"vehicle",
        mavlink.STORAGE_USAGE_FLAG_SET | mavlink.STORAGE_USAGE_FLAG_PHOTO | mavlink.STORAGE_USAGE_FLAG_VIDEO,
    )


def capture_status(
    interval_s: float, count: int, recorded_us: int | None, space: PictureSpace | None, time_us: int
) -> Message:
    """CAMERA_CAPTURE_STATUS.

    Args:
        interval_s: of the present series of pictures; 0: none.
        count: pictures since boot, or since the storage was formatted.
        recorded_us: duration of the present recording; None: none.
        space: storage.
        time_us: vehicle time.
    """
    return mavlink.MAVLink_camera_capture_status_message(
        boot_ms(time_us),
        _INTERVAL_SET if interval_s > 0.0 else 0,
        0 if recorded_us is None else 1,
        interval_s,
        (recorded_us or 0) // 1000,
        space.free_mib if space else 0.0,
        count,
    )


def image_captured(autopilot: Autopilot, exchange: Exchange, index: int, url: str | None) -> Message:
    """CAMERA_IMAGE_CAPTURED: a picture taken now and here, and its URL; None: it could not be taken."""
    place, home = autopilot.global_position(), autopilot.status.home
    altitude_m = place.altitude_m if place else 0.0
    return mavlink.MAVLink_camera_image_captured_message(
        boot_ms(exchange.time_us),
        exchange.unix_us,
        0,
        degrees_e7(place.latitude_deg) if place else 0,
        degrees_e7(place.longitude_deg) if place else 0,
        millimetres(altitude_m),
        millimetres(altitude_m - home.altitude_m) if home else 0,
        autopilot.state.attitude,
        index,
        0 if url is None else 1,
        (url or "").encode()[:_FILE_BYTES],
    )


def stream_information(stream: VideoStream, number: int, count: int, *, running: bool) -> Message:
    """VIDEO_STREAM_INFORMATION of one stream, numbered from 1."""
    kind, encoding = _TYPES[stream.encoding]
    return mavlink.MAVLink_video_stream_information_message(
        number,
        count,
        kind,
        *_stream_fields(stream, running=running),
        stream.encoding.value.encode()[:_NAME_BYTES],
        stream.uri.encode()[:_URI_BYTES],
        encoding,
    )


def stream_status(stream: VideoStream, number: int, *, running: bool) -> Message:
    """VIDEO_STREAM_STATUS of one stream."""
    return mavlink.MAVLink_video_stream_status_message(number, *_stream_fields(stream, running=running))


def _stream_fields(stream: VideoStream, *, running: bool) -> tuple[float, ...]:
    """The fields that both messages contain: flags, rate, size, bit rate, rotation, field of view."""
    field_of_view_deg = round(stream.field_of_view_deg)
    return (
        _RUNNING if running else 0,
        stream.rate_hz,
        stream.width_px,
        stream.height_px,
        0,
        0,
        field_of_view_deg,
    )


def _padded(text: str, length: int) -> bytes:
    """A text in a fixed number of bytes, ended by a zero if it fits."""
    return text.encode()[:length].ljust(length, b"\0")
