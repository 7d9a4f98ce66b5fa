"""The process in which images of unknown origin are decoded, and its protocol.

OpenCV and its codecs are native code. A hostile image can make them hang, crash or take all memory, and a
thread in them cannot be stopped; a process can. `worker_process` starts
`python -m vision.worker SOCKET MEMORY` with two inherited file descriptors. Requests are sent over the
socket; each is answered by one `ANSWER`, and an image by its pixels at the beginning of the shared memory.
When its parent has ended, the process ends too.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import re
import resource
import signal
import socket
import struct
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from enum import IntEnum

import cv2
import numpy as np

from framerunner.wire.h264_rtp import describe_h264_rtp
from vision.streams.stream_clock import StreamClock
from vision.types import Image

MAX_IMAGE_BYTES = 3 * 4096 * 4096
MEMORY_LIMIT_BYTES = 4 << 30
DECODE_LIMIT_S = 0.5
"""Longest time for one image: thirty times what a baseline JPEG of 1920 x 1080 pixels takes."""
_PARENT_CHECK_S = 1.0
_LATEST = "fflags;nobuffer|analyzeduration;1000000|fpsprobesize;0"
_LIVE_OPTIONS = {  # FFmpeg's, in OpenCV's form; of live streams the latest image is wanted, not every one
    "rtsp": f"rtsp_transport;tcp|{_LATEST}",
    "tcp": _LATEST,
    "udp": _LATEST,
    # FFmpeg's queue for packets in the wrong order refuses all packets of a sender that was restarted.
    "rtp": f"protocol_whitelist;file,udp,rtp|reorder_queue_size;0|{_LATEST}",
}
_WITHOUT_END = ("udp://", "rtp://")  # an error is one packet that is damaged or somebody else's
_RETRY_S = 0.01
_DEVICE = re.compile(r"/dev/video(\d{1,3})")
_ERRORS_ONLY = "16"  # AV_LOG_ERROR of FFmpeg
_OUTPUTS = (1, 2)  # OpenCV prints FFmpeg's log to the standard output
_MAX_LOG_BYTES = 1 << 16
_MAX_DEVICE_DELAY_S = 1.0
REQUEST = struct.Struct("<BI")  # kind, and the number of bytes that follow
ANSWER = struct.Struct("<BIId")
"""Kind, width and height (pixels), monotonic time of capture or arrival (seconds).

With `WorkerReply.NOT_OPENED` the first number is a `Problem`.
"""


class WorkerRequest(IntEnum):
    """What the process is to do."""

    DECODE = 1  # an image file follows
    OPEN = 2  # time limit in milliseconds, a space and the URL follow; a number is a device
    NEXT = 3  # the next image of what was opened


class WorkerReply(IntEnum):
    """What an answer means."""

    IMAGE = 1
    NO_IMAGE = 2  # it cannot be decoded, or is too large
    READY = 3  # sent once, without a request, when the process can work
    OPENED = 4
    NOT_OPENED = 5
    END_OF_FILE = 6
    END_OF_STREAM = 7


class Problem(IntEnum):
    """Why a camera could not be opened, as far as its kind and FFmpeg's log tell."""

    UNKNOWN = 0
    NO_LOGIN = 1
    NOT_FOUND = 2
    REFUSED = 3
    UNKNOWN_HOST = 4
    UNREACHABLE = 5
    NOT_OUR_ADDRESS = 6
    PORT_IN_USE = 7
    NO_DEVICE = 8


_LOGGED = (
    (r"(failed:|HTTP error) 40[13]\b", Problem.NO_LOGIN),
    (r"(failed:|HTTP error) 404\b", Problem.NOT_FOUND),
    (r"failed: Connection refused", Problem.REFUSED),
    (r"Failed to resolve hostname", Problem.UNKNOWN_HOST),
    (r"failed: (No route to host|Network is unreachable)", Problem.UNREACHABLE),
    (r"failed: Cannot assign requested address", Problem.NOT_OUR_ADDRESS),
    (r"failed: Address already in use", Problem.PORT_IN_USE),
)


def problem_in(log: str) -> Problem:
    """Why FFmpeg could not open something, by the errors that it logged."""
    return next((problem for words, problem in _LOGGED if re.search(words, log)), Problem.UNKNOWN)


class _Capture:
    """What OpenCV opens, read on a thread because it blocks; only the latest image is kept."""

    def __init__(self, url: str, limit_ms: int) -> None:
        self._parent = os.getppid()
        device = _device_number(url)
        with _limited(2 * limit_ms / 1000), _logged() as log:
            self._capture = _opened(url, limit_ms) if device is None else cv2.VideoCapture(device)
            self.problem = problem_in(log()) if device is None else Problem.NO_DEVICE
        self._is_file = self._capture.get(cv2.CAP_PROP_FRAME_COUNT) > 0
        self._has_end = not url.lower().startswith(_WITHOUT_END)
        self._clock = StreamClock() if device is None else None
        self._latest: tuple[Image, float] | None = None
        self._ended = False
        self._changed = threading.Condition()

    def start(self) -> bool:
        """Start to read; False if it could not be opened."""
        if not self._capture.isOpened():
            return False
        threading.Thread(target=self._read, daemon=True).start()
        return True

    def next(self) -> tuple[WorkerReply, Image | None, float]:
        """Wait for an image that has not been taken yet, or the end."""
        with self._changed:
            while not self._changed.wait_for(
                lambda: self._latest is not None or self._ended, _PARENT_CHECK_S
            ):
                if os.getppid() != self._parent:  # it was killed, and the stream may stay silent
                    os._exit(0)
            taken, self._latest = self._latest, None
        if taken is None:
            return (WorkerReply.END_OF_FILE if self._is_file else WorkerReply.END_OF_STREAM), None, 0.0
        return WorkerReply.IMAGE, *taken

    def _captured_s(self) -> float | None:
        """Monotonic time of the image read last; None while it is not known. A file's is when it was read."""
        now_s = time.monotonic()
        if self._is_file:
            return now_s
        stamp_s = self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0
        if self._clock is not None:
            return self._clock.captured_s(stamp_s, now_s)
        # Most drivers stamp images with this machine's monotonic clock, others with the time of day.
        return stamp_s if 0.0 <= now_s - stamp_s < _MAX_DEVICE_DELAY_S else now_s

    def _read(self) -> None:
        rate_hz = self._capture.get(cv2.CAP_PROP_FPS)
        period_s = 1.0 / rate_hz if self._is_file and 0 < rate_hz < 1000 else 0.0  # a file at its own speed
        next_s = time.monotonic()
        while True:
            try:
                done, image = self._capture.read()
            except cv2.error:
                done, image = False, None
            captured_s = self._captured_s() if done else None
            with self._changed:
                if image is not None and captured_s is not None:
                    self._latest = (np.asarray(image, np.uint8), captured_s)
                self._ended = not done and self._has_end
                self._changed.notify()
            if self._ended:
                return
            if not done:
                time.sleep(_RETRY_S)
            next_s += period_s
            time.sleep(max(0.0, next_s - time.monotonic()) if period_s else 0.0)


def _device_number(url: str) -> int | None:
    """The number of a video device of this machine; None if it is something else."""
    if url.isdecimal():
        return int(url)
    found = _DEVICE.fullmatch(os.path.realpath(url)) if url.startswith("/dev/") else None
    return None if found is None else int(found.group(1))


@contextlib.contextmanager
def _logged() -> Iterator[Callable[[], str]]:
    """Collect what native code logs; gives a function that returns the beginning of it."""
    os.environ |= {"OPENCV_FFMPEG_DEBUG": "1", "OPENCV_FFMPEG_LOGLEVEL": _ERRORS_ONLY}
    receiver, sender = os.pipe()
    os.set_blocking(sender, False)  # when the pipe is full, the rest is lost
    os.set_blocking(receiver, False)
    before = [os.dup(each) for each in _OUTPUTS]
    for each in _OUTPUTS:
        os.dup2(sender, each)

    def log() -> str:
        try:
            return os.read(receiver, _MAX_LOG_BYTES).decode("ascii", "replace")
        except BlockingIOError:
            return ""

    try:
        yield log
    finally:
        for each, was in zip(_OUTPUTS, before, strict=True):
            os.dup2(was, each)
        for each in (*before, sender, receiver):
            os.close(each)


def _opened(url: str, limit_ms: int) -> cv2.VideoCapture:
    settings = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, limit_ms, cv2.CAP_PROP_READ_TIMEOUT_MSEC, limit_ms]
    scheme, _, place = url.partition("://")
    options = _LIVE_OPTIONS.get(scheme.lower())
    if options is not None:
        os.environ.setdefault("OPENCV_FFMPEG_CAPTURE_OPTIONS", options)
        settings += [cv2.CAP_PROP_N_THREADS, 1]  # with more, images come later by one for each
    if scheme.lower() != "rtp":
        capture = cv2.VideoCapture(url, cv2.CAP_FFMPEG, settings)
        return capture if capture.isOpened() or options is not None else cv2.VideoCapture(url)
    host, _, port = place.rstrip("/").rpartition(":")
    with tempfile.NamedTemporaryFile("w", suffix=".sdp", newline="") as file:
        file.write(describe_h264_rtp(host, int(port)))
        file.flush()
        return cv2.VideoCapture(file.name, cv2.CAP_FFMPEG, settings)


def _decoded(data: bytes) -> Image | None:
    """Decode an image; None if it cannot be decoded."""
    try:
        with _limited(2 * DECODE_LIMIT_S):
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    except (cv2.error, MemoryError):
        return None
    return None if image is None else np.asarray(image, np.uint8)


@contextlib.contextmanager
def _limited(limit_s: float) -> Iterator[None]:
    """End the process if the work takes longer, even inside native code; the parent may have ended."""
    signal.setitimer(signal.ITIMER_REAL, limit_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def _received(link: socket.socket, length: int) -> bytes:
    """Receive this number of bytes; end the process if the parent has closed the socket."""
    data = bytearray()
    while len(data) < length:
        chunk = link.recv(min(1 << 20, length - len(data)))
        if not chunk:
            os._exit(0)
        data += chunk
    return bytes(data)


def _serve(link: socket.socket, memory: mmap.mmap) -> None:
    """Answer requests until the parent has ended."""
    capture: _Capture | None = None
    pixels = np.frombuffer(memory, np.uint8)
    link.sendall(ANSWER.pack(WorkerReply.READY, 0, 0, 0.0))
    while True:
        kind, length = REQUEST.unpack(_received(link, REQUEST.size))
        data = _received(link, length)
        reply, image, received_s = WorkerReply.NO_IMAGE, None, 0.0
        height, width = 0, 0
        if kind == WorkerRequest.DECODE:
            image = _decoded(data)
        elif kind == WorkerRequest.OPEN:
            limit_ms, _, url = data.decode().partition(" ")
            capture = None  # the one before has ended; it is closed before the next one is opened
            capture = _Capture(url, int(limit_ms))
            reply = WorkerReply.OPENED if capture.start() else WorkerReply.NOT_OPENED
            width = capture.problem
        elif capture is not None:
            reply, image, received_s = capture.next()
        if image is not None:
            fits = image.ndim == 3 and image.shape[2] == 3 and image.size <= MAX_IMAGE_BYTES
            reply = WorkerReply.IMAGE if fits else WorkerReply.NO_IMAGE
            if fits:
                height, width = image.shape[:2]
                pixels[: image.size] = image.reshape(-1)
        link.sendall(ANSWER.pack(reply, width, height, received_s))


def main() -> None:
    """Serve on the descriptors that the parent passed."""
    with contextlib.suppress(ValueError, OSError):  # not every system has these limits
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT_BYTES, MEMORY_LIMIT_BYTES))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    cv2.setNumThreads(1)
    link = socket.socket(fileno=int(sys.argv[1]))
    try:
        _serve(link, mmap.mmap(int(sys.argv[2]), MAX_IMAGE_BYTES))
    except OSError:  # the parent has ended
        os._exit(0)


if __name__ == "__main__":
    main()
