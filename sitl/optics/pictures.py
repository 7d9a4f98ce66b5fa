"""Pictures on the hall's walls: image files, photographs of scikit-image, or drawn ones in their places.

scikit-image is no dependency, and its photographs are not copied: they are read where it is installed.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from zlib import crc32

import cv2
import numpy as np

from framerunner.geometry.vectors import Vec3
from scenarios.imaging.furnishings import PHOTOGRAPHS, Picture
from scenarios.random_numbers import random_stream
from sitl.optics.texture import Image, Pyramid, read_photograph

_MAX_EDGE_PX = 512
_DRAWN_PX = (384, 512)  # height and width of a picture that is drawn
_SHAPES = 40


def picture_pyramids(pictures: Sequence[Picture]) -> list[Pyramid]:
    """The images of pictures, each stretched to its size.

    Raises:
        TextureError: a file cannot be read.
    """
    installed = find_spec("skimage") if pictures else None
    folders = [] if installed is None else [Path(each) for each in installed.submodule_search_locations or ()]
    images = {name: _image(name, folders) for name in {picture.image for picture in pictures}}
    return [_pyramid(picture, images[picture.image]) for picture in pictures]


def _image(name: str, folders: Sequence[Path]) -> Image:
    if name not in PHOTOGRAPHS:
        return read_photograph(Path(name))
    files = (folder / "data" / f"{name}{ending}" for folder in folders for ending in (".png", ".jpg"))
    path = next((file for file in files if file.is_file()), None)
    return _drawn(name) if path is None else read_photograph(path)


def _pyramid(picture: Picture, image: Image) -> Pyramid:
    scale = _MAX_EDGE_PX / max(picture.width_m, picture.height_m)
    size = (max(1, round(scale * picture.width_m)), max(1, round(scale * picture.height_m)))
    base = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
    return Pyramid.of(base, picture.width_m, picture.height_m)


def _drawn(name: str) -> Image:
    """A picture of random areas and lines before a gradient; the same for the same name."""
    stream = random_stream(crc32(name.encode()), "pictures")
    height, width = _DRAWN_PX

    def colour() -> Vec3:
        blue, green, red = (255.0 * stream.random(3)).tolist()
        return (blue, green, red)

    def place() -> tuple[int, int]:
        return (int(stream.random() * width), int(stream.random() * height))

    above, below = np.array(colour()), np.array(colour())
    shares = np.linspace(0.0, 1.0, height)[:, None, None]
    drawn = np.rint(above + shares * (below - above)).repeat(width, axis=1).astype(np.uint8)
    image: Image = np.ascontiguousarray(drawn)
    for index in range(_SHAPES):
        reach = max(8, int(stream.random() ** 2 * width / 3))
        if index % 3 == 0:
            x, y = place()
            cv2.rectangle(image, (x, y), (x + reach, y + reach * 2 // 3), colour(), -1 if index % 2 else 6)
        elif index % 3 == 1:
            axes = (reach // 2, max(2, reach // 4))
            cv2.ellipse(image, place(), axes, 360.0 * stream.random(), 0.0, 360.0, colour(), -1)
        else:
            cv2.line(image, place(), place(), colour(), 1 + reach // 24)
    return np.asarray(cv2.GaussianBlur(image, (0, 0), 1.0), np.uint8)
