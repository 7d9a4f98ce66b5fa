"""H.264 of a camera's images: in RTP over UDP, and in a fragmented MP4 file, made piece by piece in memory.

Images are compressed in a thread of their own, so the flight is not delayed; when an encoder is late, images
are left out. The stream in RTP is as QGroundControl and GStreamer expect it (PX4's Gazebo sends the same):
every second begins with a key frame that carries the stream's headers, so that a new receiver shows an image
within a second. Every fragment of a file begins with a key frame and is complete, so what was written before
a program ended can be played.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Mapping
from contextlib import suppress
from fractions import Fraction

import av
import numpy as np
from av.container import OutputContainer
from av.video.stream import VideoStream

from framerunner.wire.h264_rtp import RTP_CLOCK_HZ, describe_h264_rtp
from framerunner.wire.transports.sockets import Address, resolved_ipv4
from scenarios.models import Camera
from sitl.optics.painter import Image
from sitl.streaming.streams import VideoError

CLOCK_HZ = RTP_CLOCK_HZ  # of the time stamps


def add_h264_stream(
    container: OutputContainer, size_px: tuple[int, int], rate_hz: float, options: Mapping[str, str]
) -> VideoStream:
    """A stream without delay, each second of which begins with a key frame.

    Args:
        container: gets the stream.
        size_px: width and height of the images; a last odd column or row is left out, as usual H.264 has
            half the resolution of colour.
        rate_hz: of the images, nominal.
        options: of the encoder.
    """
    rate = Fraction(rate_hz).limit_denominator(1000)
    stream = container.add_stream("libx264", rate=rate, options=dict(options))
    stream.width, stream.height = (size // 2 * 2 for size in size_px)
    stream.pix_fmt = "yuv420p"
    context = stream.codec_context
    context.time_base = Fraction(1, CLOCK_HZ)
    context.gop_size = max(1, round(rate_hz))
    context.max_b_frames = 0
    context.thread_count = 1
    return stream


def h264_frame(stream: VideoStream, image: Image, stamp: int) -> av.VideoFrame:
    """An image, BGR, shape (height, width, 3), to be encoded.

    Args:
        stream: as `add_h264_stream` returns.
        image: at least as large as the stream.
        stamp: its time in the stream, units of 1/90000 s.
    """
    cut = np.ascontiguousarray(image[: stream.height, : stream.width])
    frame = av.VideoFrame.from_ndarray(cut, format="bgr24")
    frame.pts = stamp
    frame.time_base = Fraction(1, CLOCK_HZ)
    return frame


_PACKET_BYTES = 1200
_BITS_PER_PIXEL = 0.8  # of each image: thin coloured bars stay recognisable
_PRESET = {
    "preset": "ultrafast",
    "tune": "zerolatency",
    "profile": "baseline",
    "x264-params": "repeat-headers=1:scenecut=0",
}


class RtpSender:
    """Sends a camera's images to one address; they are lost if there is no receiver.

    Args:
        remote: host and port; the next port receives RTCP.
        camera: size and rate of the images.
        speed: simulated seconds a second; timestamps of the images count real seconds.

    Raises:
        LinkError: there is no such host.
        VideoError: the encoder cannot work with such images.
    """

    def __init__(self, remote: Address, camera: Camera, speed: float = 1.0) -> None:
        self._host, self._port = resolved_ipv4(remote, "RTP")
        self._speed = speed
        self._newest: tuple[Image, int] | None = None
        self._condition = threading.Condition()
        self._closing = False
        self._last_stamp, self._shift = -1, 0
        self._period = max(1, round(CLOCK_HZ / camera.rate_hz / speed))
        try:
            url = f"rtp://{self._host}:{self._port}?pkt_size={_PACKET_BYTES}"
            self._container = av.open(url, "w", format="rtp")
            self._stream = self._make_stream(camera)
        except (av.FFmpegError, OSError, ValueError) as error:
            raise VideoError(f"RTP to {self._host}:{self._port} cannot be sent ({error})") from error
        self._thread = threading.Thread(target=self._run, name="rtp", daemon=True)
        self._thread.start()

    def description(self) -> str:
        """The stream in SDP (RFC 8866), for `ffplay`, VLC and PyAV: `/video.sdp`."""
        return describe_h264_rtp(self._host, self._port)

    def send(self, image: Image, time_us: int) -> None:
        """Pass an image and its time of exposure (vehicle time) to the encoder; never blocks.

        The image is BGR, shape (height, width, 3), and must not be changed afterwards.
        """
        with self._condition:
            self._newest = (image, time_us)
            self._condition.notify()

    def close(self) -> None:
        """Send what is left and stop."""
        with self._condition:
            self._closing = True
            self._condition.notify()
        self._thread.join()

    def _make_stream(self, camera: Camera) -> VideoStream:
        size_px = (camera.width_px, camera.height_px)
        stream = add_h264_stream(self._container, size_px, camera.rate_hz, _PRESET)
        stream.bit_rate = int(stream.width * stream.height * camera.rate_hz * _BITS_PER_PIXEL)
        return stream

    def _run(self) -> None:
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._newest is not None or self._closing)
                newest, self._newest = self._newest, None
                closing = self._closing
            if newest is not None:
                image, time_us = newest
                self._send(h264_frame(self._stream, image, self._stamp(time_us)))
            if closing:
                break
        self._send(None)
        with suppress(av.FFmpegError, OSError):
            self._container.close()

    def _stamp(self, time_us: int) -> int:
        """A time in the stream; it goes on when a new drone begins at vehicle time zero."""
        stamp = round(time_us * CLOCK_HZ / 1e6 / self._speed)
        if stamp + self._shift <= self._last_stamp:
            self._shift = self._last_stamp + self._period - stamp
        self._last_stamp = stamp + self._shift
        return self._last_stamp

    def _send(self, frame: av.VideoFrame | None) -> None:
        """Send a frame, or what the encoder still holds; lost if the receiver is not reachable now."""
        with suppress(av.FFmpegError, OSError):
            for packet in self._stream.encode(frame):
                self._container.mux(packet)


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
