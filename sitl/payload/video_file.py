"""A camera's images as H.264 in a fragmented MP4 file, made piece by piece in memory.

Images are compressed in a thread of their own, so the flight is not delayed; when the encoder is late, images
are left out. Every fragment begins with a key frame and is complete, so what was written before a program
ended can be played.
"""

from __future__ import annotations

import queue
import threading
from contextlib import suppress

import av

from sitl.optics.painter import Image
from sitl.streaming.h264 import CLOCK_HZ, add_h264_stream, h264_frame

_WAITING = 8  # images; more are left out
_OPTIONS = {"movflags": "frag_keyframe+empty_moov+default_base_moof"}
_CODEC = {"preset": "ultrafast", "tune": "zerolatency", "crf": "20"}  # visually close to the image


class VideoEncoder:
    """Compresses images; `take` returns what of the file is done, and after `end` its last bytes.

    Args:
        width_px: of the images; a last odd column or row is left out.
        height_px: of the images.
        rate_hz: of the images, nominal; each has its own time.

    Attributes:
        failed: whether the encoder has ended by an error.
    """

    def __init__(self, width_px: int, height_px: int, rate_hz: float) -> None:
        self._size_px = (width_px, height_px)
        self._rate_hz = rate_hz
        self._images: queue.SimpleQueue[tuple[Image, int] | None] = queue.SimpleQueue()
        self._pieces: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._first_us = -1
        self.failed = False
        self._thread = threading.Thread(target=self._run, name="video file", daemon=True)
        self._thread.start()

    def show(self, image: Image, time_us: int) -> None:
        """Add an image with its time, vehicle time; the first one has time 0 in the file. Never blocks.

        The image is BGR, shape (height, width, 3), and must not be changed afterwards.
        """
        if self._first_us < 0:
            self._first_us = time_us
        if self._images.qsize() < _WAITING:
            self._images.put((image, time_us - self._first_us))

    def take(self) -> bytes:
        """The next bytes of the file; empty if there are none now."""
        pieces: list[bytes] = []
        with suppress(queue.Empty):
            while True:
                pieces.append(self._pieces.get_nowait())
        return b"".join(pieces)

    def end(self) -> None:
        """Let the thread compress what waits and end the file. Never blocks; see `has_ended`."""
        self._images.put(None)

    @property
    def has_ended(self) -> bool:
        """Whether the thread has ended, so that the next `take` returns the last bytes."""
        return not self._thread.is_alive()

    def wait(self) -> None:
        """Wait for the end that was requested by `end`."""
        self._thread.join()

    def write(self, data: bytes) -> int:
        """Take bytes of the file from the multiplexer, which sees this object as the file."""
        self._pieces.put(bytes(data))
        return len(data)

    def _run(self) -> None:
        try:
            with av.open(self, "w", format="mp4", options=_OPTIONS) as container:
                stream = add_h264_stream(container, self._size_px, self._rate_hz, _CODEC)
                while (given := self._images.get()) is not None:
                    image, time_us = given
                    frame = h264_frame(stream, image, round(time_us * CLOCK_HZ / 1e6))
                    for packet in stream.encode(frame):
                        container.mux(packet)
                for packet in stream.encode(None):
                    container.mux(packet)
        except (av.FFmpegError, OSError, ValueError):
            self.failed = True
            while self._images.get() is not None:  # until `end`
                pass
