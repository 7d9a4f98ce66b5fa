"""Views of the calibration board from files, folders, videos and cameras."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from vision.calibration.board import MIN_COVERAGE, SAME_VIEW, Board, View, coverage_of
from vision.calibration.model import CalibrationError
from vision.sources import IMAGE_SUFFIXES, FolderSource, open_source
from vision.types import CameraError, Image

MAX_VIEWS = 60


@dataclass(slots=True)
class Collection:
    """Views that differ, and what was left out."""

    views: list[View] = field(default_factory=list)
    images: int = 0
    without_board: int = 0
    similar: int = 0

    def add(self, board: Board, image: Image, name: str) -> bool:
        """Look at an image; whether it is a new view."""
        self.images += 1
        view = board.find(image, name)
        if view is None:
            self.without_board += 1
            return False
        if any(view.distance(other) < SAME_VIEW for other in self.views):
            self.similar += 1
            return False
        self.views.append(view)
        return True


async def collect(
    board: Board, sources: Sequence[str], wanted: int, say: Callable[[str], None]
) -> Collection:
    """Look for the board in images until there are as many different views as wanted, or no more images.

    Args:
        board: that is looked for.
        sources: image files, folders, videos, devices or URLs, one after another.
        wanted: number of views from a camera or video; of files and folders all are used.
        say: called with lines for people.

    Raises:
        CalibrationError: an image file cannot be read.
        CameraError: a camera cannot be opened or has failed before there was any view.
    """
    collection = Collection()
    for source in sources:
        try:
            await _collect_from(source, collection, board, wanted, say)
        except CameraError as error:
            if not collection.views:
                raise
            say(f"{error}; the {len(collection.views)} views so far are used")
    return collection


async def _collect_from(
    source: str, collection: Collection, board: Board, wanted: int, say: Callable[[str], None]
) -> None:
    image = image_in(source)
    if image is not None:
        collection.add(board, image, Path(source).name)
        return
    number, camera = 0, open_source(source)
    live = not isinstance(camera, FolderSource)  # a camera or a video: it has more images than are needed
    async with camera:
        async for frame in camera.frames():
            new = collection.add(board, frame.image, f"image {number}")
            number += 1
            views = len(collection.views)
            if new and live:
                seen = 100 * coverage_of(collection.views)
                say(f"view {views} of {wanted}, {seen:.0f} % of the image covered; move and tilt the board")
            enough = views >= wanted and coverage_of(collection.views) >= MIN_COVERAGE
            if (live and enough) or views >= MAX_VIEWS:
                break


def image_in(source: str) -> Image | None:
    """The image in a file; None: the source is no image file.

    Raises:
        CalibrationError: it cannot be read.
    """
    if not source.lower().endswith(IMAGE_SUFFIXES) or "://" in source:
        return None
    image = cv2.imread(source, cv2.IMREAD_COLOR)
    if image is None:
        raise CalibrationError(f"{source}: not an image that can be read; give PNG or JPEG files")
    return np.asarray(image, np.uint8)
