"""The detectors: ours by name, and those of others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, get_args

import numpy as np

from framerunner.errors import UserError
from framerunner.files.extensions import extension_names, find_extension
from framerunner.geometry.gate_shape import GateShapes
from vision.calibration.colours import correct_colours
from vision.calibration.lens import Lens
from vision.calibration.model import Calibration
from vision.detector import detect
from vision.gate_finder import GateFinder
from vision.gate_model import GateModel
from vision.gate_pose import as_seen, find_poses
from vision.types import Detections, GateCorner, GateSighting, Image, Vision

OWN_DETECTORS: tuple[Vision, ...] = get_args(Vision)
"""Names that no other package can use."""
Detector = Callable[[Image, int | None], Detections]
"""From an image (BGR, shape (height, width, 3), uint8) and its vehicle time (microseconds) to detections."""
DetectorMaker = Callable[[Calibration], Detector]
"""Makes a detector for the camera of one flight; what it keeps from image to image is in the detector."""


_MOST_STDS = 4.0  # root mean square, by which a pose may miss the corners of which it is made


class DetectorError(UserError):
    """A detector of others cannot be used; the message is one line for people."""


class SightingMaker:
    """Makes a `GateSighting` of four corners.

    Args:
        calibration: of the camera.
        shapes: of the gates of each colour; None: all have that of the frame challenge.
    """

    def __init__(self, calibration: Calibration, shapes: GateShapes | None = None) -> None:
        self._lens = Lens(calibration)
        self._shapes = shapes or GateShapes()

    def sighting(
        self,
        colour: str,
        corners: Sequence[tuple[float, float]],
        std_px: float = 0.5,
        *,
        whole: bool = True,
    ) -> GateSighting:
        """A gate in an image.

        Args:
            colour: of the gate.
            corners: of its outline, column and row, whole numbers at pixel centres: upper left, upper right,
                lower right, lower left as seen. They may be outside the image.
            std_px: standard deviation of each of these numbers, by which the map weighs the gate.
            whole: nothing of the gate is hidden or outside the image.

        Returns:
            It has no poses if no upright gate looks so.
        """
        columns, rows = self._lens.size_px
        places = np.array(corners, np.float64) - ((columns - 1) / 2, (rows - 1) / 2)
        ideal = [(right, down) for right, down in self._lens.ideal(places).tolist()]
        upper_left, upper_right, lower_right, lower_left = (
            GateCorner(right, down, std_px, std_px) for right, down in ideal
        )
        model = GateModel.of_corners(self._shapes.of(colour), self._lens.focal_px)
        poses = find_poses(ideal, model, _MOST_STDS * std_px)
        return GateSighting(
            colour,
            (upper_left, upper_right, lower_right, lower_left),
            whole,
            tuple(as_seen(pose) for pose in poses),
        )


def new_detector(
    kind: Vision,
    *,
    focal_px: float | None = None,
    calibration: Calibration | None = None,
    shapes: GateShapes | None = None,
) -> Detector:
    """Make a detector.

    Args:
        kind: "boxes": the paper's, one bounding box per colour; "frames": by shape, with poses.
        focal_px: focal length of the camera; "boxes" takes the paper's if it is None.
        calibration: of the camera; its focal length is used, and "frames" gives pixels of an ideal camera.
        shapes: of the gates of each colour; None: all have that of the frame challenge.

    Returns:
        A function of an image and its vehicle time. It raises `CalibrationError` if the image's shape is not
        the calibration's.

    Raises:
        ValueError: "frames" without a focal length.
    """
    if calibration is not None:
        focal_px = calibration.fx_px
        if (matrix := calibration.colour_matrix) is not None:
            plain = calibration.model_copy(update={"colour_matrix": None})
            detector = new_detector(kind, calibration=plain, shapes=shapes)
            return lambda image, time_us: detector(correct_colours(image, matrix), time_us)
    if kind == "boxes":
        return partial(detect, focal_px=focal_px, shapes=shapes or GateShapes())
    if focal_px is None:
        raise ValueError("focal_px: the detector of frames needs the camera's focal length")
    lens = None if calibration is None or calibration.is_ideal else Lens(calibration)
    return GateFinder(focal_px, lens, shapes).find


def others_detector(made_by: str | DetectorMaker, calibration: Calibration) -> Detector:
    """Make a detector of others for a camera.

    Args:
        made_by: name under which a package adds it, or a function that makes it.
        calibration: of the camera.

    Returns:
        A function of an image and its vehicle time, which the detections then have. It raises `DetectorError`
        if the detector fails, or gives no `Detections`.

    Raises:
        DetectorError: no package adds a detector of this name, or it cannot be made.
        ExtensionError: a package does, but it cannot be loaded.
    """
    name = detector_name(made_by)
    make: DetectorMaker = _added(made_by) if isinstance(made_by, str) else made_by
    try:
        find = make(calibration)
    except Exception as error:  # of others' code
        raise DetectorError(f"detector {name} cannot be made: {type(error).__name__}: {error}") from error

    def detect_checked(image: Image, time_us: int | None) -> Detections:
        if calibration.colour_matrix is not None:
            image = correct_colours(image, calibration.colour_matrix)
        try:
            found = find(image, time_us)
        except Exception as error:  # of others' code
            raise DetectorError(f"detector {name} failed: {type(error).__name__}: {error}") from error
        if not isinstance(found, Detections):
            raise DetectorError(f"detector {name} gave {type(found).__name__}; it must give Detections")
        return found if found.time_us == time_us else replace(found, time_us=time_us)

    return detect_checked


def detector_name(made_by: str | DetectorMaker) -> str:
    """The name of a detector of others, for people."""
    return made_by if isinstance(made_by, str) else getattr(made_by, "__name__", type(made_by).__name__)


def _added(name: str) -> Any:  # noqa: ANN401 - whoever calls it finds out
    """What a package adds as a detector."""
    added = None if name in OWN_DETECTORS else find_extension("detector", name)
    if added is None:
        known = ", ".join(extension_names("detector")) or "none"
        raise DetectorError(f"unknown detector {name!r}; installed packages add: {known}")
    return added.load()
