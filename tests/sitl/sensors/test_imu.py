"""The IMU: Allan deviations as declared, vibration with the rotors' speed, saturation."""

import numpy as np
import pytest

from framerunner.vehicle.airframe import GRAVITY_M_S2
from sitl.sensors.imu import ImuSensor, InertialTriad
from sitl.sensors.suite import load_suite
from tests.sitl.sensors.statistics import (
    AIRFRAME,
    TICK_US,
    allan_deviation,
    motion,
    samples,
    without_errors,
)

SPEC = load_suite("mocap").imu
HOVER = (AIRFRAME.hover_speed_rad_s,) * 4


def rates_and_forces(imu, count, **parts):
    found = samples(imu, count, TICK_US, **parts)
    rates = np.array([each.angular_rate_frd_rad_s for each in found])
    forces = np.array([each.specific_force_frd_m_s2 for each in found])
    return rates, forces


def test_white_noise_of_the_installed_suite_is_the_data_sheets():
    """At averaging times far below those of the drift, the Allan deviation is N / sqrt(time)."""
    rates, forces = rates_and_forces(ImuSensor(SPEC, AIRFRAME, 1), 100_000)
    times_s = np.array([0.1, 0.4, 1.0])
    densities = (
        SPEC.gyroscope.noise_density_rad_s_sqrt_hz,
        SPEC.accelerometer.noise_density_m_s2_sqrt_hz,
    )
    for values, density in zip((rates, forces), densities, strict=True):
        found = allan_deviation(values, TICK_US * 1e-6, times_s)
        assert found == pytest.approx(density / np.sqrt(times_s), rel=0.06)


def test_drift_and_white_noise_have_the_allan_deviation_of_their_theory():
    """Of a Gauss-Markov process: IEEE Std 952-1997, annex C, with q^2 T = 2 sigma^2."""
    density, sigma, constant_s = 1e-3, 2e-3, 5.0
    triad = InertialTriad(
        7,
        "test",
        noise_density=density,
        turn_on_bias=0.5,
        drift=sigma,
        drift_time_s=constant_s,
        scale_error=0.0,
        vibration_at_hover=1.0,
        full_scale=100.0,
    )
    values = np.array([triad.measure((0.0, 0.0, 0.0), TICK_US, 0.0) for _ in range(750_000)])
    t = np.array([0.05, 0.5, 2.0, 1.89 * constant_s, 6 * constant_s])
    share = constant_s / (2 * t) * (3 - 4 * np.exp(-t / constant_s) + np.exp(-2 * t / constant_s))
    slow = 2 * sigma**2 * constant_s / t * (1 - share)
    assert allan_deviation(values, TICK_US * 1e-6, t) == pytest.approx(
        np.sqrt(density**2 / t + slow), rel=0.08
    )
    assert np.sqrt(slow[3]) == pytest.approx(0.62 * sigma, rel=0.01)  # the maximum, as the fields say
    assert np.std(values.mean(axis=0)) > 0.05  # the turn-on bias stays


def test_biases_and_scales_of_many_drones_spread_as_declared():
    drones = [ImuSensor(SPEC, AIRFRAME, seed) for seed in range(300)]
    biases = np.array([each._gyroscope._constant_bias for each in drones])
    scales = np.array([each._accelerometer._scale for each in drones]) - 1.0
    assert biases.std() == pytest.approx(SPEC.gyroscope.turn_on_bias_rad_s, rel=0.1)
    assert scales.std() == pytest.approx(SPEC.accelerometer.scale_error, rel=0.1)
    assert abs(biases.mean()) < 0.1 * biases.std()


def test_without_errors_it_measures_the_mean_motion():
    spec = SPEC.model_copy(
        update={
            "gyroscope": without_errors(SPEC.gyroscope, noise_density_rad_s_sqrt_hz=0.0),
            "accelerometer": without_errors(SPEC.accelerometer, noise_density_m_s2_sqrt_hz=0.0),
        }
    )
    rate, force = (0.1, -0.2, 0.3), (1.0, 2.0, -9.0)
    sample = ImuSensor(spec, AIRFRAME, 1).sample(
        motion(8000, angular_rate_frd_rad_s=rate, specific_force_frd_m_s2=force, motor_speeds_rad_s=HOVER)
    )
    assert (sample.time_us, sample.period_us) == (8000, TICK_US)
    assert sample.angular_rate_frd_rad_s == rate
    assert sample.specific_force_frd_m_s2 == force


def test_vibration_grows_with_the_mean_squared_rotor_speed_and_is_absent_at_rest():
    def spread(speed_rad_s):
        rates, forces = rates_and_forces(
            ImuSensor(SPEC, AIRFRAME, 3), 5000, motor_speeds_rad_s=(speed_rad_s,) * 4
        )
        return rates.std(axis=0).mean(), forces.std(axis=0).mean()

    hover_rad_s = AIRFRAME.hover_speed_rad_s
    rest, half, hover = spread(0.0), spread(hover_rad_s / 2), spread(hover_rad_s)
    assert hover == pytest.approx((0.015, 0.4), rel=0.05)
    assert half == pytest.approx((0.015 / 4, 0.4 / 4), rel=0.06)
    assert rest == pytest.approx((4.9e-5 * 250**0.5, 6.9e-4 * 250**0.5), rel=0.05)


def test_it_saturates_at_full_scale_on_each_axis_by_itself():
    sample = ImuSensor(SPEC, AIRFRAME, 1).sample(
        motion(angular_rate_frd_rad_s=(99.0, 1.0, -99.0), specific_force_frd_m_s2=(0.0, 500.0, -500.0))
    )
    full_rad_s, full_m_s2 = SPEC.gyroscope.max_rate_rad_s, SPEC.accelerometer.max_specific_force_m_s2
    assert sample.angular_rate_frd_rad_s[::2] == (full_rad_s, -full_rad_s)
    assert sample.angular_rate_frd_rad_s[1] == pytest.approx(1.0, abs=0.1)
    assert sample.specific_force_frd_m_s2[1:] == (full_m_s2, -full_m_s2)


def test_at_rest_it_measures_gravity_upwards_but_for_its_bias():
    _, forces = rates_and_forces(ImuSensor(SPEC, AIRFRAME, 5), 2500)
    assert forces.mean(axis=0) == pytest.approx((0.0, 0.0, -GRAVITY_M_S2), abs=0.25)
