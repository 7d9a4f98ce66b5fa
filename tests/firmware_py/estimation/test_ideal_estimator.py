from dataclasses import replace
from math import inf, nan

import pytest

from firmware_py.estimation.ideal_estimator import IdealEstimator
from firmware_py.estimation.report import Sensor
from framerunner.vehicle.atmosphere import pressure_altitude_m
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


def test_the_report_has_samples_without_errors():
    estimator = IdealEstimator(ORIGIN)
    assert estimator.report().latest.imu is None
    assert estimator.update(REST)
    assert estimator.update(replace(REST, time_us=8000, position_ned_m=(1.0, 2.0, -5.0)))
    report = estimator.report()
    latest = report.latest
    assert report.relied_on == report.healthy == report.present
    assert latest.imu.specific_force_frd_m_s2 == REST.specific_force_frd_m_s2
    assert latest.gps.altitude_m == pytest.approx(494.0)
    assert pressure_altitude_m(latest.barometer.pressure_pa) == pytest.approx(494.0)
    assert latest.magnetometer.field_frd_gauss == pytest.approx((0.22, 0.013, 0.43), abs=0.006)
    assert latest.range_finder.distance_m == report.height_above_ground_m == pytest.approx(2.0)


def test_without_a_position_the_receiver_has_no_fix():
    estimator = IdealEstimator(ORIGIN)
    assert estimator.update(REST)
    lost = replace(REST, time_us=8000, position_ned_m=(nan, nan, -3.0), velocity_ned_m_s=(nan, nan, 0.0))
    assert estimator.update(lost)
    report = estimator.report()
    assert report.latest.gps is None
    assert report.present - report.healthy == {Sensor.GPS}
    assert report.has_height
    assert not report.has_position
