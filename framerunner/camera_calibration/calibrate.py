"""From images of the board, of files, folders, videos or a camera, to a calibration file, with a report."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path

import cv2
import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from framerunner.camera_calibration.calibration_file import load_calibration, save_calibration
from framerunner.errors import SettingError, write_advice
from vision.calibration.board import (
    MIN_COVERAGE,
    SAME_VIEW,
    BoardView,
    CalibrationReport,
    CharucoBoard,
    coverage_of,
)
from vision.calibration.model import CalibrationError
from vision.sources import IMAGE_SUFFIXES, FolderSource, open_source
from vision.types import CameraError, Image

MAX_VIEWS = 60


@dataclass(slots=True)
class Collection:
    """Views that differ, and what was left out."""

    views: list[BoardView] = field(default_factory=list)
    images: int = 0
    without_board: int = 0
    similar: int = 0

    def add(self, board: CharucoBoard, image: Image, name: str) -> bool:
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
    board: CharucoBoard, sources: Sequence[str], wanted: int, say: Callable[[str], None]
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
    source: str, collection: Collection, board: CharucoBoard, wanted: int, say: Callable[[str], None]
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


_SHADES = " ░▒▓█"
_WELL_COVERED = 12  # corners in a cell
_FOREIGN = (".yaml", ".yml", ".xml", ".json")  # a calibration of ROS or OpenCV


def write_board(board: CharucoBoard, path: Path) -> None:
    """Write the board as a PNG file.

    Raises:
        SettingError: it cannot be written.
    """
    try:
        path.write_bytes(board.page())
    except OSError as error:
        raise SettingError(
            f"--out {path}: cannot be written to ({error.strerror}); {write_advice(error)}"
        ) from error
    print(f"{board.text}; print {path} at 100 %, measure it, and glue it to something flat")


def calibrate(
    board: CharucoBoard, sources: Sequence[str], wanted: int, out: Path, say: Callable[[str], None]
) -> None:
    """Calibrate a camera, print how good it is, and write the file.

    Raises:
        CalibrationError: the images do not tell enough, or the file is no calibration to write to.
        CameraError: a source cannot be opened or has failed.
        SettingError: the file cannot be written.
    """
    if out.exists():
        load_calibration(out, to_write=True)
    if len(sources) == 1 and sources[0].lower().endswith(_FOREIGN):
        save_calibration(load_calibration(Path(sources[0])), out)
        print(f"written to {out}; use it with `framerunner fly --calibration {out}`")
        return
    collection = asyncio.run(collect(board, sources, wanted, say))
    say(
        f"{collection.images} images: {len(collection.views)} different views; {collection.similar} like "
        f"another one, {collection.without_board} without the board or with too little of it"
    )
    report = board.calibrate(collection.views)
    _show(report, collection)
    save_calibration(report.calibration.model_copy(update={"made_on": date.today().isoformat()}), out)
    print(f"written to {out}; use it with `framerunner fly --calibration {out}`")


def _show(report: CalibrationReport, collection: Collection) -> None:
    console = Console(highlight=False)
    found = report.calibration
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("view", no_wrap=True)
    table.add_column("corners", justify="right")
    table.add_column("error (px)", justify="right")
    for view, (name, error_px) in zip(collection.views, report.errors_px, strict=True):
        table.add_row(name, str(len(view.ids)), f"{error_px:.2f}")
    console.print(table)
    k1, k2, p1, p2, k3 = found.distortion
    lines = (
        f"focal length {found.fx_px:.2f} and {found.fy_px:.2f} px (± {report.focal_std_px:.2f}), "
        f"optical axis at {found.cx_px:.2f}, {found.cy_px:.2f}",
        f"distortion k1 {k1:.4f}, k2 {k2:.4f}, p1 {p1:.5f}, p2 {p2:.5f}, k3 {k3:.4f}",
        f"error {found.rms_px:.3f} px RMS; {100 * report.coverage:.0f} % of the image covered:",
    )
    for line in lines:
        console.print(line, markup=False)
    for row in report.cells.tolist():
        shades = (_SHADES[min(4, -(-4 * count // _WELL_COVERED))] for count in row)
        console.print("  " + "".join(2 * shade for shade in shades), markup=False)
