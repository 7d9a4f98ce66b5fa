"""Reads a JPEG's markers and refuses what no camera sends, before anything is decoded.

A few bytes can claim an image of gigabytes, and a progressive JPEG of 99 kB can hold thousands of scans, each
of which visits every block of the image. The numbers of pixels, scans and bytes bound the time that decoding
takes. Source of the format: ITU-T T.81, annex B.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

JPEG_START = b"\xff\xd8"
MAX_PIXELS = 4096 * 4096
MAX_BASELINE_SCANS = 3  # one for all components, or one for each
MAX_PROGRESSIVE_SCANS = 16  # common encoders write ten
_MAX_MARKERS = 1000
_QUICK_PIXELS = 640 * 480
_QUICK_BYTES = 512 * 1024
_END = 0xD9
_START_OF_SCAN = 0xDA
_BASELINE, _PROGRESSIVE = 0xC0, 0xC2
# All start-of-frame markers (C4, C8 and CC are something else).
_FRAME_MARKERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
# Within a scan, FF is followed by 00 (a byte FF), a restart marker or more FF; anything else ends the scan.
_END_OF_SCAN = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]")


class ImageError(ValueError):
    """Not an image that a camera sends; the message completes "the image is ..."."""


@dataclass(frozen=True, slots=True)
class JpegStructure:
    """What the markers of a whole JPEG say."""

    size_px: tuple[int, int]  # width and height
    progressive: bool  # coded in passes that refine each other; if not, baseline
    scans: int  # how often the decoder visits the whole image
    size_bytes: int  # of the compressed image

    @property
    def is_quick(self) -> bool:
        """Whether decoding takes at most some 3 ms, whatever its content."""
        width, height = self.size_px
        return not self.progressive and width * height <= _QUICK_PIXELS and self.size_bytes <= _QUICK_BYTES


def jpeg_structure(data: bytes, size_px: tuple[int, int] | None = None) -> JpegStructure:
    """Read a JPEG's markers; nothing is decoded.

    Args:
        data: as received; what follows the end of the image is ignored.
        size_px: width and height of the camera's images, if known.

    Raises:
        ImageError: cut off, larger than `MAX_PIXELS` or not of that size, neither baseline nor progressive of
            eight bits with one or three colours, or of more scans than a camera's encoder writes.
    """
    if not data.startswith(JPEG_START):
        raise ImageError("not a JPEG")
    frame: tuple[tuple[int, int], bool] | None = None
    scans = 0
    at = 2
    for _ in range(_MAX_MARKERS):
        marker, at = _next_marker(data, at)
        if marker == _END:
            if frame is None or not scans:
                raise ImageError("empty")
            return JpegStructure(*frame, scans, at)
        if marker == 0x01 or 0xD0 <= marker <= 0xD8:  # these have no content
            continue
        length = int.from_bytes(data[at : at + 2])
        if length < 2 or at + length > len(data):
            raise ImageError("cut off")
        if marker in _FRAME_MARKERS:
            if frame is not None:
                raise ImageError("several images in one")
            frame = _frame(marker, data[at + 2 : at + length], size_px)
        at += length
        if marker == _START_OF_SCAN:
            scans += 1
            limit = MAX_PROGRESSIVE_SCANS if frame is not None and frame[1] else MAX_BASELINE_SCANS
            if scans > limit:
                raise ImageError(f"of more than {limit} scans")
            found = _END_OF_SCAN.search(data, at)
            if found is None:
                raise ImageError("cut off")
            at = found.start()
    raise ImageError(f"of more than {_MAX_MARKERS} markers")


def _next_marker(data: bytes, at: int) -> tuple[int, int]:
    """The marker at a place, and where its content begins."""
    if data[at : at + 1] != b"\xff":
        raise ImageError("cut off" if at >= len(data) else "damaged")
    while data[at : at + 1] == b"\xff":  # any number of FF may stand before a marker
        at += 1
    if at >= len(data):
        raise ImageError("cut off")
    return data[at], at + 1


def _frame(marker: int, head: bytes, size_px: tuple[int, int] | None) -> tuple[tuple[int, int], bool]:
    """Size, and whether it is progressive, from the content of a start-of-frame marker."""
    if marker not in (_BASELINE, _PROGRESSIVE):
        raise ImageError("neither baseline nor progressive")
    if len(head) < 6 or head[0] != 8 or head[5] not in (1, 3):
        raise ImageError("not of eight bits and one or three colours")
    height, width = int.from_bytes(head[1:3]), int.from_bytes(head[3:5])
    if not width or not height:
        raise ImageError("of no size")
    if size_px is not None and (width, height) != size_px:
        raise ImageError(f"of {width} x {height} pixels; the camera has {size_px[0]} x {size_px[1]}")
    if width * height > MAX_PIXELS:
        raise ImageError(f"of {width} x {height} pixels; {MAX_PIXELS} are the limit")
    return (width, height), marker == _PROGRESSIVE
