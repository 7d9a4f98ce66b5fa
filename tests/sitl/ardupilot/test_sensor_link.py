"""Optical flow as ArduPilot takes it."""

import pytest

from framerunner.vehicle.measurements import FlowSample
from sitl.ardupilot.sensor_link import FLOW_PERIOD_US, FLOW_SCALE, FlowMean


def test_flow_is_sent_ten_times_a_second_and_nothing_is_lost_by_rounding():
    mean = FlowMean()
    samples = [FlowSample(20_000 * n, 20_000, (0.0011, -0.0023), (0.0, 0.0), 200) for n in range(1, 501)]
    sent = [message for sample in samples if (message := mean.add(sample)) is not None]
    assert len(sent) == 100
    period_s = FLOW_PERIOD_US * 1e-6
    unit_rad = FLOW_SCALE * period_s**2
    turned_rad = (unit_rad * sum(m.flow_x for m in sent), unit_rad * sum(m.flow_y for m in sent))
    assert turned_rad == pytest.approx((500 * 0.0011, -500 * 0.0023), abs=unit_rad)


def test_a_mean_is_as_good_as_its_worst_sample():
    mean = FlowMean()
    qualities = [200, 200, 0, 200, 200] + [200] * 5
    sent = [mean.add(FlowSample(0, 20_000, (0.0, 0.0), (0.0, 0.0), quality)) for quality in qualities]
    assert [message.quality for message in sent if message] == [0, 200]
