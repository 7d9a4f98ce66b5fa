"""The time from an image's exposure to its arrival, measured with a light that blinks in a known pattern.

The light is switched at random intervals. Of each image only the brightness is used: in small cells, as the
light may fill any part of it. The delay sought is the one with which the cells' brightness follows the light
best, in the sense of least squares; the exposure, over which the brightness is a mean, is sought with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.errors import UserError
from vision.types import Image

Series = npt.NDArray[np.float64]

MAX_DELAY_S = 0.6
_CELLS = (16, 12)
_STEP_S = 0.001
_EXPOSURES_S = (0.0, 0.004, 0.008, 0.016, 0.033, 0.05)
_PARTS = 4
_MIN_CORRELATION = 0.8
_MIN_IMAGES = 40
_MIN_CONTRAST = 4.0  # of 255
_MAX_CELLS = 24
_MIN_INTERVAL_S, _MAX_INTERVAL_S = 0.12, 0.45


class LatencyError(UserError):
    """The images do not tell the delay; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class Latency:
    """A measured delay.

    Attributes:
        delay_s: from the middle of the exposure to the arrival.
        std_s: standard error of it, from the parts of the measurement.
        correlation: of the brightness with the light, 0 to 1.
        images: so many were used.
        rate_hz: at which they arrived.
    """

    delay_s: float
    std_s: float
    correlation: float
    images: int
    rate_hz: float


def blink_intervals(duration_s: float, seed: int = 0) -> list[float]:
    """Intervals between switches of the light, so random that the pattern is like itself at no other delay.

    Args:
        duration_s: sum of them, at least.
        seed: of the random numbers.
    """
    random, intervals, total_s = Random(seed), list[float](), 0.0
    while total_s < duration_s:
        intervals.append(random.uniform(_MIN_INTERVAL_S, _MAX_INTERVAL_S))
        total_s += intervals[-1]
    return intervals


def cells_of(image: Image) -> Series:
    """Mean brightness of the image's cells, row by row, 0 to 255."""
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return np.asarray(cv2.resize(grey, _CELLS, interpolation=cv2.INTER_AREA), np.float64).reshape(-1)


def measure_latency(
    switches: Sequence[tuple[float, bool]], received_s: Sequence[float], cells: Sequence[Series]
) -> Latency:
    """Find the delay.

    Args:
        switches: when the light was switched, and whether it is lit since; monotonic seconds.
        received_s: when each image arrived, on the same clock.
        cells: `cells_of` each image.

    Raises:
        LatencyError: there are too few images, or the light is not seen in them.
    """
    times = np.asarray(received_s, np.float64)
    if len(times) < _MIN_IMAGES:
        raise LatencyError(f"{len(times)} images: too few; film for longer, {_MIN_IMAGES} are needed")
    brightness = np.asarray(cells)
    light = _Light(switches)
    used = _cells_that_blink(light, times, brightness)
    mean = brightness[:, used].mean(axis=1)
    delay_s, exposure_s = _best(light, times, mean, _EXPOSURES_S)
    if delay_s > MAX_DELAY_S - 2.0 * _STEP_S:
        raise LatencyError(f"the delay is more than {MAX_DELAY_S:g} s; the camera is too slow to fly by")
    parts = np.array_split(np.arange(len(times)), _PARTS)
    found = [_best(light, times[part], mean[part], (exposure_s,))[0] for part in parts]
    return Latency(
        delay_s,
        max(float(np.std(found, ddof=1)) / _PARTS**0.5, 0.5 * _STEP_S),
        float(_correlation(light.level(times - delay_s, exposure_s), mean[:, None])[0]),
        len(times),
        (len(times) - 1) / float(times[-1] - times[0]),
    )


class _Light:
    """The light's level, 0 or 1, as a function of time."""

    def __init__(self, switches: Sequence[tuple[float, bool]]) -> None:
        self._times = np.array([time_s for time_s, _ in switches])
        levels = np.array([float(lit) for _, lit in switches])
        # Its integral from the first switch on, from which every mean follows.
        self._integral = np.concatenate([[0.0], np.cumsum(levels[:-1] * np.diff(self._times))])
        self._levels = levels

    def _integral_at(self, times: Series) -> Series:
        at = np.clip(np.searchsorted(self._times, times, side="right") - 1, 0, None)
        return np.asarray(self._integral[at] + self._levels[at] * (times - self._times[at]))

    def level(self, times: Series, exposure_s: float) -> Series:
        """Mean over exposures with these middles."""
        half_s = 0.5 * max(exposure_s, _STEP_S)
        return (self._integral_at(times + half_s) - self._integral_at(times - half_s)) / (2.0 * half_s)


def _correlation(level: Series, brightness: Series) -> Series:
    """Of each column with the level."""
    level = level - level.mean()
    columns = brightness - brightness.mean(axis=0)
    size = np.linalg.norm(level) * np.linalg.norm(columns, axis=0)
    return np.asarray(level @ columns / np.where(size > 0.0, size, np.inf))


def _cells_that_blink(light: _Light, times: Series, brightness: Series) -> npt.NDArray[np.intp]:
    """The cells that follow the light best with any delay; they may be darker when it is lit."""
    best = np.zeros(brightness.shape[1])
    for delay_s in np.arange(0.0, MAX_DELAY_S, 0.01):
        best = np.maximum(best, _correlation(light.level(times - delay_s, 0.016), brightness))
    best[np.ptp(brightness, axis=0) < _MIN_CONTRAST] = 0.0
    used = np.argsort(-best)[:_MAX_CELLS]
    used = used[best[used] >= _MIN_CORRELATION]
    if not len(used):
        raise LatencyError(
            "the blinking light is not seen in the images; let it fill a third of the image, in a dim room, "
            "with exposure and gain of the camera fixed"
        )
    return used


def _best(light: _Light, times: Series, mean: Series, exposures_s: Sequence[float]) -> tuple[float, float]:
    """Delay and exposure with the highest correlation; the middle where several delays are as good."""
    delays = np.arange(0.0, MAX_DELAY_S, _STEP_S)
    found: tuple[float, float, float] = (-1.0, 0.0, 0.0)
    for exposure_s in exposures_s:
        scores = np.array(
            [_correlation(light.level(times - delay_s, exposure_s), mean[:, None])[0] for delay_s in delays]
        )
        top = float(scores.max())
        if top > found[0]:
            found = (top, float(delays[scores >= top - 1e-9].mean()), exposure_s)
    return found[1], found[2]
