"""What the estimator assumes about its sensors."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class InertialNoise:
    """The IMU.

    Attributes:
        gyro_density: white noise of the gyroscope, rad/s per root of Hz.
        accel_density: white noise of the accelerometer, m/s^2 per root of Hz. Vibration is measured.
        gyro_bias_walk: noise that drives the gyroscope's bias, rad/s per root of s.
        accel_bias_walk: noise that drives the accelerometer's bias, m/s^2 per root of s.
        accel_bias_sigma_m_s2: of the bias at boot.
        gyro_scale_sigma: of the error of the gyroscope's scale factors.
        accel_scale_sigma: of the error of the accelerometer's scale factors.
    """

    gyro_density: float = 1.0e-4
    accel_density: float = 2.0e-3
    gyro_bias_walk: float = 2.0e-5
    accel_bias_walk: float = 3.0e-4
    accel_bias_sigma_m_s2: float = 0.1
    gyro_scale_sigma: float = 0.0
    accel_scale_sigma: float = 0.0


@dataclass(frozen=True, slots=True)
class SlowError:
    """A slow error of a sensor.

    Attributes:
        sigma: of its size.
        noise_density: of the noise that drives it, unit per root of s.
    """

    sigma: float
    noise_density: float


@dataclass(frozen=True, slots=True)
class EstimatorSettings:
    """What the estimator assumes, and which measurements it fuses.

    Attributes:
        noise: of the IMU.
        delay_us: by which measurements may arrive late; the filter runs so much behind.
        no_aid_us: how long the position is usable without a measurement (PX4: EKF2_NOAID_TOUT).
        gate: innovations beyond so many standard deviations are rejected.
        reset_us: measurements rejected for so long are taken for right.
        external: poses from outside are fused.
        external_offset_sigma_m: of the place on the vehicle whose position is measured, from its centre of
            mass, per axis; 0: it is the centre.
        external_turn_sigma_rad: of a constant error of headings from outside; 0: there is none.
        gps: GPS is fused.
        gps_sigma_m: white noise of GPS positions, horizontal and vertical.
        gps_drift: slow errors of GPS positions, horizontal and vertical; `sigma` is that of a single one.
        magnetometer_sigma_gauss: white noise; None: not fused.
        hard_iron_sigma_gauss: constant error of the magnetometer.
        magnetometer_scale_sigma: of the error of the magnetometer's scale factors.
        barometer_sigma_pa: white noise; None: not fused.
        barometer_drift: slow error of the barometer.
        range_sigma_m: white noise of the range finder; None: not fused.
        ground_walk: noise that drives the height of the ground below, m per root of m flown over it.
        flow_sigma_rad_s: white noise of optical flow; None: not fused.
        flow_scale_sigma: of the error of the flow's scale.
        flow_gyro_bias_sigma_rad_s: of the bias of the flow sensor's own gyroscope.
    """

    noise: InertialNoise = field(default_factory=InertialNoise)
    delay_us: int = 48_000
    no_aid_us: int = 5_000_000
    gate: float = 5.0
    reset_us: int = 1_000_000
    external: bool = True
    external_offset_sigma_m: float = 0.0
    external_turn_sigma_rad: float = 0.0
    gps: bool = False
    gps_sigma_m: tuple[float, float] = (0.3, 0.5)
    gps_drift: tuple[SlowError, SlowError] = (SlowError(1.0, 0.1), SlowError(1.5, 0.15))
    magnetometer_sigma_gauss: float | None = None
    hard_iron_sigma_gauss: float = 0.02
    magnetometer_scale_sigma: float = 0.0
    barometer_sigma_pa: float | None = 2.5
    barometer_drift: SlowError = SlowError(0.5, 0.03)
    range_sigma_m: float | None = None
    ground_walk: float = 0.02
    flow_sigma_rad_s: float | None = None
    flow_scale_sigma: float = 0.0
    flow_gyro_bias_sigma_rad_s: float = 0.0
