"""The capture of images from a stream's time stamps."""

from random import Random

import pytest

from vision.streams.stream_clock import StreamClock

START_S, DELAY_S = 5000.0, 0.05


def errors_s(
    stamps_s: list[float], arrivals_s: list[float], captured_s: list[float] | None = None
) -> list[float]:
    """How much later than its capture each image of known time is taken to be, beside the stream's delay."""
    clock = StreamClock()
    found = [clock.captured_s(stamp_s, at_s) for stamp_s, at_s in zip(stamps_s, arrivals_s, strict=True)]
    true_s = [START_S + stamp_s for stamp_s in stamps_s] if captured_s is None else captured_s
    assert all(at_s is None or at_s <= arrived_s for at_s, arrived_s in zip(found, arrivals_s, strict=True))
    return [at_s - was_s - DELAY_S for at_s, was_s in zip(found, true_s, strict=True) if at_s is not None]


def test_jitter_is_removed_once_an_image_came_in_time() -> None:
    random = Random(1)
    stamps = [0.033 * number for number in range(300)]
    arrivals = [START_S + DELAY_S + stamp_s + random.choice([0.0, 0.0, 0.01, 0.08]) for stamp_s in stamps]
    found = errors_s(stamps, arrivals)
    assert len(found) > 280
    assert max(map(abs, found[20:])) < 0.001


def test_a_drifting_clock_is_followed() -> None:
    stamps = [0.1 * number for number in range(6000)]  # ten minutes
    arrivals = [START_S + DELAY_S + stamp_s * (1.0 + 50e-6) for stamp_s in stamps]
    found = errors_s(stamps, arrivals, [at_s - DELAY_S for at_s in arrivals])
    assert len(found) > 5990
    assert max(map(abs, found)) < 0.002


def test_a_stream_that_starts_anew_has_a_new_zero() -> None:
    clock = StreamClock()
    for number in range(50):
        clock.captured_s(0.1 * number + 0.1, 5000.0 + 0.1 * number)
    assert clock.captured_s(0.1, 5010.0) is None
    assert clock.captured_s(0.2, 5010.13) == pytest.approx(5010.1, abs=1e-4)


def test_images_that_a_network_held_back_keep_their_times() -> None:
    stamps = [0.033 * number for number in range(300)]
    held = [stamp_s if stamp_s < 6.0 else max(stamp_s, 9.0 + 2e-3 * (stamp_s - 6.0)) for stamp_s in stamps]
    found = errors_s(stamps, [START_S + DELAY_S + at_s for at_s in held])
    assert len(found) > 200  # all but those that were held back
    assert max(map(abs, found)) < 0.001


def test_images_after_a_pause_in_which_the_stamps_stood_still_are_not_too_old() -> None:
    stamps = [0.033 * number for number in range(300)]
    captured = [START_S + stamp_s + (2.5 if stamp_s > 4.0 else 0.0) for stamp_s in stamps]
    found = errors_s(stamps, [at_s + DELAY_S for at_s in captured], captured)
    assert len(found) > 270  # all but those of the first tenths of a second
    assert max(map(abs, found)) < 0.001


def test_old_images_that_a_server_sends_at_first_are_not_taken_for_new_ones() -> None:
    stamps = [0.033 * number for number in range(200)]
    arrivals = [
        START_S + DELAY_S + max(stamp_s, 1.5 + 2e-3 * number) for number, stamp_s in enumerate(stamps)
    ]
    found = errors_s(stamps, arrivals)
    assert len(found) > 140
    assert max(map(abs, found)) < 0.05


def test_a_stream_whose_stamps_always_run_fast_is_not_taken_for_a_queue() -> None:
    stamps = [0.04 * number for number in range(200)]
    found = errors_s(stamps, [START_S + DELAY_S + 0.5 * stamp_s for stamp_s in stamps])
    assert len(found) > 140


def test_one_image_with_a_wrong_stamp_moves_no_other() -> None:
    stamps = [0.033 * number for number in range(300)]
    late = [stamp_s + (0.02 if number == 50 else 0.0) for number, stamp_s in enumerate(stamps)]
    found = errors_s(
        late, [START_S + DELAY_S + stamp_s for stamp_s in stamps], [START_S + each for each in stamps]
    )
    assert max(map(abs, found)) < 1e-6


def test_without_stamps_it_is_the_arrival() -> None:
    clock = StreamClock()
    assert clock.captured_s(0.0, 5.0) is None  # its next one shows that it has none
    assert [clock.captured_s(0.0, at_s) for at_s in (5.2, 5.3, 9.0)] == [5.2, 5.3, 9.0]
