"""What a sensor suite's file declares: the sensors and the figures of their errors, each with its unit."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from framerunner.files.yaml_file import refusal
from scenarios.part import Part

Sigma = Annotated[float, Field(ge=0, le=1e4)]
"""A standard deviation; 0: no such error."""
FieldSigma = Annotated[float, Field(ge=0, le=10)]
"""A standard deviation of a magnetic field, gauss; Earth's is about half a gauss."""
Share = Annotated[float, Field(ge=0, le=0.5)]
"""A standard deviation as a share of the measured value."""
TimeConstant = Annotated[float, Field(ge=0.01, le=1e6)]
Rate = Annotated[float, Field(ge=0.1, le=1000)]
"""Samples a second; more than one in a control tick are not delivered."""
DelayTime = Annotated[float, Field(ge=0, le=5)]


def _check_distances(min_m: float, max_m: float) -> None:
    """Refuse a sensor that can see nothing."""
    if min_m >= max_m:
        raise refusal(min_m, f"must be below max_distance_m {max_m}", "min_distance_m")


class GyroscopeSpec(Part):
    """The gyroscope of an IMU; figures of each axis."""

    noise_density_rad_s_sqrt_hz: Sigma = Field(description="white noise, rad/s per square root of a hertz")
    turn_on_bias_rad_s: Sigma = Field(description="constant bias, drawn at switching on; 1 sigma")
    bias_drift_rad_s: Sigma = Field(
        description="1 sigma of the slow part of the bias; its Allan deviation is at most 0.62 of this"
    )
    bias_drift_time_s: TimeConstant = Field(description="time constant of the slow part")
    scale_error: Share = Field(description="1 sigma of the error of the scale factor, drawn once")
    vibration_at_hover_rad_s: Sigma = Field(
        description="1 sigma of a sample at hover; grows with the mean squared rotor speed"
    )
    max_rate_rad_s: float = Field(ge=0.1, le=1e6, description="full scale; larger values saturate")


class AccelerometerSpec(Part):
    """The accelerometer of an IMU; figures of each axis."""

    noise_density_m_s2_sqrt_hz: Sigma = Field(description="white noise, m/s² per square root of a hertz")
    turn_on_bias_m_s2: Sigma = Field(description="constant bias, drawn at switching on; 1 sigma")
    bias_drift_m_s2: Sigma = Field(description="1 sigma of the slow part of the bias")
    bias_drift_time_s: TimeConstant = Field(description="time constant of the slow part")
    scale_error: Share = Field(description="1 sigma of the error of the scale factor, drawn once")
    vibration_at_hover_m_s2: Sigma = Field(
        description="1 sigma of a sample at hover; grows with the mean squared rotor speed"
    )
    max_specific_force_m_s2: float = Field(ge=1, le=1e6, description="full scale; larger values saturate")


class ImuSpec(Part):
    """Gyroscope and accelerometer: one sample in each control tick."""

    gyroscope: GyroscopeSpec = Field(description="angular rate")
    accelerometer: AccelerometerSpec = Field(description="specific force")


class MagnetometerSpec(Part):
    """A magnetometer after its calibration."""

    rate_hz: Rate = Field(description="samples a second")
    noise_gauss: FieldSigma = Field(description="white noise of a sample, 1 sigma of each axis")
    hard_iron_gauss: FieldSigma = Field(
        description="constant error that calibration leaves, drawn once; 1 sigma"
    )
    scale_error: Share = Field(description="1 sigma of the error of each axis's scale factor, drawn once")


class BarometerSpec(Part):
    """A barometer."""

    rate_hz: Rate = Field(description="samples a second")
    noise_pa: Sigma = Field(description="white noise of a sample, 1 sigma")
    turn_on_bias_pa: Sigma = Field(description="constant error and weather, drawn once; 1 sigma")
    drift_pa: Sigma = Field(description="1 sigma of the slow error")
    drift_time_s: TimeConstant = Field(description="time constant of the slow error")
    temperature_noise_k: Sigma = Field(description="white noise of the temperature, 1 sigma")


class GpsSpec(Part):
    """A GNSS receiver."""

    rate_hz: Rate = Field(description="solutions a second")
    first_fix_s: float = Field(ge=0, le=3600, description="time from switching on to the first 3D fix")
    delay_s: DelayTime = Field(description="from when a solution is true to its arrival")
    horizontal_drift_m: Sigma = Field(description="slow error of north and of east, 1 sigma of each")
    vertical_drift_m: Sigma = Field(description="slow error of the altitude, 1 sigma")
    drift_time_s: TimeConstant = Field(description="time constant of the slow errors")
    horizontal_noise_m: Sigma = Field(description="white noise of north and of east, 1 sigma of each")
    vertical_noise_m: Sigma = Field(description="white noise of the altitude, 1 sigma")
    velocity_noise_m_s: Sigma = Field(description="white noise of the velocity, 1 sigma of each axis")
    satellites: int = Field(ge=4, le=99, description="used in the solution")


class RangeFinderSpec(Part):
    """A range finder that looks along body down."""

    rate_hz: Rate = Field(description="samples a second")
    noise_m: Sigma = Field(description="white noise of a sample, 1 sigma")
    offset_m: Sigma = Field(description="constant error, drawn once; 1 sigma")
    min_distance_m: float = Field(ge=0, le=1000, description="nearest distance that it measures")
    max_distance_m: float = Field(ge=0.01, le=1000, description="farthest distance that it measures")

    @model_validator(mode="after")
    def _measures_something(self) -> Self:
        _check_distances(self.min_distance_m, self.max_distance_m)
        return self


class OpticalFlowSpec(Part):
    """An optical flow sensor that looks along body down, with its own gyroscope."""

    rate_hz: Rate = Field(description="samples a second; each integrates since the one before")
    noise_rad_s: Sigma = Field(description="white noise of a sample's flow, divided by its time; 1 sigma")
    scale_error: Share = Field(description="1 sigma of the error of the flow's scale, drawn once")
    gyro_noise_density_rad_s_sqrt_hz: Sigma = Field(description="white noise of its gyroscope")
    gyro_bias_rad_s: Sigma = Field(description="constant bias of its gyroscope, drawn once; 1 sigma")
    min_distance_m: float = Field(ge=0, le=1000, description="to the ground; nearer, the quality is 0")
    max_distance_m: float = Field(ge=0.01, le=1000, description="to the ground; farther, the quality is 0")
    max_flow_rad_s: float = Field(ge=0.01, le=100, description="faster, the quality is 0")
    quality: int = Field(ge=1, le=255, description="of a usable sample")
    shiny_share: float = Field(
        0.0, ge=0, le=1, description="of the floor, which reflects there; over it the quality is 0"
    )
    shiny_size_m: float = Field(0.5, ge=0.05, le=100, description="side of each square that reflects")

    @model_validator(mode="after")
    def _sees_something(self) -> Self:
        _check_distances(self.min_distance_m, self.max_distance_m)
        return self


class ExternalPoseSpec(Part):
    """Position and attitude by cameras, no velocity: motion capture, or visual odometry.

    With the sources `mavlink` and `app` the figures are what the estimator assumes of the poses that it
    receives as ODOMETRY: of another program, or of the app that flies, by the drone's own camera.
    """

    source: Literal["simulated", "mavlink", "app"] = Field(
        "simulated", description="whether poses are simulated here, or received as MAVLink ODOMETRY"
    )
    rate_hz: Rate = Field(description="poses a second that are sent to the drone")
    delay_s: DelayTime = Field(description="from when a pose is true to its arrival")
    position_noise_m: Sigma = Field(description="white noise, 1 sigma of each axis")
    attitude_noise_rad: Sigma = Field(description="white noise, 1 sigma about each axis")
    marker_offset_m: Sigma = Field(
        description="of the markers' middle from the centre of mass, body axes, drawn once; 1 sigma"
    )
    marker_misalignment_rad: Sigma = Field(
        description="of the markers' axes from the body's, drawn once; 1 sigma about each axis"
    )


class BatteryMonitorSpec(Part):
    """Measurement of the battery's voltage and current."""

    voltage_noise_v: Sigma = Field(description="white noise, 1 sigma")
    current_noise_a: Sigma = Field(description="white noise, 1 sigma")
    scale_error: Share = Field(description="1 sigma of the error of each scale factor, drawn once")


class SuiteSpec(Part):
    """The sensors of a drone; one that is left out is not there."""

    name: str = Field(
        pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=80, description="small letters, digits, - and _"
    )
    description: str = Field("", description="what kind of drone has these sensors")
    ideal: bool = Field(False, description="the autopilot is given the true state; no sensor is modelled")
    imu: ImuSpec | None = Field(None, description="gyroscope and accelerometer")
    magnetometer: MagnetometerSpec | None = Field(None, description="Earth's field in body axes")
    barometer: BarometerSpec | None = Field(None, description="static pressure")
    gps: GpsSpec | None = Field(None, description="position and velocity on Earth")
    range_finder: RangeFinderSpec | None = Field(None, description="distance to the ground")
    optical_flow: OpticalFlowSpec | None = Field(None, description="turning of the ground's image")
    external_pose: ExternalPoseSpec | None = Field(None, description="motion capture")
    battery: BatteryMonitorSpec | None = Field(None, description="without it, voltage and current are exact")

    @model_validator(mode="after")
    def _is_ideal_or_has_an_imu(self) -> Self:
        names = [name for name in type(self).model_fields if isinstance(getattr(self, name), Part)]
        if self.ideal and names:
            raise refusal("true", f"has no models; remove {', '.join(names)}, or ideal", "ideal")
        if not self.ideal and self.imu is None:
            raise refusal("missing:", "every autopilot needs one; add it, or `ideal: true`", "imu")
        return self
