"""The detectors by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from vision.detector import detect
from vision.frame_finder import PAINTED_SPREAD_PX, FrameFinder
from vision.types import Detections, Image, Vision

Detector = Callable[[Image, int | None], Detections]


def new_detector(kind: Vision, *, focal_px: float | None = None, rendered: bool = False) -> Detector:
    """Make a detector.

    Args:
        kind: "boxes": the paper's, one bounding box per colour; "frames": by shape, with poses.
        focal_px: focal length of the camera; "boxes" takes the paper's if it is None.
        rendered: the images are the simulator's, not a real camera's.

    Returns:
        A function of an image and its vehicle time.

    Raises:
        ValueError: "frames" without a focal length.
    """
    if kind == "boxes":
        return partial(detect, focal_px=focal_px)
    if focal_px is None:
        raise ValueError("focal_px: the detector of frames needs the camera's focal length")
    return FrameFinder(focal_px, PAINTED_SPREAD_PX if rendered else 0.0).find
