"""Learns the colours of real gates from images of their paint, and keeps them in the calibration file."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from pathlib import Path

from framerunner.camera_calibration.calibrate import image_in
from framerunner.camera_calibration.calibration_file import load_calibration, save_calibration
from framerunner.errors import SettingError
from vision.calibration.colours import learn_colours, share_seen, swatch_of
from vision.calibration.model import CalibrationError
from vision.colour_regions import PRIMARIES
from vision.sources import open_source
from vision.types import Image

_IMAGES = 20
"""Of a live camera, so that its exposure has settled."""


def learn(pairs: Sequence[str], calibration: Path, ask: Callable[[str], None]) -> None:
    """Learn the colours and write them into a calibration file.

    Args:
        pairs: `red=SOURCE` and so on: an image file, or a camera that is shown the swatch when asked for.
        calibration: the file, as `framerunner camera calibrate` writes it.
        ask: called before a camera is used, with what to show; returns when it is shown.

    Raises:
        CalibrationError: the file or an image cannot be read, or the swatches do not do.
        CameraError: a camera cannot be opened or has failed.
        SettingError: the pairs are not such, or the file cannot be written.
    """
    sources = dict(_pair(each) for each in pairs)
    known = load_calibration(calibration, to_write=True)
    swatches = {colour: swatch_of(_image(colour, source, ask)) for colour, source in sources.items()}
    matrix = learn_colours(swatches)
    for colour in PRIMARIES:
        before = share_seen(swatches[colour], colour)
        print(f"{colour}: {before:.0%} of the swatch was seen as {colour} before")
    save_calibration(known.model_copy(update={"colour_matrix": matrix}), calibration)
    print(f"written to {calibration}; use it with `framerunner fly --calibration {calibration}`")


def _pair(text: str) -> tuple[str, str]:
    colour, found, source = text.partition("=")
    if not found or colour not in PRIMARIES or not source:
        raise SettingError(
            f"'{text:.80}': write COLOUR=SOURCE, such as red=red.jpg; colours: {', '.join(PRIMARIES)}"
        )
    return colour, source


def _image(colour: str, source: str, ask: Callable[[str], None]) -> Image:
    image = image_in(source)
    if image is None:
        ask(f"fill the middle of the image with {colour}")
        image = asyncio.run(_settled(source))
    return image


async def _settled(source: str) -> Image:
    number = 0
    async with open_source(source) as camera:
        async for frame in camera.frames():
            number += 1
            if number == _IMAGES:
                return frame.image
    raise CalibrationError(f"{source}: ended after {number} images, {_IMAGES} are needed")
