"""What a served drone writes among its files: flight logs, and pictures of its camera."""

from __future__ import annotations

import errno
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from firmware_py.mavlink.camera.model import PictureSpace
from firmware_py.storage import Path, Storage
from firmware_py.ulog import UlogRecorder
from sitl.storage import MEBIBYTE, FolderStorage, MemoryStorage

if TYPE_CHECKING:
    from sitl.optics.painter import Image


def _utc(unix_us: int, form: str) -> str:
    return datetime.fromtimestamp(unix_us / 1e6, UTC).strftime(form)


def flight_recorder(storage: Storage, boot_unix_us: int) -> UlogRecorder:
    """A recorder that names logs as PX4 does, `log/2026-11-20/14_05_59.ulg` (UTC).

    Args:
        storage: where the logs are written.
        boot_unix_us: time of boot in microseconds since 1970.
    """

    def name_log(time_us: int) -> Path:
        began_us = boot_unix_us + time_us
        return ("log", _utc(began_us, "%Y-%m-%d"), _utc(began_us, "%H_%M_%S.ulg"))

    return UlogRecorder(storage, name_log, boot_unix_us=boot_unix_us)


class PictureAlbum:
    """Keeps the newest image when a picture is requested: `DCIM/20261120_140559/IMG_00000.jpg` (UTC of boot).

    Args:
        storage: the vehicle's files.
        boot_unix_us: time of boot in microseconds since 1970.
    """

    def __init__(self, storage: MemoryStorage | FolderStorage, boot_unix_us: int) -> None:
        self._storage = storage
        self._folder: Path = ("DCIM", _utc(boot_unix_us, "%Y%m%d_%H%M%S"))
        self._newest: Image | None = None

    def show(self, image: Image) -> None:
        """Take the image that has just arrived, BGR, shape (height, width, 3)."""
        self._newest = image

    def capture(self, time_us: int, index: int) -> str | None:
        """Keep the newest image under a number, and return its address for MAVLink FTP at component 1.

        The address is empty if the storage is full, and None before the first image.
        """
        del time_us  # the newest image is at most a period old
        if self._newest is None:
            return None
        from sitl.video import encode_jpeg  # not earlier: telemetry must not wait for its imports

        path = (*self._folder, f"IMG_{index:05d}.jpg")
        try:
            self._keep(path, encode_jpeg(self._newest))
        except OSError:
            return ""
        return f"mftp://[;comp=1]{'/'.join(path)}"

    def space(self) -> PictureSpace | None:
        """How full the storage is."""
        used, total = self._storage.space()
        return PictureSpace(total / MEBIBYTE, used / MEBIBYTE)

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
            self._storage.remove(path)  # leave no incomplete file
            raise
