"""Pictures behind the gates: photographs, recoloured ones, and textures with shapes that are no gates."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from framerunner.vision_evaluation.backgrounds import Backgrounds
from vision.types import Image

_SIZE = (480, 640)
_COPIES = 3  # of a photograph, in other colours
_SHARE_DRAWN = 0.25


def training_backgrounds(folder: Path, stream: np.random.Generator) -> Backgrounds:
    """The photographs of a folder, copies of them in other colours, and drawn pictures."""
    photographs = Backgrounds.of_folder(folder).photographs
    coloured = [_in_other_colours(one, stream) for one in photographs for _ in range(_COPIES)]
    pictures = [*photographs, *coloured]
    count = round(len(pictures) * _SHARE_DRAWN / (1.0 - _SHARE_DRAWN))
    drawn = [_drawn(stream) for _ in range(count)]
    return Backgrounds((*pictures, *drawn))


def _in_other_colours(photograph: Image, stream: np.random.Generator) -> Image:
    """Turned hue, stronger saturation, another contrast; then perhaps shapes on it."""
    hsv = cv2.cvtColor(photograph, cv2.COLOR_BGR2HSV).astype(np.float32)
    hsv[..., 0] = (hsv[..., 0] + stream.uniform(0, 180)) % 180
    hsv[..., 1] = np.clip(hsv[..., 1] * stream.uniform(0.6, 2.5) + stream.uniform(0, 40), 0, 255)
    hsv[..., 2] = 255.0 * (hsv[..., 2] / 255.0) ** stream.uniform(0.6, 1.6)
    turned = np.asarray(cv2.cvtColor(hsv.astype(np.uint8), cv2.COLOR_HSV2BGR), np.uint8)
    return _with_shapes(turned, stream, int(stream.integers(0, 12)))


def _drawn(stream: np.random.Generator) -> Image:
    """Dead leaves (shapes upon shapes, statistically like photographs), noise of 1/f, or a gradient."""
    kind = int(stream.integers(3))
    if kind == 0:
        picture = _leaves(stream)
    elif kind == 1:
        picture = _cloud(stream)
    else:
        corners = stream.uniform(0, 255, (2, 2, 3)).astype(np.float32)
        picture = np.asarray(cv2.resize(corners, _SIZE[::-1], interpolation=cv2.INTER_LINEAR), np.uint8)
    return _with_shapes(picture, stream, int(stream.integers(0, 25)))


def _leaves(stream: np.random.Generator) -> Image:
    picture = np.zeros((*_SIZE, 3), np.uint8)
    for _ in range(900):
        size = 4.0 / stream.uniform(0.02, 1.0)
        centre = stream.uniform(-20, 20, 2) + stream.uniform(0, 1, 2) * _SIZE[::-1]
        colour = _colour(stream, pure=float(stream.uniform(0, 1)) < 0.3)
        box = (tuple(centre.tolist()), (size, size * stream.uniform(0.3, 1.0)), stream.uniform(0, 180))
        if stream.random() < 0.5:
            cv2.ellipse(picture, box, colour, -1, cv2.LINE_AA)
        else:
            cv2.fillConvexPoly(picture, cv2.boxPoints(box).astype(np.int32), colour, cv2.LINE_AA)
    return picture


def _cloud(stream: np.random.Generator) -> Image:
    rows, columns = np.fft.fftfreq(_SIZE[0])[:, None], np.fft.fftfreq(_SIZE[1])[None]
    frequency = np.hypot(rows, columns)
    frequency[0, 0] = 1.0
    falling = frequency ** -float(stream.uniform(0.7, 1.6))
    planes = np.stack(
        [np.fft.ifft2(np.fft.fft2(stream.normal(size=_SIZE)) * falling).real for _ in range(3)], -1
    )
    mixed = planes @ stream.normal(size=(3, 3))
    mixed = (mixed - mixed.mean()) / mixed.std()
    return np.clip(128.0 + mixed * stream.uniform(25, 70), 0, 255).astype(np.uint8)


def _with_shapes(picture: Image, stream: np.random.Generator, count: int) -> Image:
    """Shapes that are no gates, of pure colours: sheets, bars, open, round and three-cornered rings."""
    picture = np.ascontiguousarray(picture)
    height, width = picture.shape[:2]
    for _ in range(count):
        colour = _colour(stream, pure=stream.random() < 0.8)
        size = np.exp(stream.uniform(np.log(10.0), np.log(0.4 * width)))
        x, y = stream.uniform(0, width), stream.uniform(0, height)
        thick = max(1, round(size * stream.uniform(0.03, 0.12)))
        box = ((x, y), (size, size * stream.uniform(0.3, 1.5)), stream.normal(0, 12))
        corners = np.rint(cv2.boxPoints(box)).astype(np.int32)
        kind = int(stream.integers(6))
        if kind == 0:
            cv2.fillConvexPoly(picture, corners, colour, cv2.LINE_AA)
        elif kind == 1:
            cv2.ellipse(picture, box, colour, thick, cv2.LINE_AA)
        elif kind == 2:  # three sides or two
            sides = np.roll(corners, int(stream.integers(4)), axis=0)[: int(stream.integers(3, 5))]
            cv2.polylines(picture, [sides], False, colour, thick, cv2.LINE_AA)
        elif kind == 3:
            a, b = corners[0].tolist(), corners[2].tolist()
            cv2.line(picture, a, b, colour, thick, cv2.LINE_AA)
        elif kind == 4:
            cv2.polylines(picture, [corners[:3]], True, colour, thick, cv2.LINE_AA)
        else:  # a ring that is not coloured: a window, a screen
            grey = int(stream.integers(256))
            cv2.polylines(picture, [corners], True, (grey, grey, grey), thick, cv2.LINE_AA)
    return picture


def _colour(stream: np.random.Generator, *, pure: bool) -> tuple[int, int, int]:
    if pure:
        value = np.where(stream.random(3) < 0.45, stream.uniform(120, 255, 3), stream.uniform(0, 60, 3))
    else:
        value = stream.uniform(0, 255, 3)
    blue, green, red = (int(each) for each in value)
    return (blue, green, red)
