"""A detector of one's own: a box of each colour by its hue, flown by the paper's mission."""

from math import acos, degrees

import cv2
import framerunner
import numpy as np

HUES = {"red": 0, "green": 60, "blue": 120}  # of OpenCV, 0 to 179


def box(hsv: np.ndarray, hue: int) -> framerunner.Detection:
    """The box of a hue; distance and angle are those of a frame that is wholly in view."""
    off = np.abs((hsv[..., 0].astype(int) - hue + 90) % 180 - 90)
    x, y, columns, rows = cv2.boundingRect(np.uint8((off < 12) & (hsv[..., 1] > 120) & (hsv[..., 2] > 60)))
    width, height, north, west = columns - 1, rows - 1, hsv.shape[0] / 2 - y, x - hsv.shape[1] / 2
    if height < 1 or x == 0 or y == 0 or x + columns == hsv.shape[1] or y + rows == hsv.shape[0]:
        return framerunner.Detection()
    angle = degrees(acos(min(1.0, width / height * 0.23 / 0.43)))
    return framerunner.Detection(north, north - height, west + width, west, 160 * 0.23 / height, angle)


def detector_by_hue(calibration: framerunner.Calibration) -> framerunner.Detector:
    """Make the detector of a flight; this one needs nothing of the camera."""
    return lambda image, time_us: framerunner.Detections(
        **{colour: box(cv2.cvtColor(image, cv2.COLOR_BGR2HSV), hue) for colour, hue in HUES.items()}
    )


print(framerunner.fly("test-case-1", "frame_challenge", detector=detector_by_hue).reason)
