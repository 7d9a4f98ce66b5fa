"""Whether a compressed image may be decoded: some hundred bytes can claim gigabytes, or minutes of work."""

from __future__ import annotations

from framerunner.recording.errors import RecordingError
from vision.jpeg import JPEG_START, MAX_PIXELS, ImageError, jpeg_structure

_PNG_START = b"\x89PNG\r\n\x1a\n"


def check_image(data: bytes) -> None:
    """See that an image is a PNG or JPEG of a size that a camera has, from its structure alone.

    Raises:
        RecordingError: it is not.
    """
    try:
        if data.startswith(JPEG_START):
            jpeg_structure(data)
        else:
            _check_png(data)
    except ImageError as error:
        raise RecordingError(f"an image is {error}") from None


def _check_png(data: bytes) -> None:
    """Look at the width and height in the first chunk (PNG specification, 11.2.2)."""
    if not data.startswith(_PNG_START) or len(data) < 24:
        raise ImageError("neither PNG nor JPEG")
    width, height = int.from_bytes(data[16:20]), int.from_bytes(data[20:24])
    if width * height > MAX_PIXELS:
        raise ImageError(f"of {width} x {height} pixels; {MAX_PIXELS} are the limit")
