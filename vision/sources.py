"""Where images come from: `open_source` finds the camera source that fits a URL, a path or a device."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import urlsplit

from vision.capture_source import CaptureSource
from vision.folder_source import FolderSource
from vision.latest import CameraError, CameraSource, shown

__all__ = ["CameraError", "CameraSource", "open_source"]

_VIDEO_FILE = re.compile(r"\.(mp4|mkv|avi|mov|webm|ts|m3u8|mpd|sdp)$", re.IGNORECASE)


def open_source(
    url_or_path: str | int | Path, *, timeout_s: float = 5.0, size_px: tuple[int, int] | None = None
) -> CameraSource:
    """Choose the source for a camera; it is opened by `async with`.

    Args:
        url_or_path: http(s):// is MJPEG over HTTP, unless it ends like a video file; a folder is its
            images; a number is a video device; anything else is left to OpenCV (rtsp://, udp://, files).
        timeout_s: how long to wait for the camera, and for each of its images.
        size_px: width and height of an MJPEG camera's images, others are skipped; None for any.

    Raises:
        CameraError: it is none of these.
    """
    text = str(url_or_path).strip()
    if text.isdecimal() and len(text) < 4:
        return CaptureSource(int(text), timeout_s)
    if "://" in text:
        try:
            parts = urlsplit(text)
        except ValueError as error:
            raise CameraError(f"camera {shown(text)}: not a valid URL") from error
        if parts.scheme.lower() in ("http", "https") and not _VIDEO_FILE.search(parts.path):
            from vision.http_source import HttpSource  # noqa: PLC0415 - its library is slow to import

            return HttpSource(text, timeout_s, size_px)
        return CaptureSource(text, timeout_s)
    path = Path(text)
    try:
        found = bool(text) and path.exists()
        if found and path.is_dir():
            return FolderSource(path)
    except (OSError, ValueError):  # such as a zero byte in the name
        found = False
    if not found:
        raise CameraError(f"camera '{shown(text)}': no such file, folder, device or URL")
    return CaptureSource(text, timeout_s)
