"""A folder of images as a camera source, for tests and replays."""

from __future__ import annotations

import asyncio
import re
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Self

from vision.decoder import ImageDecoder
from vision.jpeg import JPEG_START, ImageError
from vision.latest import CameraError, shown
from vision.types import CameraFrame

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp")
MAX_FILE_BYTES = 64 * 1024 * 1024
_TIME = re.compile(r"(\d{1,18})us$")


class FolderSource:
    """Gives every image of a folder once, in the order of the names.

    A name that ends in digits and "us" tells the vehicle time: `0000123000us.png` is 0.123 s.
    """

    def __init__(self, folder: Path, rate_hz: float | None = None) -> None:
        """Prepare.

        Args:
            folder: holds the images.
            rate_hz: images a second; by default as fast as they are taken.
        """
        self._folder = folder
        self._name = f"camera {shown(str(folder))}"
        self._period_s = 1.0 / rate_hz if rate_hz else 0.0
        self._paths: list[Path] = []
        self._decoder = ImageDecoder()
        self._bad_frames = 0

    @property
    def bad_frames(self) -> int:
        """Files skipped so far because they could not be decoded."""
        return self._bad_frames

    async def __aenter__(self) -> Self:
        """List the folder.

        Raises:
            CameraError: it cannot be read or holds no images.
        """
        try:
            entries = sorted(self._folder.iterdir())
        except OSError as error:
            raise CameraError(f"{self._name}: {(error.strerror or 'cannot be read').lower()}") from error
        self._paths = [path for path in entries if path.suffix.lower() in SUFFIXES]
        if not self._paths:
            raise CameraError(f"{self._name}: no images in this folder ({', '.join(SUFFIXES)})")
        return self

    async def __aexit__(self, *exc_info: object) -> None:
        """End what decodes."""
        self._decoder.close()

    async def frames(self) -> AsyncIterator[CameraFrame]:
        """Every image once; what cannot be decoded is skipped and counted."""
        for path in self._paths:
            data = _read(path)
            is_jpeg = data.startswith(JPEG_START)
            decode = self._decoder.decode_jpeg if is_jpeg else self._decoder.decode_file
            try:
                image = await decode(data)
            except ImageError:
                self._bad_frames += 1
                continue
            found = _TIME.search(path.stem)
            time_us = int(found.group(1)) if found else None
            yield CameraFrame(image, time_us, time.monotonic(), data if is_jpeg else None)
            await asyncio.sleep(self._period_s)


def _read(path: Path) -> bytes:
    """The content of a file; nothing if it cannot be read or is too large."""
    try:
        if not path.is_file() or path.stat().st_size > MAX_FILE_BYTES:
            return b""
        return path.read_bytes()
    except OSError:
        return b""
