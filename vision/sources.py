"""Camera sources: `open_source` chooses the one for a URL, a path or a device.

MJPEG over HTTP has a module of its own, `vision.streams.http_source`.
"""

from __future__ import annotations

import asyncio
import re
import time
from collections.abc import AsyncIterator
from functools import partial
from pathlib import Path
from typing import Self
from urllib.parse import urlsplit

from vision.decoder import ImageDecoder
from vision.jpeg import JPEG_START, ImageError
from vision.streams.reconnecting import ReconnectingSource, ReopenableSource
from vision.types import CameraError, CameraFrame, CameraSource, shown_url
from vision.worker import Problem, WorkerReply, WorkerRequest
from vision.worker_process import CameraProcess, WorkerAnswer, WorkerEndedError

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp")
MAX_FILE_BYTES = 64 * 1024 * 1024
_TIME = re.compile(r"(\d{1,18})us$")
_NO_VIDEO = "; is H.264 sent to this port of this machine, with a key frame each second?"
_HINTS = {"rtsp": "; does it send a key frame each second?", "udp": _NO_VIDEO, "rtp": _NO_VIDEO}
_PROBLEMS = {
    Problem.UNKNOWN: "cannot be opened; is it there, and is it video?",
    Problem.NO_LOGIN: "user name or password is missing or wrong; write them as rtsp://USER:PASSWORD@HOST/PATH",
    Problem.NOT_FOUND: "the server has no such stream; check the path after the host",
    Problem.REFUSED: "connection refused; is the camera's server running, and is the port right?",
    Problem.UNKNOWN_HOST: "there is no host of this name; check it, or give its address",
    Problem.UNREACHABLE: "the host cannot be reached; check the address and the network",
    Problem.NOT_OUR_ADDRESS: "is no address of this machine; write 0.0.0.0 to receive at all of them",
    Problem.PORT_IN_USE: "another program receives at this port, or at the next one, which rtp:// needs too",
    Problem.NO_DEVICE: "cannot be opened; is it in `ls /dev/video*`, may you use it (group video), and does "
    "no other program?",
}
_CONNECTIONLESS = ("udp", "rtp")  # one receives whoever sends, also after a restart
_VIDEO_FILE = re.compile(r"\.(mp4|mkv|avi|mov|webm|ts|m3u8|mpd|sdp)$", re.IGNORECASE)


def open_source(
    url_or_path: str | int | Path,
    *,
    timeout_s: float = 5.0,
    size_px: tuple[int, int] | None = None,
    reconnects: bool = False,
) -> CameraSource:
    """Choose the source for a camera; it is opened by `async with`.

    Args:
        url_or_path: http(s):// is MJPEG over HTTP, unless it ends like a video file; a folder is its
            images; a number is a video device; rtp://HOST:PORT is H.264 sent to this UDP port; anything
            else is left to OpenCV (rtsp://, udp://, tcp://, files).
        timeout_s: how long to wait for the camera, and for each of its images.
        size_px: width and height of an MJPEG camera's images, others are skipped; None for any.
        reconnects: whether a stream to which one connects is opened again when it is lost.

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
            raise CameraError(f"camera {shown_url(text)}: not a valid URL") from error
        scheme = parts.scheme.lower()
        if scheme == "rtp":
            _check_rtp(text)
        is_mjpeg = scheme in ("http", "https") and not _VIDEO_FILE.search(parts.path)
        new_source = partial(_new_stream, text, timeout_s, size_px, is_mjpeg=is_mjpeg)
        if reconnects and scheme not in _CONNECTIONLESS:
            return ReconnectingSource(new_source, _name_of(text), timeout_s)
        return new_source()
    path = Path(text)
    try:
        found = bool(text) and path.exists()
        if found and path.is_dir():
            return FolderSource(path)
    except (OSError, ValueError):  # such as a zero byte in the name
        found = False
    if not found:
        raise CameraError(f"camera '{shown_url(text)}': no such file, folder, device or URL")
    return CaptureSource(text, timeout_s)


def _new_stream(
    url: str, timeout_s: float, size_px: tuple[int, int] | None, *, is_mjpeg: bool
) -> ReopenableSource:
    if not is_mjpeg:
        return CaptureSource(url, timeout_s)
    from vision.streams.http_source import HttpSource  # noqa: PLC0415 - its library is slow to import

    return HttpSource(url, timeout_s, size_px)


def _name_of(url: str) -> str:
    return f"camera {shown_url(url)}"


def _check_rtp(url: str) -> None:
    try:
        parts = urlsplit(url)
        known = bool(parts.hostname and parts.port) and re.fullmatch(r"rtp://[\w.:\[\]-]+/?", url) is not None
    except ValueError:  # the port
        known = False
    if not known:
        raise CameraError(f"camera {shown_url(url)}: write rtp://HOST:PORT, such as rtp://0.0.0.0:5600")


class CaptureSource:
    """Whatever OpenCV opens: RTSP, UDP, video devices, files; read in a process that can be ended.

    Only the latest image is kept. A file is played at its own speed, and its end is a normal end; the end of
    a live stream is an error.

    Args:
        url: URL, path or number of a device.
        timeout_s: how long to wait for it to open, and for each image.

    Attributes:
        bad_frames: images skipped so far because they are too large; OpenCV does not report which it skips.
    """

    def __init__(self, url: str | int, timeout_s: float = 5.0) -> None:
        self.bad_frames = 0
        self._url = url
        self._name = _name_of(str(url))
        self._hint = _HINTS.get(str(url).partition("://")[0].lower(), "")
        self._timeout_s = timeout_s
        self._worker = CameraProcess()

    async def __aenter__(self) -> Self:
        """Open the camera; raises `CameraError` if that fails, also after `timeout_s`."""
        try:
            await self.open()
        except BaseException:
            self._worker.end()
            raise
        return self

    async def __aexit__(self, *exc_info: object) -> None:
        """Close it."""
        self._worker.end()

    async def open(self) -> None:
        """Open the camera, for the first time or after it ended or failed; raises `CameraError`."""
        settings = f"{round(self._timeout_s * 1000)} {self._url}".encode()
        try:
            async with asyncio.timeout(self._timeout_s):
                answer = await self._request(WorkerRequest.OPEN, settings)
        except TimeoutError:
            problem = f"did not open within {self._timeout_s:g} s{self._hint}"
            raise CameraError(f"{self._name}: {problem}") from None
        if answer.reply is not WorkerReply.OPENED:
            raise CameraError(f"{self._name}: {_PROBLEMS[answer.problem]}")

    async def frames(self) -> AsyncIterator[CameraFrame]:
        """Always the latest image; its vehicle time is unknown. Raises `CameraError`."""
        loop = asyncio.get_running_loop()
        hint = self._hint
        deadline_s = loop.time() + self._timeout_s
        while True:
            try:
                async with asyncio.timeout_at(deadline_s):
                    answer = await self._request(WorkerRequest.NEXT)
            except TimeoutError:
                raise CameraError(f"{self._name}: no image for {self._timeout_s:g} s{hint}") from None
            if answer.reply is WorkerReply.END_OF_FILE:
                return
            if answer.reply is WorkerReply.END_OF_STREAM:
                raise CameraError(f"{self._name}: the stream ended")
            if answer.image is None:
                self.bad_frames += 1
                continue
            hint = ""
            yield CameraFrame(answer.image, None, answer.received_s)
            deadline_s = loop.time() + self._timeout_s

    async def _request(self, kind: WorkerRequest, data: bytes = b"") -> WorkerAnswer:
        try:
            return await self._worker.request(kind, data)
        except WorkerEndedError:
            raise CameraError(f"{self._name}: OpenCV crashed or ran out of memory on it") from None


class FolderSource:
    """Every image of a folder once, in the order of the names, for tests and replays.

    A name that ends in digits and "us" gives the vehicle time: `0000123000us.png` is 0.123 s.

    Args:
        folder: holds the images.

    Attributes:
        bad_frames: files skipped so far because they could not be decoded.
    """

    def __init__(self, folder: Path) -> None:
        self.bad_frames = 0
        self._folder = folder
        self._name = _name_of(str(folder))
        self._paths: list[Path] = []
        self._decoder = ImageDecoder()

    async def __aenter__(self) -> Self:
        """List the folder; raises `CameraError` if it cannot be read or holds no images."""
        try:
            entries = sorted(self._folder.iterdir())
        except OSError as error:
            raise CameraError(f"{self._name}: {(error.strerror or 'cannot be read').lower()}") from error
        self._paths = [path for path in entries if path.suffix.lower() in IMAGE_SUFFIXES]
        if not self._paths:
            raise CameraError(f"{self._name}: no images in this folder ({', '.join(IMAGE_SUFFIXES)})")
        return self

    async def __aexit__(self, *exc_info: object) -> None:
        """End the decoder's process."""
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
                self.bad_frames += 1
                continue
            found = _TIME.search(path.stem)
            time_us = int(found.group(1)) if found else None
            yield CameraFrame(image, time_us, time.monotonic(), data if is_jpeg else None)
            await asyncio.sleep(0)


def _read(path: Path) -> bytes:
    """The content of a file; nothing if it cannot be read or is too large."""
    try:
        if not path.is_file() or path.stat().st_size > MAX_FILE_BYTES:
            return b""
        return path.read_bytes()
    except OSError:
        return b""
