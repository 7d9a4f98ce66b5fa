"""Video as H.264 in RTP over UDP, as QGroundControl and GStreamer expect it (PX4's Gazebo sends the same).

Images are compressed in a thread of their own, the newest only: when the encoder is late, images are left
out and the flight is not delayed. Every second begins with a key frame that carries the stream's headers, so
that a new receiver shows an image within a second.
"""

from __future__ import annotations

import threading
from contextlib import suppress

import av
from av.video.stream import VideoStream

from framerunner.wire.h264_rtp import describe_h264_rtp
from framerunner.wire.transports.sockets import Address, resolved_ipv4
from scenarios.models import Camera
from sitl.optics.painter import Image
from sitl.streaming.h264 import CLOCK_HZ, add_h264_stream, h264_frame
from sitl.streaming.streams import VideoError

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
