"""The process in which images of unknown origin are decoded: `python -m vision.worker SOCKET MEMORY`.

It is started by `vision.worker_process`, which can end it at any moment; when its parent is gone it ends by
itself. SOCKET and MEMORY are inherited file descriptors. Requests come by the socket; each is answered by one
`ANSWER`, and an image by its pixels at the beginning of the shared memory.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import resource
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator

import cv2
import numpy as np

from vision.types import Image
from vision.worker_protocol import ANSWER, DECODE_LIMIT_S, MAX_IMAGE_BYTES, REQUEST, Reply, Request

MEMORY_LIMIT_BYTES = 4 << 30
_LOOK_S = 1.0


class _Capture:
    """What OpenCV opens, read on a thread of its own, for it blocks; only the latest image is kept."""

    def __init__(self, url: str, limit_ms: int) -> None:
        self._parent = os.getppid()
        with _limited(2 * limit_ms / 1000):
            self._capture = _opened(url, limit_ms)
        self._is_file = self._capture.get(cv2.CAP_PROP_FRAME_COUNT) > 0
        self._latest: tuple[Image, float] | None = None
        self._ended = False
        self._changed = threading.Condition()

    def start(self) -> bool:
        """Begin to read; False if it could not be opened."""
        if not self._capture.isOpened():
            return False
        threading.Thread(target=self._read, daemon=True).start()
        return True

    def next(self) -> tuple[Reply, Image | None, float]:
        """Wait for an image that has not been taken yet, or the end."""
        with self._changed:
            while not self._changed.wait_for(lambda: self._latest is not None or self._ended, _LOOK_S):
                if os.getppid() != self._parent:  # it was killed, and the stream may be silent for ever
                    os._exit(0)
            taken, self._latest = self._latest, None
        if taken is None:
            return (Reply.END_OF_FILE if self._is_file else Reply.END_OF_STREAM), None, 0.0
        return Reply.IMAGE, *taken

    def _read(self) -> None:
        rate_hz = self._capture.get(cv2.CAP_PROP_FPS)
        period_s = 1.0 / rate_hz if self._is_file and 0 < rate_hz < 1000 else 0.0  # a file at its own speed
        next_s = time.monotonic()
        while True:
            try:
                done, image = self._capture.read()
            except cv2.error:
                done, image = False, None
            with self._changed:
                if done and image is not None:
                    self._latest = (np.asarray(image, np.uint8), time.monotonic())
                self._ended = not done
                self._changed.notify()
            if not done:
                return
            next_s += period_s
            time.sleep(max(0.0, next_s - time.monotonic()) if period_s else 0.0)


def _opened(url: str, limit_ms: int) -> cv2.VideoCapture:
    if url.isdecimal():
        return cv2.VideoCapture(int(url))
    settings = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, limit_ms, cv2.CAP_PROP_READ_TIMEOUT_MSEC, limit_ms]
    capture = cv2.VideoCapture(url, cv2.CAP_FFMPEG, settings)
    return capture if capture.isOpened() else cv2.VideoCapture(url)


def _decoded(data: bytes) -> Image | None:
    """Decode an image; None if it is none."""
    try:
        with _limited(2 * DECODE_LIMIT_S):
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    except (cv2.error, MemoryError):
        return None
    return None if image is None else np.asarray(image, np.uint8)


@contextlib.contextmanager
def _limited(limit_s: float) -> Iterator[None]:
    """End the process if the work takes longer, also in the middle of native code; the parent may be gone."""
    signal.setitimer(signal.ITIMER_REAL, limit_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def _received(link: socket.socket, length: int) -> bytes:
    """Receive so many bytes; if the parent is gone, so is this process."""
    data = bytearray()
    while len(data) < length:
        chunk = link.recv(min(1 << 20, length - len(data)))
        if not chunk:
            os._exit(0)
        data += chunk
    return bytes(data)


def serve(link: socket.socket, memory: mmap.mmap) -> None:
    """Answer requests until the parent is gone.

    Args:
        link: to the parent.
        memory: shared with the parent, `MAX_IMAGE_BYTES` long.
    """
    capture: _Capture | None = None
    shown = np.frombuffer(memory, np.uint8)
    link.sendall(ANSWER.pack(Reply.READY, 0, 0, 0.0))
    while True:
        kind, length = REQUEST.unpack(_received(link, REQUEST.size))
        data = _received(link, length)
        reply, image, received_s = Reply.NO_IMAGE, None, 0.0
        if kind == Request.DECODE:
            image = _decoded(data)
        elif kind == Request.OPEN:
            limit_ms, _, url = data.decode().partition(" ")
            capture = _Capture(url, int(limit_ms))
            reply = Reply.OPENED if capture.start() else Reply.NOT_OPENED
        elif capture is not None:
            reply, image, received_s = capture.next()
        height, width = 0, 0
        if image is not None:
            fits = image.ndim == 3 and image.shape[2] == 3 and image.size <= MAX_IMAGE_BYTES
            reply = Reply.IMAGE if fits else Reply.NO_IMAGE
            if fits:
                height, width = image.shape[:2]
                shown[: image.size] = image.reshape(-1)
        link.sendall(ANSWER.pack(reply, width, height, received_s))


def main() -> None:
    """Serve on the descriptors that the parent left open."""
    with contextlib.suppress(ValueError, OSError):  # not every system has these limits
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT_BYTES, MEMORY_LIMIT_BYTES))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    cv2.setNumThreads(1)
    link = socket.socket(fileno=int(sys.argv[1]))
    try:
        serve(link, mmap.mmap(int(sys.argv[2]), MAX_IMAGE_BYTES))
    except OSError:  # the parent is gone
        os._exit(0)


if __name__ == "__main__":
    main()
