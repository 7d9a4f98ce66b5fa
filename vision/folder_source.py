"""A folder of images as a camera source, for tests and replays."""

from __future__ import annotations

import asyncio
import re
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Self

import cv2
import numpy as np

from vision.latest import CameraError, shown
from vision.types import CameraFrame, Image

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp")
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
        """Nothing to close."""

    async def frames(self) -> AsyncIterator[CameraFrame]:
        """Every image once; what cannot be decoded is skipped and counted."""
        for path in self._paths:
            data, image = _read(path)
            if image is None:
                self._bad_frames += 1
                continue
            found = _TIME.search(path.stem)
            time_us = int(found.group(1)) if found else None
            jpeg = data if path.suffix.lower() in (".jpg", ".jpeg") else None
            yield CameraFrame(image, time_us, time.monotonic(), jpeg)
            await asyncio.sleep(self._period_s)


def _read(path: Path) -> tuple[bytes, Image | None]:
    try:
        data = path.read_bytes()
        return data, cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    except (OSError, cv2.error):
        return b"", None
