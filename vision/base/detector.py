"""A detector that looks for the base, too, where it is expected."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

from vision.detectors import Detector
from vision.types import BaseExpectation, BaseSighting, Detections, Image

BaseExpectations = Callable[[int], BaseExpectation | None]
"""From the vehicle time of an image (microseconds) to what is expected in it; None: nothing is."""


class FindsBase(Protocol):
    """What looks for the base: by its edges (`BaseFinder`), or by markers on it (`MarkerReader`)."""

    def find(self, image: Image, expected: BaseExpectation) -> BaseSighting | None:
        """The base in an image, BGR; None if it is not seen, or not surely the base."""


class DetectorWithBase:
    """Adds the base to what another detector gives, in images that have a time.

    Args:
        detect: the other detector.
        finder: of the base.

    Attributes:
        expected: what is expected in an image; at first nothing.
    """

    def __init__(self, detect: Detector, finder: FindsBase) -> None:
        self.expected: BaseExpectations = lambda _time_us: None
        self._detect, self._finder = detect, finder

    def __call__(self, image: Image, time_us: int | None) -> Detections:
        """What an image shows."""
        detections = self._detect(image, time_us)
        expected = None if time_us is None else self.expected(time_us)
        base = None if expected is None else self._finder.find(image, expected)
        return detections if base is None else replace(detections, base=base)


def expect_base(detector: Detector, expected: BaseExpectations) -> None:
    """Tell a detector where the base is expected, if it is one that can look for it."""
    if isinstance(detector, DetectorWithBase):
        detector.expected = expected
