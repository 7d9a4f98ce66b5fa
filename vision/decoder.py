"""Decodes images of unknown origin: in this process only where that is quick whatever they hold."""

from __future__ import annotations

import asyncio

import cv2
import numpy as np

from vision.jpeg import ImageError, jpeg_structure
from vision.types import Image
from vision.worker import DECODE_LIMIT_S, WorkerRequest
from vision.worker_process import CameraProcess, WorkerEndedError


class ImageDecoder:
    """Decodes one image at a time.

    A baseline JPEG of at most 640 x 480 pixels is decoded here: it takes at most some 3 ms, whatever it
    holds, and less than handing it to another process. All else goes to a process of its own, which is ended
    when an image takes longer than `DECODE_LIMIT_S`.

    Args:
        size_px: width and height of all JPEGs; None if that is not known.
    """

    def __init__(self, size_px: tuple[int, int] | None = None) -> None:
        self._size_px = size_px
        self._worker = CameraProcess()

    async def decode_jpeg(self, data: bytes) -> Image:
        """Decode a JPEG to BGR; raises `ImageError` if no camera sends it, or it takes too long."""
        if not jpeg_structure(data, self._size_px).is_quick:
            return await self.decode_file(data)
        try:
            image: Image | None = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        except cv2.error:
            image = None
        if image is None:
            raise ImageError("damaged")
        return image

    async def decode_file(self, data: bytes) -> Image:
        """Decode an image of any format that OpenCV can read; raises `ImageError`."""
        try:
            await self._worker.start()
            async with asyncio.timeout(DECODE_LIMIT_S):
                image = (await self._worker.request(WorkerRequest.DECODE, data)).image
        except TimeoutError:
            raise ImageError(f"one that takes longer than {DECODE_LIMIT_S:g} s to decode") from None
        except WorkerEndedError as error:
            raise ImageError(f"not decoded: {error}") from None
        if image is None:
            raise ImageError("damaged or too large")
        return image

    def close(self) -> None:
        """End the process, if there is one."""
        self._worker.end()
