"""How late images without time stamps are, and who says so."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the commands import this module
    from vision.calibration.model import Calibration

CAMERA_DELAY_S = 0.1
"""Usual delay of a camera, from exposure to arrival."""


@dataclass(frozen=True, slots=True)
class CameraDelay:
    """Age on arrival of an image without a time stamp.

    Attributes:
        age_s: from the exposure to the arrival.
        measured_by: what says so, for people; empty: it was never measured, and the usual one is assumed.
    """

    age_s: float = CAMERA_DELAY_S
    measured_by: str = ""


UNMEASURED = CameraDelay()


def delay_of(given_s: float | None, calibration: Calibration | None) -> CameraDelay:
    """The delay as given by the user, else the calibration's, else the usual one."""
    if given_s is not None:
        return CameraDelay(given_s, "--camera-delay")
    if calibration is not None and calibration.delay_s is not None:
        return CameraDelay(calibration.delay_s, "the calibration")
    return UNMEASURED
