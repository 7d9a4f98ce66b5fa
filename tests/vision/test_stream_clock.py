"""The capture of images from a stream's time stamps."""

from random import Random

import pytest

from vision.stream_clock import StreamClock


def errors_s(stamps_s: list[float], arrivals_s: list[float], delay_s: float) -> list[float]:
    clock = StreamClock()
    pairs = zip(stamps_s, arrivals_s, strict=True)
    found = [clock.captured_s(stamp_s, arrived_s) for stamp_s, arrived_s in pairs]
    assert all(at_s <= arrived_s for at_s, arrived_s in zip(found, arrivals_s, strict=True))
    return [at_s - stamp_s - 5000.0 - delay_s for at_s, stamp_s in zip(found, stamps_s, strict=True)]


def test_jitter_is_removed_once_an_image_came_in_time() -> None:
    random = Random(1)
    stamps = [0.033 * number for number in range(300)]
    arrivals = [5000.0 + 0.05 + stamp_s + random.choice([0.0, 0.0, 0.01, 0.08]) for stamp_s in stamps]
    assert max(map(abs, errors_s(stamps, arrivals, 0.05)[20:])) < 0.001


def test_a_drifting_clock_is_followed() -> None:
    stamps = [0.1 * number for number in range(6000)]  # ten minutes
    arrivals = [5000.0 + 0.05 + stamp_s * (1.0 + 50e-6) for stamp_s in stamps]
    found = errors_s(stamps, arrivals, 0.05)
    assert max(abs(error - 50e-6 * stamp_s) for error, stamp_s in zip(found, stamps, strict=True)) < 0.002


def test_a_stream_that_starts_anew_has_a_new_zero() -> None:
    clock = StreamClock()
    for number in range(50):
        clock.captured_s(0.1 * number + 0.1, 5000.0 + 0.1 * number)
    assert clock.captured_s(0.1, 5010.0) == 5010.0
    assert clock.captured_s(0.2, 5010.13) == pytest.approx(5010.1, abs=1e-4)


def test_images_that_a_network_held_back_keep_their_times() -> None:
    stamps = [0.033 * number for number in range(300)]
    held = [9.0 if 6.0 < stamp_s < 8.9 else stamp_s for stamp_s in stamps]  # a stall of 3 s, then all at once
    arrivals = [5000.05 + at_s + 1e-4 * number for number, at_s in enumerate(held)]
    assert max(map(abs, errors_s(stamps, arrivals, 0.05)[20:])) < 0.04


def test_one_image_with_a_wrong_stamp_moves_no_other() -> None:
    stamps = [0.033 * number for number in range(300)]
    clock = StreamClock()
    found = []
    for number, stamp_s in enumerate(stamps):
        late_s = 0.02 if number == 50 else 0.0
        found.append(clock.captured_s(stamp_s + late_s, 5000.05 + stamp_s) - 5000.05 - stamp_s)
    assert max(map(abs, found)) < 1e-6


def test_without_stamps_it_is_the_arrival() -> None:
    clock = StreamClock()
    assert [clock.captured_s(0.0, at_s) for at_s in (5.0, 5.1, 5.3)] == [5.0, 5.1, 5.3]
