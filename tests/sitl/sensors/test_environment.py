"""Magnetometer, barometer and GNSS receiver."""

from math import pi

import numpy as np
import pytest

from framerunner.geometry.rotations import quaternion_from_euler
from framerunner.vehicle.atmosphere import pressure_altitude_m, temperature_k
from framerunner.vehicle.earth_field import earth_field_ned_gauss
from framerunner.vehicle.geodesy import GeodeticPoint, LocalProjection
from framerunner.vehicle.measurements import FixType
from sitl.sensors.environment import Barometer, Gps, Magnetometer
from sitl.sensors.suite import load_suite
from tests.sitl.sensors.statistics import ORIGIN, TICK_US, autocorrelation, motion, samples, without_errors

OUTDOOR = load_suite("outdoor")
NORTH, EAST, DOWN = earth_field_ned_gauss(ORIGIN.latitude_deg, ORIGIN.longitude_deg, ORIGIN.altitude_m)


@pytest.mark.parametrize(
    ("angles_rad", "field"),
    [
        ((0.0, 0.0, 0.0), (NORTH, EAST, DOWN)),
        ((0.0, 0.0, pi / 2), (EAST, -NORTH, DOWN)),  # heading east: north is on the left
        ((0.0, pi / 2, 0.0), (-DOWN, EAST, NORTH)),  # nose up: forward is up, body down is north
        ((pi / 2, 0.0, 0.0), (NORTH, DOWN, -EAST)),  # right side down
    ],
)
def test_the_field_in_body_axes(angles_rad, field):
    sensor = Magnetometer(without_errors(OUTDOOR.magnetometer), ORIGIN, 1)
    sample = sensor.sample(motion(attitude=quaternion_from_euler(*angles_rad)))
    assert sample.field_frd_gauss == pytest.approx(field)


def test_the_magnetometers_noise_and_what_calibration_leaves():
    spec = OUTDOOR.magnetometer
    values = np.array([each.field_frd_gauss for each in samples(Magnetometer(spec, ORIGIN, 1), 5000, 20_000)])
    assert values.std(axis=0) == pytest.approx(spec.noise_gauss, rel=0.05)
    irons = [Magnetometer(spec, ORIGIN, seed)._hard_iron_gauss for seed in range(200)]
    assert np.std(irons) == pytest.approx(spec.hard_iron_gauss, rel=0.1)


def test_pressure_and_temperature_of_the_height():
    sensor = Barometer(without_errors(OUTDOOR.barometer), ORIGIN, 1)
    sample = sensor.sample(motion(position_ned_m=(0.0, 0.0, -12.0)))
    assert pressure_altitude_m(sample.pressure_pa) == pytest.approx(501.0)
    assert sample.temperature_k == pytest.approx(temperature_k(501.0))


def test_the_barometer_wanders_slowly_around_a_constant_error_and_never_repeats_itself():
    spec = OUTDOOR.barometer.model_copy(update={"drift_time_s": 20.0})
    pressures = np.array([s.pressure_pa for s in samples(Barometer(spec, ORIGIN, 1), 200_000, 40_000)])
    assert np.unique(pressures).size == pressures.size
    pressures -= pressures.mean()
    total = spec.drift_pa**2 + spec.noise_pa**2
    assert pressures.var() == pytest.approx(total, rel=0.15)
    for lag_s in (4.0, 20.0):
        expected = spec.drift_pa**2 / total * np.exp(-lag_s / 20.0)
        assert autocorrelation(pressures, round(lag_s * 25)) == pytest.approx(expected, abs=0.1)
    assert np.diff(pressures).std() == pytest.approx(spec.noise_pa * 2**0.5, rel=0.05)


def local_errors(spec, count, seed=1):
    """Position errors of solutions at rest, shape (n, 3), north, east, down, and velocities."""
    projection = LocalProjection(ORIGIN)
    found = samples(
        Gps(spec, ORIGIN, seed), count, round(1e6 / spec.rate_hz), position_ned_m=(3.0, -2.0, -1.5)
    )
    places = [
        projection.to_local(GeodeticPoint(s.latitude_deg, s.longitude_deg, s.altitude_m)) for s in found
    ]
    return np.array(places) - (3.0, -2.0, -1.5), np.array([s.velocity_ned_m_s for s in found])


def test_positions_wander_with_the_declared_spread_and_time_and_the_reported_accuracy_is_true():
    spec = OUTDOOR.gps.model_copy(update={"drift_time_s": 20.0, "first_fix_s": 0.0})
    errors, velocities = local_errors(spec, 96_000)
    sample = samples(Gps(spec, ORIGIN, 1), 3, 125_000)[-1]
    reported = (sample.horizontal_accuracy_m, sample.horizontal_accuracy_m, sample.vertical_accuracy_m)
    assert errors.std(axis=0) == pytest.approx(reported, rel=0.15)
    assert velocities.std(axis=0) == pytest.approx(sample.speed_accuracy_m_s, rel=0.03)
    scaled = errors / reported
    white = (spec.horizontal_noise_m / sample.horizontal_accuracy_m) ** 2
    for lag_s in (2.0, 20.0):
        expected = (1 - white) * np.exp(-lag_s / 20.0)
        assert autocorrelation(scaled, round(lag_s * spec.rate_hz)) == pytest.approx(expected, abs=0.07)


def test_most_of_a_gps_error_is_slow():
    """The spectrum of a Gauss-Markov process falls with the square of the frequency; white noise is flat."""
    spec = OUTDOOR.gps.model_copy(update={"drift_time_s": 20.0, "first_fix_s": 0.0})
    errors, _ = local_errors(spec, 65_536)
    power = (np.abs(np.fft.rfft(errors[:, 0])) ** 2)[1:]
    frequencies = np.fft.rfftfreq(len(errors), 1 / spec.rate_hz)[1:]
    density = 2 * power / (len(errors) * spec.rate_hz)

    def expected(frequency):
        slow = 4 * spec.horizontal_drift_m**2 * 20.0 / (1 + (2 * pi * frequency * 20.0) ** 2)
        return slow + 2 * spec.horizontal_noise_m**2 / spec.rate_hz

    for low, high in ((0.02, 0.05), (0.05, 0.1), (1.5, 3.9)):
        band = (frequencies > low) & (frequencies < high)
        assert density[band].mean() == pytest.approx(expected(frequencies[band]).mean(), rel=0.25)


def test_solutions_arrive_late_with_the_time_and_place_at_which_they_were_true():
    sensor = Gps(without_errors(OUTDOOR.gps, first_fix_s=0.0, satellites=12), ORIGIN, 1)
    projection = LocalProjection(ORIGIN)
    arrivals = []
    for tick in range(500):
        time_us = tick * TICK_US
        moving = motion(time_us, position_ned_m=(time_us * 1e-6, 0.0, -2.0), velocity_ned_m_s=(1.0, 0.0, 0.0))
        sample = sensor.sample(moving)
        if sample is not None:
            arrivals.append(time_us)
            assert 120_000 <= time_us - sample.time_us < 120_000 + TICK_US
            place = GeodeticPoint(sample.latitude_deg, sample.longitude_deg, sample.altitude_m)
            north_m, east_m, down_m = projection.to_local(place)
            assert (north_m, east_m, down_m) == pytest.approx((sample.time_us * 1e-6, 0.0, -2.0), abs=1e-6)
            assert (sample.velocity_ned_m_s, sample.satellites) == ((1.0, 0.0, 0.0), 12)
    assert len(arrivals) == 16  # 8 a second


def test_there_is_no_fix_at_first():
    spec = OUTDOOR.gps
    found = samples(Gps(spec, ORIGIN, 1), 80, 125_000)
    first = next(index for index, each in enumerate(found) if each.fix_type is FixType.FIX_3D)
    assert found[first].time_us == spec.first_fix_s * 1e6
    assert all(each.fix_type is FixType.FIX_3D for each in found[first:])
    assert all(each.fix_type is FixType.NO_FIX and each.satellites == 0 for each in found[:first])
    assert found[0].horizontal_accuracy_m > 1e6
