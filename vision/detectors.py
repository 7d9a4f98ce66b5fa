"""The detectors by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from vision.calibration.colours import correct_colours
from vision.calibration.lens import Lens
from vision.calibration.model import Calibration
from vision.detector import detect
from vision.frame_finder import PAINTED_SPREAD_PX, SMOOTH_SPREAD_PX, FrameFinder
from vision.types import Detections, Image, Vision

Detector = Callable[[Image, int | None], Detections]


def new_detector(
    kind: Vision,
    *,
    focal_px: float | None = None,
    rendered: bool = False,
    smooth: bool = False,
    calibration: Calibration | None = None,
) -> Detector:
    """Make a detector.

    Args:
        kind: "boxes": the paper's, one bounding box per colour; "frames": by shape, with poses.
        focal_px: focal length of the camera; "boxes" takes the paper's if it is None.
        rendered: the images are the simulator's, not a real camera's.
        smooth: the simulator's with camera effects, which paint half as far beyond a true outline.
        calibration: of the camera; its focal length is used, and "frames" gives pixels of an ideal camera.

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
            detector = new_detector(kind, rendered=rendered, smooth=smooth, calibration=plain)
            return lambda image, time_us: detector(correct_colours(image, matrix), time_us)
    if kind == "boxes":
        return partial(detect, focal_px=focal_px)
    if focal_px is None:
        raise ValueError("focal_px: the detector of frames needs the camera's focal length")
    spread_px = 0.0
    if rendered:
        spread_px = SMOOTH_SPREAD_PX if smooth else PAINTED_SPREAD_PX
    lens = None if calibration is None or calibration.is_ideal else Lens(calibration)
    return FrameFinder(focal_px, spread_px, lens).find
