import pytest

from framerunner.wire.link import Schedule


def counted(schedule, seconds, step_us=4000):
    counts = {}
    for time_us in range(0, round(seconds * 1e6), step_us):
        for message_id in schedule.due(time_us):
            counts[message_id] = counts.get(message_id, 0) + 1
    return counts


@pytest.mark.parametrize("rate_hz", [100, 50, 30, 8, 4, 1, 0.5, 0.1])
def test_rates_hold_on_average_though_ticks_do_not_divide_them(rate_hz):
    assert counted(Schedule({1: rate_hz}), 20)[1] == pytest.approx(20 * rate_hz, abs=1)


def test_all_is_due_at_once_at_first_and_then_not():
    schedule = Schedule({1: 100, 2: 1})
    assert schedule.due(500) == [1, 2]
    assert schedule.due(4500) == []
    assert schedule.next_due_us == 10_000


def test_what_was_missed_is_skipped():
    schedule = Schedule({1: 100})
    schedule.due(0)
    assert schedule.due(5_000_000) == [1]
    assert schedule.due(5_004_000) == []


def test_intervals_change_turn_off_and_return_to_default():
    schedule = Schedule({1: 10})
    schedule.set_interval(1, 20_000, 0)
    schedule.set_interval(2, 500_000, 0)
    assert counted(schedule, 1) == {1: 50, 2: 2}
    schedule.set_interval(1, -1, 0)
    schedule.set_interval(2, 0, 0)  # off is the default of what the profile does not have
    assert schedule.interval_us(1) == schedule.interval_us(2) == -1
    schedule.set_interval(1, 0, 0)
    assert schedule.interval_us(1) == 100_000


@pytest.mark.parametrize("requested_us", [0, 4_000, 12_000, 16_000, 123_456_000])
def test_a_requested_stream_is_on_the_same_grid_whenever_it_was_requested(requested_us):
    schedule = Schedule({})
    schedule.set_interval(7, 20_000, requested_us)
    sent = [t for t in range(requested_us, requested_us + 400_000, 4_000) if schedule.due(t)]
    assert {t % 20_000 for t in sent} == {16_000}
    assert 19 <= len(sent) <= 20
