"""What makes images harder than painted ones: light, tint, blur and noise of the camera, and its compression.

Lens, exposure, sensor and colour are the simulated camera's own effects (`scenarios/imaging/effects.py`); a
level may have more of them, such as motion blur and a rolling shutter. Compression comes after them.
"""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO

import cv2
import numpy as np

from scenarios.imaging.effects import CameraEffects
from scenarios.models import Scenario
from vision.types import Image

Span = tuple[float, float]
"""The smallest and the largest number that is drawn."""

_NONE: Span = (0.0, 0.0)
_ONE: Span = (1.0, 1.0)

CLIP_IMAGES, CLIP_RATE_HZ = 8, 30.0
"""An image of an H.264 stream is the last one of such a clip, in which the drone flies and turns."""

_H264 = {"preset": "veryfast", "tune": "zerolatency", "x264-params": "scenecut=0"}
_BUFFER_S = 0.25  # of the encoder's rate control: a key frame may take so much of it


@dataclass(frozen=True, slots=True)
class CameraChain:
    """What happens between the painted scene and the image that a detector gets.

    Ranges are drawn from once for each scene, uniformly.

    Attributes:
        noise: standard deviation in every channel, of 255.
        blur_px: standard deviation of the lens's blur, pixels.
        light: factor of brightness.
        tint: factor of each channel, drawn apart.
        jpeg: quality 1..100 with halved resolution of colour (4:2:0); None: not compressed.
        h264_mbit_s: rate of an H.264 stream of 30 images a second; None: not compressed.
    """

    noise: float = 0.0
    blur_px: Span = _NONE
    light: Span = _ONE
    tint: Span = _ONE
    jpeg: int | None = None
    h264_mbit_s: float | None = None

    def shown(self) -> str:
        """What is not as in painted images, for people."""
        plain = CameraChain()
        parts = []
        for name in ("noise", "blur_px", "light", "tint", "jpeg", "h264_mbit_s"):
            value = getattr(self, name)
            if value != getattr(plain, name):
                low, high = value if isinstance(value, tuple) else (value, value)
                parts.append(f"{name} {low:g}" if low == high else f"{name} {low:g} to {high:g}")
        return ", ".join(parts)

    def applied_to(self, scenario: Scenario, stream: np.random.Generator) -> Scenario:
        """A scenario with a camera of this kind; its other effects stay."""
        if (self.noise, self.blur_px, self.light, self.tint) == (0.0, _NONE, _ONE, _ONE):
            return scenario
        light = stream.uniform(*self.light)
        red, green, blue = (float(factor) for factor in stream.uniform(*self.tint, 3))
        effects = scenario.camera.effects or CameraEffects()
        changes: dict[str, object] = {
            "illumination": max(0.02, effects.illumination * min(light, 1.0)),
            "fixed_gain": effects.fixed_gain * max(light, 1.0),
            "balance_rgb": tuple(
                old * new for old, new in zip(effects.balance_rgb, (red, green, blue), strict=True)
            ),
            "blur_px": stream.uniform(*self.blur_px),
        }
        if self.noise > 0.0:
            changes["read_noise"] = self.noise
        camera = scenario.camera.model_copy(update={"effects": effects.model_copy(update=changes)})
        return scenario.model_copy(update={"camera": camera})

    def compressed(self, clip: list[Image]) -> Image:
        """The last image of a clip, 1/30 s apart, as it arrives; without H.264 the others do not matter."""
        image = clip[-1]
        if self.h264_mbit_s is not None:
            image = through_h264(clip, self.h264_mbit_s)
        if self.jpeg is not None:
            image = through_jpeg(image, self.jpeg)
        return np.ascontiguousarray(image)


PRESETS = {
    "plain": CameraChain(),
    "tint": (_TINT := CameraChain(noise=3.0, blur_px=(0.4, 0.9), light=(0.45, 1.0), tint=(0.8, 1.15))),
    "jpeg": CameraChain(_TINT.noise, _TINT.blur_px, _TINT.light, _TINT.tint, jpeg=80),
    "h264": CameraChain(_TINT.noise, _TINT.blur_px, _TINT.light, _TINT.tint, h264_mbit_s=2.0),
}


def through_jpeg(image: Image, quality: int) -> Image:
    """An image after JPEG with halved resolution of colour, as cameras send it."""
    chroma = (cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420)
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality, *chroma])
    if not done:
        raise ValueError(f"an image of shape {image.shape} cannot be compressed")
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)


def through_h264(clip: list[Image], mbit_s: float) -> Image:
    """The last image of a clip after H.264 with halved resolution of colour.

    Args:
        clip: images 1/30 s apart, BGR, even numbers of rows and columns.
        mbit_s: bit rate, megabits a second.
    """
    import av  # an extra

    from sitl.streaming.h264 import CLOCK_HZ, add_h264_stream, h264_frame

    file = BytesIO()
    height, width = clip[0].shape[:2]
    bits = round(1e6 * mbit_s)
    limits = {"maxrate": str(bits), "bufsize": str(round(_BUFFER_S * bits))}
    with av.open(file, "w", format="matroska") as container:
        stream = add_h264_stream(container, (width, height), CLIP_RATE_HZ, {**_H264, **limits})
        stream.bit_rate = bits
        for number, image in enumerate(clip):
            frame = h264_frame(stream, image, round(number * CLOCK_HZ / CLIP_RATE_HZ))
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    file.seek(0)
    last = None
    with av.open(file, "r") as sent:
        for frame in sent.decode(video=0):
            last = frame
    assert last is not None  # as many as were encoded
    return np.ascontiguousarray(last.to_ndarray(format="bgr24"), np.uint8)
