"""H.264 of a camera's images, each with its own time: what the stream in RTP and the video file share."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import av
import numpy as np
from av.container import OutputContainer
from av.video.stream import VideoStream

from framerunner.wire.h264_rtp import RTP_CLOCK_HZ
from sitl.optics.painter import Image

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
