"""Photographs behind the gates: parts of them at random places and scales."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from framerunner.errors import SettingError
from framerunner.geometry.rotations import RotationRows
from scenarios.models import Camera
from sitl.optics.backdrop import Backdrop
from sitl.optics.sensor import SCALE
from vision.types import Image

ENDINGS = (".bmp", ".jpeg", ".jpg", ".png", ".tif", ".tiff", ".webp")
_LEAST_SHARE = 0.35  # of the largest part that has an image's proportions
_AROUND = 1.3  # of an image's size, for attitudes that differ from the first one


@dataclass(frozen=True, slots=True, eq=False)
class Backgrounds:
    """The photographs of a folder; each is BGR, shape (height, width, 3)."""

    photographs: tuple[Image, ...]

    @classmethod
    def of_folder(cls, folder: Path) -> Backgrounds:
        """Read all images in a folder, by name.

        Raises:
            SettingError: there is no such folder, no image in it, or one that cannot be read.
        """
        if not folder.is_dir():
            raise SettingError(f"--backgrounds {folder}: is no folder; give one with photographs")
        photographs = []
        for path in sorted(folder.iterdir()):
            if path.suffix.lower() in ENDINGS:
                image = cv2.imread(str(path), cv2.IMREAD_COLOR)
                if image is None:
                    raise SettingError(f"--backgrounds: {path} is no image that can be read; remove it")
                photographs.append(np.asarray(image, np.uint8))
        if not photographs:
            raise SettingError(
                f"--backgrounds {folder}: has no photographs; their names end with {', '.join(ENDINGS)}"
            )
        return cls(tuple(photographs))

    def draw(self, camera: Camera, rotation: RotationRows, stream: np.random.Generator) -> Backdrop:
        """Draw a part of a photograph, behind what a camera sees.

        Args:
            camera: that sees it.
            rotation: rows of the matrix from the camera's forward, left, up to arena axes.
            stream: of random numbers.
        """
        photograph = self.photographs[int(stream.integers(len(self.photographs)))]
        height, width = photograph.shape[:2]
        scale = stream.uniform(_LEAST_SHARE, 1.0) * min(width / camera.width_px, height / camera.height_px)
        columns, rows = round(scale * camera.width_px), round(scale * camera.height_px)
        left, top = (int(stream.integers(spare + 1)) for spare in (width - columns, height - rows))
        part = photograph[top : top + rows, left : left + columns]
        if stream.random() < 0.5:
            part = part[:, ::-1]
        factor = _AROUND * SCALE
        size = (round(factor * camera.width_px), round(factor * camera.height_px))
        shrinks = columns > size[0]
        resized = cv2.resize(part, size, interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR)
        return Backdrop(np.asarray(resized, np.uint8), SCALE * camera.focal_px, rotation)
