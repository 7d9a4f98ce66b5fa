"""Ticks of a vehicle whose time waits for the app, and of one whose time does not."""

import asyncio
from types import SimpleNamespace

import pytest
from mavsdk.asyncio import MavsdkError

from offboard.drone import VelocityFluCommand
from offboard.link import ticks
from offboard.link.telemetry import MAX_JITTER_S, TelemetryFeed
from offboard.link.ticks import PendingRequests, TickSource, request_rates

COMMAND = VelocityFluCommand(forward_m_s=0.5)


class Clock:
    """A vehicle whose telemetry arrives at once, but for some ticks.

    Args:
        feed: is told of each tick.
        lost: numbers of ticks whose telemetry is lost.
    """

    def __init__(self, feed, lost=()):
        self.feed = feed
        self.lost = lost
        self.granted = []
        self.released = False

    async def stop(self):
        return 1_020_000

    async def advance(self, tick_us, command, *, at_once=False):
        self.granted.append((tick_us, command))
        if tick_us // 50_000 not in self.lost:
            attitude(self.feed, tick_us)

    def release(self):
        self.released = True


def attitude(feed, time_us):
    feed._on_attitude(SimpleNamespace(roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0, timestamp_us=time_us), None)


@pytest.fixture
async def feed():
    feed = TelemetryFeed()
    feed._loop = asyncio.get_running_loop()
    return feed


async def test_time_that_waits_gives_every_tick_however_late_it_is_asked_for(feed):
    clock, source = Clock(feed), TickSource(feed)
    source.use_clock(clock)
    attitude(feed, 1_000_000)  # of a tick that nobody waits for
    await source.begin()
    assert feed.take_samples()[1] == []
    for number in (21, 22, 23):
        await asyncio.sleep(0.06)
        assert await source.next(1.0, COMMAND)
        assert feed.sample.time_us == number * 50_000
    assert clock.granted == [(1_050_000, COMMAND), (1_100_000, COMMAND), (1_150_000, COMMAND)]
    assert (source.in_flight, source.late) == (3, 0)
    source.release()
    assert clock.released


async def test_a_tick_lost_on_the_link_is_counted_and_the_next_one_is_given(feed, monkeypatch):
    monkeypatch.setattr(ticks, "TICK_LOST_S", 0.02)
    source = TickSource(feed)
    source.use_clock(Clock(feed, lost=(22, 23)))
    await source.begin()
    assert await source.next(1.0) and await source.next(1.0)
    assert feed.sample.time_us == 24 * 50_000
    assert source.late == 2


async def test_telemetry_that_never_comes_ends_the_waiting(feed, monkeypatch):
    monkeypatch.setattr(ticks, "TICK_LOST_S", 0.001)
    source = TickSource(feed)
    source.use_clock(Clock(feed, lost=range(100)))
    await source.begin()
    began_us = source.time_us
    assert not await source.next(1.0)
    assert source.time_us == began_us + 10 * 50_000  # so that limits in vehicle time are reached


async def test_time_that_does_not_wait_passes_ticks_over_and_counts_them_in_flight(feed):
    source = TickSource(feed)
    await source.begin()
    assert not source.waits
    late = []
    for times_us, command in (
        ((1_050_000,), None),
        ((1_100_000, 1_150_000), None),
        ((1_200_000, 1_250_000), COMMAND),
        ((1_300_000,), COMMAND),
        ((1_350_000, 1_400_000, 1_450_000), COMMAND),
    ):
        for time_us in times_us:
            attitude(feed, time_us)
        assert await source.next(1.0, command)
        assert feed.sample.time_us == times_us[-1]
        late.append(source.late)
    assert late == [0, 0, 0, 0, 2]
    assert source.in_flight == 5
    assert not await source.next(0.01, COMMAND)


async def test_a_tick_that_comes_while_the_one_before_is_taken_is_given_once(feed):
    waiting = asyncio.create_task(feed.next_tick(1.0))
    await asyncio.sleep(0)
    attitude(feed, 1_050_000)
    asyncio.get_running_loop().call_soon(attitude, feed, 1_100_000)  # the task is woken, but has not run yet
    assert await waiting
    assert feed.take_samples()[0].time_us == 1_100_000
    assert not await feed.next_tick(0.01)
    attitude(feed, 1_150_000)
    assert await feed.next_tick(1.0)
    attitude(feed, 1_200_000)
    assert feed.take_samples()[0].time_us == 1_200_000
    assert not await feed.next_tick(0.01)


async def test_a_cancellation_together_with_a_tick_is_not_lost():
    """Otherwise a wait under a time limit never ends when its end and a tick coincide."""
    for turns in range(5):
        feed = TelemetryFeed()
        feed._loop = asyncio.get_running_loop()
        waiting = asyncio.create_task(feed.next_tick(5.0))
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        attitude(feed, 50_000)
        for _ in range(turns):
            await asyncio.sleep(0)
        cancelled = waiting.cancel()
        await asyncio.wait({waiting})
        assert waiting.cancelled() == cancelled


def test_vehicle_time_at_a_wall_time_is_that_of_the_quickest_message_within_limits():
    now_s = 100.0
    feed = TelemetryFeed(lambda: now_s)
    assert feed.time_at_us(now_s) is None
    for number in range(100):  # every fifth message waits for 30 ms
        now_s = 100.0 + 0.02 * number + 0.004 + (0.03 if number % 5 == 4 else 0.0)
        attitude(feed, 5_000_000 + 20_000 * number)
    assert feed.time_at_us(102.004) == pytest.approx(7_000_000, abs=200)
    attitude_us = 5_000_000 + 20_000 * 100
    now_s = 103.0  # the vehicle's clock stood still, or is slower
    attitude(feed, attitude_us)
    assert feed.time_at_us(103.0) == attitude_us + round(MAX_JITTER_S * 1e6)


async def test_what_was_sent_is_exchanged_before_and_after_each_tick(feed):
    clock, source, order = Clock(feed), TickSource(feed), []

    async def note(what):
        order.append((what, len(clock.granted)))

    source.use_clock(clock)
    await source.begin()
    source.exchange = SimpleNamespace(before_tick=lambda: note("before"), after_tick=lambda: note("after"))
    assert await source.next(1.0)
    assert order == [("before", 0), ("after", 1)]


async def test_a_flight_begins_and_arms_at_multiples_of_a_period_whenever_the_app_is_ready(feed):
    clock, source = Clock(feed), TickSource(feed)

    async def nothing():
        pass

    source.use_clock(clock)
    exchange = SimpleNamespace(before_tick=nothing, after_tick=nothing)
    dialect = SimpleNamespace(exchange=exchange, request_streams=nothing)
    clock.answers_take_time = False
    await source.begin_exchange(dialect, PendingRequests())
    assert clock.granted[-1] == (10_000_000, None)
    assert await source.next(1.0)
    assert feed.sample.time_us == 10_050_000
    await source.before_arming(None, None)
    assert feed.sample.time_us == 15_000_000


async def test_a_vehicle_whose_time_stands_may_refuse_rates_too(feed):
    asked = []

    class Telemetry:
        async def set_rate_position_velocity_ned(self, rate_hz):
            asked.append(rate_hz)
            raise MavsdkError

        set_rate_landed_state = set_rate_position_velocity_ned

    await request_rates(feed, Telemetry(), stands=True)
    assert asked == [50.0, 50.0]
