"""Pictures on flat faces, each as a pyramid of ever smaller images (mip map).

L. Williams, "Pyramidal parametrics", Computer Graphics 17(3), 1983: of each part of a face that level is
painted whose pixels are about as large as the canvas's, so that nothing is skipped between them.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.errors import UserError
from framerunner.files.text_file import TextError, read_bytes
from framerunner.geometry.vectors import Vec3
from scenarios.imaging.textures import Texture
from sitl.optics.patterns import TILE_M, pattern_tile

Image = npt.NDArray[np.uint8]
Floats = npt.NDArray[np.float64]

_MAX_FILE_BYTES = 30_000_000
_MAX_EDGE_PX = 2048  # of the base of a pyramid


class TextureError(UserError):
    """A picture that cannot be used; the message is one line for people."""


@dataclass(frozen=True, slots=True, eq=False)
class Pyramid:
    """A picture in ever smaller sizes.

    Attributes:
        levels: BGR, each a quarter as wide and high as the one before it, shape (height, width, 3).
        width_m: of the picture on a face.
        height_m: the same.
    """

    levels: tuple[Image, ...]
    width_m: float
    height_m: float

    @classmethod
    def of(cls, picture: Image, width_m: float, height_m: float) -> Pyramid:
        """All levels of a picture, down to one with an edge of one pixel."""
        levels = [picture]
        while min(levels[-1].shape[:2]) > 1:
            height, width = (max(1, px // 4) for px in levels[-1].shape[:2])
            smaller = cv2.resize(levels[-1], (width, height), interpolation=cv2.INTER_AREA)
            levels.append(np.asarray(smaller, np.uint8))
        return cls(tuple(levels), width_m, height_m)

    def dimmed(self, share: float) -> Pyramid:
        """The same in less light."""
        table = np.rint(share * np.arange(256.0)).astype(np.uint8)
        levels = tuple(np.asarray(cv2.LUT(level, table), np.uint8) for level in self.levels)
        return Pyramid(levels, self.width_m, self.height_m)


@dataclass(frozen=True, slots=True, eq=False)
class FaceTexture:
    """A picture on a face, which is not larger than it.

    Attributes:
        pyramid: as it is seen, its shading included.
        to_arena: from (across, down, 1), shares of the picture's width and height, to (x, y, z, 1) in arena
            axes, shape (4, 3).
        normal_arena: unit vector to the side from which it is seen.
    """

    pyramid: Pyramid
    to_arena: Floats
    normal_arena: Vec3

    @property
    def px_m(self) -> float:
        """Pixels of the base to a metre, in the direction that has more of them."""
        height, width = self.pyramid.levels[0].shape[:2]
        return max(float(width) / self.pyramid.width_m, float(height) / self.pyramid.height_m)


def on_face(pyramid: Pyramid, origin: Floats, across: Floats, down: Floats, normal: Vec3) -> FaceTexture:
    """Put a picture on a plane.

    Args:
        pyramid: the picture.
        origin: of its upper left corner, arena axes, metres.
        across: unit vector from there along its upper edge.
        down: the same along its left edge.
        normal: to the side from which it is seen.
    """
    to_arena = np.zeros((4, 3))
    to_arena[:3, 0] = across * pyramid.width_m
    to_arena[:3, 1] = down * pyramid.height_m
    to_arena[:, 2] = np.append(origin, 1.0)
    return FaceTexture(pyramid, to_arena, normal)


def texture_pyramid(texture: Texture, width_m: float, height_m: float) -> Pyramid:
    """Cover a face with a texture.

    Args:
        texture: a pattern that is repeated, or a photograph that is mirrored.
        width_m: of the face.
        height_m: the same.

    Raises:
        TextureError: the photograph cannot be read.
    """
    if texture.photograph is None:
        assert texture.pattern is not None  # the model has checked it
        tile, tile_m = pattern_tile(texture.pattern, texture.seed), (TILE_M, TILE_M)
    else:
        photograph = read_photograph(Path(texture.photograph))
        tile = np.vstack([photograph, photograph[::-1]])
        tile = np.hstack([tile, tile[:, ::-1]])
        share = photograph.shape[0] / photograph.shape[1]
        tile_m = (2.0 * texture.width_m, 2.0 * texture.width_m * share)
    px_m = min(tile.shape[1] / tile_m[0], _MAX_EDGE_PX / max(width_m, height_m))
    size = (max(1, round(px_m * tile_m[0])), max(1, round(px_m * tile_m[1])))
    tile = np.asarray(cv2.resize(tile, size, interpolation=cv2.INTER_AREA), np.uint8)
    rows, columns = (np.arange(max(1, ceil(px_m * edge_m))) for edge_m in (height_m, width_m))
    picture = tile[rows % size[1]][:, columns % size[0]]
    return Pyramid.of(picture, len(columns) / px_m, len(rows) / px_m)


def read_photograph(path: Path) -> Image:
    """Read an image file: BGR.

    Raises:
        TextureError: it cannot be read, or is no image.
    """
    try:
        data = np.frombuffer(read_bytes(path, _MAX_FILE_BYTES), np.uint8)
    except TextError as error:
        raise TextureError(f"photograph {path}: {error}; give the path of a JPEG or PNG file") from None
    image = cv2.imdecode(data, cv2.IMREAD_COLOR) if len(data) else None
    if image is None:
        raise TextureError(f"photograph {path}: is no image; give the path of a JPEG or PNG file")
    return np.asarray(image, np.uint8)
