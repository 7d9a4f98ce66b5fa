"""When the camera takes images, and when they arrive."""

import numpy as np
import pytest

from scenarios.models import Camera, Gate, Scenario, TrueState
from sitl.camera import CameraFeed

TICK_US = 4_000


def scenario(**camera):
    return Scenario(
        name="feed",
        camera=Camera(width_px=32, height_px=24, **camera),
        frames=(Gate(colour="red", x_m=2, y_m=0, z_m=1),),
    )


def truth(time_us, x_m=0.0):
    return TrueState(time_us, (x_m, 0.0, 1.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), False)


def images(feed, until_us, begin_us=0):
    """The images that arrive up to a time: (tick, exposure, image)."""
    out = []
    for time_us in range(begin_us, until_us + 1, TICK_US):
        arrived = feed.step(truth(time_us))
        if arrived is not None:
            out.append((time_us, *arrived))
    return out


def grid(period_us, count):
    """The first ticks at or after each exposure."""
    return [-(-(36_000 + period_us * k) // TICK_US) * TICK_US for k in range(count)]


def test_exposures_are_a_tenth_of_a_second_apart_from_36_ms_on():
    arrived = images(CameraFeed(scenario()), 1_100_000)
    assert [exposed for _, exposed, _ in arrived] == grid(100_000, len(arrived))
    assert len(arrived) == 11


@pytest.mark.parametrize("latency_s", [0.0, 0.05, 0.25])
def test_each_image_arrives_a_latency_after_its_exposure(latency_s):
    arrived = images(CameraFeed(scenario(latency_s=latency_s)), 1_000_000)
    assert len(arrived) >= 7
    late_us = [tick - exposed - latency_s * 1e6 for tick, exposed, _ in arrived]
    assert all(0 <= late < TICK_US for late in late_us)


def test_an_uneven_rate_keeps_to_its_average_without_drift():
    arrived = images(CameraFeed(scenario(rate_hz=30.0, latency_s=0.0)), 10_000_000)
    assert len(arrived) == pytest.approx(300, abs=1)
    exposures = [exposed for _, exposed, _ in arrived]
    assert exposures[-1] - exposures[0] == pytest.approx((len(arrived) - 1) * 1e6 / 30, abs=TICK_US)


def test_a_clock_that_begins_late_gives_no_burst_of_old_images():
    arrived = images(CameraFeed(scenario(latency_s=0.0)), 60_250_000, begin_us=60_000_000)
    assert len(arrived) == 4  # one at once, then those of the grid
    assert all(exposed >= 60_000_000 for _, exposed, _ in arrived)


def test_an_image_shows_the_place_of_its_exposure_not_of_its_arrival():
    feed, wanted = CameraFeed(scenario()), CameraFeed(scenario(latency_s=0.0))
    (expected,) = images(wanted, 36_000)
    arrived = None
    for time_us in range(0, 120_000, TICK_US):
        arrived = arrived or feed.step(truth(time_us, x_m=0.0 if time_us <= 36_000 else 1.2))
    assert arrived[0] == 36_000
    assert np.array_equal(arrived[1], expected[2])
