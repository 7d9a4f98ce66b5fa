"""What an autopilot assumes that was set up for a sensor suite by its data sheets."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

from firmware_py.estimation.settings import EstimatorSettings, InertialNoise, SlowError
from sitl.sensors.specs import SuiteSpec

_PA_PER_M = 12.0  # of altitude near the ground: density times gravity
_DELAY_RESERVE_S = 0.012  # a measurement arrives at a tick, and some ticks may be lost
_MIN_DELAY_S = 0.02


def estimator_settings(spec: SuiteSpec) -> EstimatorSettings:
    """The estimator's settings for a suite that is not ideal.

    Raises:
        ValueError: the suite has no IMU.
    """
    if spec.imu is None:
        raise ValueError(f"suite {spec.name} has no IMU")
    gyro, accel = spec.imu.gyroscope, spec.imu.accelerometer
    noise = InertialNoise(
        gyro.noise_density_rad_s_sqrt_hz,
        accel.noise_density_m_s2_sqrt_hz,
        _walk(gyro.bias_drift_rad_s, gyro.bias_drift_time_s),
        _walk(accel.bias_drift_m_s2, accel.bias_drift_time_s),
        sqrt(accel.turn_on_bias_m_s2**2 + accel.bias_drift_m_s2**2),
        gyro.scale_error,
        accel.scale_error,
    )
    gps, pose, magnetometer, barometer = spec.gps, spec.external_pose, spec.magnetometer, spec.barometer
    delays_s = [part.delay_s for part in (gps, pose) if part is not None]
    delay_s = max(_MIN_DELAY_S, *delays_s) if delays_s else _MIN_DELAY_S
    chosen = EstimatorSettings(noise=noise, delay_us=round((delay_s + _DELAY_RESERVE_S) * 1e6))
    return replace(
        chosen,
        external=pose is not None,
        external_offset_sigma_m=pose.marker_offset_m if pose else 0.0,
        external_turn_sigma_rad=pose.marker_misalignment_rad if pose else 0.0,
        gps=gps is not None,
        gps_sigma_m=(gps.horizontal_noise_m, gps.vertical_noise_m) if gps else chosen.gps_sigma_m,
        gps_drift=(
            _slow(gps.horizontal_drift_m, gps.drift_time_s),
            _slow(gps.vertical_drift_m, gps.drift_time_s),
        )
        if gps
        else chosen.gps_drift,
        magnetometer_sigma_gauss=magnetometer.noise_gauss if magnetometer else None,
        hard_iron_sigma_gauss=magnetometer.hard_iron_gauss if magnetometer else 0.0,
        magnetometer_scale_sigma=magnetometer.scale_error if magnetometer else 0.0,
        barometer_sigma_pa=barometer.noise_pa if barometer else None,
        barometer_drift=_slow(barometer.drift_pa / _PA_PER_M, barometer.drift_time_s)
        if barometer
        else chosen.barometer_drift,
        range_sigma_m=spec.range_finder.noise_m if spec.range_finder else None,
        flow_sigma_rad_s=spec.optical_flow.noise_rad_s if spec.optical_flow else None,
        flow_scale_sigma=spec.optical_flow.scale_error if spec.optical_flow else 0.0,
        flow_gyro_bias_sigma_rad_s=spec.optical_flow.gyro_bias_rad_s if spec.optical_flow else 0.0,
    )


def parameter_defaults(spec: SuiteSpec) -> dict[str, float]:
    """The parameters that a vehicle with this suite has by default, as those of an airframe's file."""
    if spec.external_pose is None or spec.external_pose.source == "simulated":
        return {}
    noise = {"EKF2_EVP_NOISE": 0.01, "EKF2_EVA_NOISE": 0.02}
    return {"EKF2_EV_CTRL": 15, **noise}


def _walk(sigma: float, time_constant_s: float) -> float:
    """Density of the noise that drives a first-order Gauss-Markov process."""
    return sigma * sqrt(2.0 / time_constant_s)


def _slow(sigma: float, time_constant_s: float) -> SlowError:
    return SlowError(sigma, _walk(sigma, time_constant_s))
