from dataclasses import replace
from math import inf, nan

import pytest

from firmware_py.estimation.ideal_estimator import IdealEstimator
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import Sensors

ORIGIN = GeodeticPoint(47.397742, 8.545594, 489.0)
REST = Sensors(
    4000, (1.0, 2.0, -3.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -9.8)
)


def test_positions_are_relative_to_the_first_sample():
    estimator = IdealEstimator(ORIGIN)
    assert estimator.update(REST)
    assert estimator.origin_ned_m == (1.0, 2.0, -3.0)
    assert estimator.update(replace(REST, time_us=8000, position_ned_m=(2.0, 2.5, -4.0)))
    assert estimator.state.position_ned_m == (1.0, 0.5, -1.0)
    assert estimator.state.time_us == 8000


@pytest.mark.parametrize("bad", [nan, inf, -inf])
@pytest.mark.parametrize(
    ("field", "length"),
    [
        ("position_ned_m", 3),
        ("velocity_ned_m_s", 3),
        ("attitude", 4),
        ("angular_rate_frd_rad_s", 3),
        ("specific_force_frd_m_s2", 3),
    ],
)
def test_a_value_that_is_not_finite_makes_the_sample_unusable(field, length, bad):
    for place in range(length):
        estimator = IdealEstimator(ORIGIN)
        assert estimator.update(REST)
        values = list(getattr(REST, field))
        values[place] = bad
        assert not estimator.update(replace(REST, time_us=8000, **{field: tuple(values)}))
        assert estimator.state.time_us == 4000  # the last good one stays


def test_opposite_infinities_do_not_cancel():
    assert not IdealEstimator(ORIGIN).update(replace(REST, position_ned_m=(inf, -inf, 0.0)))


def test_a_sample_must_be_newer_than_the_last():
    estimator = IdealEstimator(ORIGIN)
    assert estimator.update(REST)
    assert not estimator.update(REST)
    assert not estimator.update(replace(REST, time_us=3999))
    assert estimator.update(replace(REST, time_us=4001))


def test_an_attitude_that_is_not_a_rotation_is_unusable():
    assert not IdealEstimator(ORIGIN).update(replace(REST, attitude=(0.0, 0.0, 0.0, 0.0)))
    assert not IdealEstimator(ORIGIN).update(replace(REST, attitude=(2.0, 0.0, 0.0, 0.0)))
