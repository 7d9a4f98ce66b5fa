"""A camera's pictures and recordings among the drone's files."""

from __future__ import annotations

import errno
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.util import find_spec
from typing import TYPE_CHECKING

from firmware_py.mavlink.camera.model import PictureSpace
from firmware_py.storage import Path
from sitl.storage import MEBIBYTE, FolderStorage

if TYPE_CHECKING:
    from sitl.optics.painter import Image
    from sitl.streaming.h264 import VideoEncoder

_FOLDER = "DCIM"  # of cameras, by the Design rule for Camera File system
_MIN_FREE_BYTES = MEBIBYTE  # a recording needs room to begin


@dataclass(slots=True)
class _Recording:
    encoder: VideoEncoder
    path: Path
    written: int = 0  # bytes of the file


class CameraAlbum:
    """Keeps images when pictures are requested, and records video: in `DCIM/20261120_140559/` (UTC of boot).

    The files are `IMG_00000.jpg` and `VID_00000.mp4`; the images of a video have their vehicle times.

    Args:
        storage: the vehicle's files.
        boot_unix_us: time of boot in microseconds since 1970.
        rate_hz: of the camera's images.

    Attributes:
        can_record: whether PyAV is installed.
    """

    def __init__(self, storage: FolderStorage, boot_unix_us: int, rate_hz: float) -> None:
        self._storage = storage
        name = datetime.fromtimestamp(boot_unix_us / 1e6, UTC).strftime("%Y%m%d_%H%M%S")
        self._folder: Path = (_FOLDER, name)
        self._rate_hz = rate_hz
        self._newest: Image | None = None
        self._recording: _Recording | None = None
        self._ending: list[_Recording] = []  # stopped; their last images are still being compressed
        self.can_record = find_spec("av") is not None

    @property
    def is_recording(self) -> bool:
        """Whether video is being recorded."""
        return self._recording is not None

    def show(self, image: Image, time_us: int) -> None:
        """Take the image that has just arrived, BGR, shape (height, width, 3), with its time of exposure."""
        self._newest = image
        recording = self._recording
        if recording is not None:
            recording.encoder.show(image, time_us)
            if not self._write(recording) or recording.encoder.failed:
                self.stop_video()
        if self._ending:
            self._ending = [each for each in self._ending if not self._has_ended(each)]

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
            self._create(path)
            self._fill(path, encode_jpeg(self._newest))
        except OSError:
            return ""
        return f"mftp://[;comp=1]{'/'.join(path)}"

    def start_video(self, index: int) -> bool:
        """Record from the next image on; False before the first image, and when there is no room."""
        used, total = self._storage.space()
        if self._newest is None or not self.can_record or total - used < _MIN_FREE_BYTES:
            return False
        path = (*self._folder, f"VID_{index:05d}.mp4")
        try:
            self._create(path)
        except OSError:
            return False
        from sitl.streaming.h264 import VideoEncoder

        height, width = self._newest.shape[:2]
        self._recording = _Recording(VideoEncoder(width, height, self._rate_hz), path)
        return True

    def stop_video(self) -> None:
        """End the recording, if there is one; the images after this complete its file."""
        recording, self._recording = self._recording, None
        if recording is not None:
            recording.encoder.end()
            self._ending.append(recording)

    def close(self) -> None:
        """End the recording, and wait until all files are complete."""
        self.stop_video()
        for each in self._ending:
            each.encoder.wait()
            self._write(each)
        self._ending = []

    def format(self) -> bool:
        """Delete all pictures and recordings, also those of earlier flights; no other file."""
        self.close()
        try:
            self._remove_folder((_FOLDER,))
        except OSError as error:
            return error.errno == errno.ENOENT
        return True

    def space(self) -> PictureSpace | None:
        """How full the storage is."""
        used, total = self._storage.space()
        return PictureSpace(total / MEBIBYTE, used / MEBIBYTE)

    def _has_ended(self, recording: _Recording) -> bool:
        """Write what is done of a recording that was stopped; whether that was all."""
        has_ended = recording.encoder.has_ended  # read first: the last bytes are there then
        self._write(recording)
        return has_ended

    def _write(self, recording: _Recording) -> bool:
        """Append what is done to the file; False if the storage is full."""
        data = recording.encoder.take()
        if not data:
            return True
        try:
            self._storage.write(recording.path, recording.written, data)
        except OSError:
            return False
        recording.written += len(data)
        return True

    def _create(self, path: Path) -> None:
        for depth in range(1, len(path)):
            try:
                self._storage.make_folder(path[:depth])
            except OSError as error:
                if error.errno != errno.EEXIST:
                    raise
        self._storage.create(path)

    def _fill(self, path: Path, data: bytes) -> None:
        try:
            self._storage.write(path, 0, data)
        except OSError:
            self._storage.remove(path)  # leave no incomplete file
            raise

    def _remove_folder(self, path: Path) -> None:
        for entry in self._storage.entries(path):
            inside = (*path, entry.name)
            if entry.is_folder:
                self._remove_folder(inside)
            else:
                self._storage.remove(inside)
        self._storage.remove_folder(path)
