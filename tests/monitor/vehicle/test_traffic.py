"""Losses, rates and age of a link."""

import pytest

from monitor.vehicle.traffic import Traffic


def heard(sequences, rate_hz=50.0):
    traffic = Traffic(0.0)
    for count, sequence in enumerate(sequences):
        traffic.hear(sequence % 256, count / rate_hz)
    return traffic


def test_nothing_is_lost_when_numbers_follow_each_other():
    assert heard(range(600)).as_dict(12.0)["loss_percent"] == 0.0


def test_missing_numbers_are_losses_over_the_last_ten_seconds():
    told = heard([number for number in range(500) if number % 5]).as_dict(8.0)
    assert told["loss_percent"] == pytest.approx(20.0, abs=0.3)
    assert told["rate_hz"] == pytest.approx(50.0, abs=1.0)


def test_a_packet_that_was_overtaken_is_no_loss():
    order = [number for pair in range(0, 200, 2) for number in (pair + 1, pair)]
    assert heard(order).as_dict(4.0)["loss_percent"] <= 1.0


def test_old_losses_are_forgotten():
    traffic = heard([0, 100])
    for count in range(600):
        traffic.hear((101 + count) % 256, 1.0 + count / 50)
    assert traffic.as_dict(13.0)["loss_percent"] == 0.0


@pytest.mark.parametrize(("age_s", "state"), [(0.5, "live"), (1.5, "stale"), (2.9, "stale"), (3.1, "lost")])
def test_age_makes_the_state(age_s, state):
    told = heard([0]).as_dict(age_s)
    assert (told["state"], told["age_s"]) == (state, round(age_s, 1))


def test_a_long_silence_leaves_no_rate():
    told = heard(range(10)).as_dict(60.0)
    assert (told["rate_hz"], told["loss_percent"]) == (0.0, 0.0)
