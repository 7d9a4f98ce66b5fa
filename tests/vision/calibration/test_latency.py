"""The delay of a camera from images of a blinking light."""

import numpy as np
import pytest

from vision.calibration.latency import LatencyError, blink_intervals, measure_latency


def filmed(
    delay_s: float, exposure_s: float, rate_hz: float, *, lit_cells: int = 20, jitter_s: float = 0.0
) -> tuple[list[tuple[float, bool]], list[float], list[np.ndarray]]:
    """What a camera sees of a light, computed in steps of 0.1 ms."""
    random = np.random.default_rng(7)
    edges = 100.0 + np.cumsum([0.0, *blink_intervals(15.0, 3)])
    switches = [(float(edge), number % 2 == 1) for number, edge in enumerate(edges)]
    middles = np.arange(100.7, 114.5, 1.0 / rate_hz) + random.uniform(0.0, 1.0 / rate_hz)
    fine = np.arange(-0.5, 0.5, 0.0001 / max(exposure_s, 0.0001)) * exposure_s
    at = middles[:, None] + fine[None, :]
    level = (np.searchsorted(edges, at, side="right") % 2 == 0).mean(axis=1)
    cells = random.normal(60.0, 2.0, (len(middles), 192))
    cells[:, 50 : 50 + lit_cells] += 90.0 * level[:, None]
    received = middles + delay_s + random.uniform(0.0, jitter_s, len(middles))
    return switches, received.tolist(), list(cells)


@pytest.mark.parametrize(
    ("delay_s", "exposure_s", "rate_hz"), [(0.1, 0.01, 30.0), (0.034, 0.002, 60.0), (0.25, 0.03, 10.0)]
)
def test_finds_the_delay_to_the_middle_of_the_exposure(
    delay_s: float, exposure_s: float, rate_hz: float
) -> None:
    found = measure_latency(*filmed(delay_s, exposure_s, rate_hz))
    assert found.delay_s == pytest.approx(delay_s, abs=0.002)
    assert found.rate_hz == pytest.approx(rate_hz, rel=0.01)
    assert found.std_s < 0.003


def test_jitter_of_the_arrival_counts_by_its_mean() -> None:
    found = measure_latency(*filmed(0.12, 0.01, 25.0, jitter_s=0.02))
    assert found.delay_s == pytest.approx(0.13, abs=0.003)


def test_a_light_that_is_not_in_the_image_is_said() -> None:
    with pytest.raises(LatencyError, match="not seen"):
        measure_latency(*filmed(0.1, 0.01, 30.0, lit_cells=0))


def test_too_few_images_are_said() -> None:
    switches, received, cells = filmed(0.1, 0.01, 30.0)
    with pytest.raises(LatencyError, match="39 images"):
        measure_latency(switches, received[:39], cells[:39])
