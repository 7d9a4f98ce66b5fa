"""The camera's pictures as JPEG files among the vehicle's files, where MAVLink FTP finds them."""

from __future__ import annotations

import errno
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Protocol

from firmware_py.mavlink.camera.model import PictureSpace
from firmware_py.storage import Path, Storage

if TYPE_CHECKING:
    from sitl.camera import Image

_FOLDER = "DCIM"
_MEBIBYTE = 1 << 20


class MeasuredStorage(Storage, Protocol):
    """A storage that knows how full it is."""

    def space(self) -> tuple[int, int]:
        """Bytes kept, and bytes that can be kept."""
        ...


class PictureAlbum:
    """Keeps the newest image when a picture is wanted: `DCIM/20261120_140559/IMG_00000.jpg`, by UTC of boot.

    Args:
        storage: the vehicle's files.
        boot_unix_us: time of boot in microseconds since 1970; each run has a folder of its own.
    """

    def __init__(self, storage: MeasuredStorage, boot_unix_us: int) -> None:
        self._storage = storage
        booted = datetime.fromtimestamp(boot_unix_us / 1e6, UTC)
        self._folder: Path = (_FOLDER, booted.strftime("%Y%m%d_%H%M%S"))
        self._newest: Image | None = None

    def show(self, image: Image) -> None:
        """Take the image that has just arrived, BGR, shape (height, width, 3)."""
        self._newest = image

    def capture(self, time_us: int, index: int) -> str | None:
        """Keep the newest image.

        Args:
            time_us: vehicle time.
            index: of the picture.

        Returns:
            Its address for MAVLink FTP at component 1; empty if the storage is full; None before the first
            image.
        """
        del time_us  # the image is the newest there is, at most a period old
        if self._newest is None:
            return None
        from sitl.video import encode_jpeg  # not earlier: telemetry must not wait for what it imports

        path = (*self._folder, f"IMG_{index:05d}.jpg")
        try:
            self._keep(path, encode_jpeg(self._newest))
        except OSError:
            return ""
        return f"mftp://[;comp=1]{'/'.join(path)}"

    def space(self) -> PictureSpace | None:
        """How full the storage is."""
        used, total = self._storage.space()
        return PictureSpace(total / _MEBIBYTE, used / _MEBIBYTE)

    def _keep(self, path: Path, data: bytes) -> None:
        for depth in range(1, len(path)):
            try:
                self._storage.make_folder(path[:depth])
            except OSError as error:
                if error.errno != errno.EEXIST:
                    raise
        self._storage.create(path)
        try:
            self._storage.write(path, 0, data)
        except OSError:
            self._storage.remove(path)  # half a picture is none
            raise
