"""The logged topics: PX4's, with the fields of PX4 v1.17's messages that this vehicle has values for.

A log describes itself, and its readers look for fields by name; so values that do not exist here (reset
counters, airspeed, second sensors) are left out instead of filled with zeros.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import atan2, hypot, isfinite, nan

from firmware_py.autopilot import Autopilot
from firmware_py.estimation.report import EstimatorReport, Sensor
from firmware_py.mavlink.telemetry.condition import pulses_us
from firmware_py.mavlink.telemetry.health import accuracy_m, solution_flags
from firmware_py.setpoints import AttitudeSetpoint, BodyRateSetpoint
from firmware_py.status import NAVIGATION_STATES, LandedState
from firmware_py.ulog.ulog_messages import Topic
from framerunner.vehicle.atmosphere import pressure_altitude_m
from framerunner.vehicle.geodesy import GeodeticPoint

Values = tuple[float, ...]

_AIR_GAS_CONSTANT = 287.05  # J/(kg K), dry
_KELVIN = 273.15
# Bits of estimator_status.control_mode_flags (EKF2's control_status).
_TILT_ALIGNED, _YAW_ALIGNED = 1 << 0, 1 << 1
_AIDED_BY = {
    Sensor.GPS: 1 << 2 | 1 << 44,  # position, velocity
    Sensor.OPTICAL_FLOW: 1 << 3,
    Sensor.MAGNETOMETER: 1 << 4,
    Sensor.BAROMETER: 1 << 9,
    Sensor.RANGE_FINDER: 1 << 10,
    Sensor.EXTERNAL_POSE: 1 << 12 | 1 << 13 | 1 << 14,  # position, heading, height
}


@dataclass(frozen=True, slots=True)
class LogSample:
    """One sample of the autopilot, with values that several topics need.

    Attributes:
        autopilot: which is sampled.
        time_us: vehicle time.
        unix_us: the same since 1970; 0: not known.
        place: position on Earth; None: not known.
        report: of the estimator.
    """

    autopilot: Autopilot
    time_us: int
    unix_us: int
    place: GeodeticPoint | None
    report: EstimatorReport


def control_mode_flags(report: EstimatorReport) -> int:
    """What is known, and what aids the filter."""
    flags = _TILT_ALIGNED | _YAW_ALIGNED if report.has_attitude else 0
    return flags | sum(bits for sensor, bits in _AIDED_BY.items() if sensor in report.relied_on)


def accuracies_and_ratios(report: EstimatorReport) -> Values:
    """Accuracies of position and height, ratios of heading, velocity, position and height."""
    ratios = report.ratios
    return (
        *accuracy_m(report),
        ratios.heading,
        ratios.velocity,
        ratios.position_horizontal,
        ratios.position_vertical,
    )


def gps(sample: LogSample) -> Values | None:
    """Values of vehicle_gps_position."""
    fix = sample.report.latest.gps
    if fix is None:
        return None
    north_m_s, east_m_s, down_m_s = fix.velocity_ned_m_s
    return (
        sample.time_us,
        fix.time_us,
        sample.unix_us,
        fix.latitude_deg,
        fix.longitude_deg,
        fix.altitude_m,
        fix.altitude_m,
        fix.speed_accuracy_m_s,
        nan,
        fix.horizontal_accuracy_m,
        fix.vertical_accuracy_m,
        nan,
        nan,
        0,
        0,
        hypot(north_m_s, east_m_s),
        north_m_s,
        east_m_s,
        down_m_s,
        atan2(east_m_s, north_m_s),
        nan,
        *(int(fix.fix_type), 1, 1, True, fix.satellites),
    )


def air_data(sample: LogSample) -> Values | None:
    """Values of vehicle_air_data."""
    pressure = sample.report.latest.barometer
    if pressure is None:
        return None
    density_kg_m3 = pressure.pressure_pa / (_AIR_GAS_CONSTANT * pressure.temperature_k)
    return (
        sample.time_us,
        sample.time_us,
        pressure_altitude_m(pressure.pressure_pa),
        pressure.pressure_pa,
        pressure.temperature_k - _KELVIN,
        density_kg_m3,
    )


def magnetometer(sample: LogSample) -> Values | None:
    """Values of vehicle_magnetometer."""
    field = sample.report.latest.magnetometer
    return None if field is None else (sample.time_us, field.time_us, *field.field_frd_gauss)


def sensor_combined(sample: LogSample) -> Values | None:
    """Values of sensor_combined: the IMU as measured."""
    imu = sample.report.latest.imu
    if imu is None:
        return None
    rate, force, period_us = imu.angular_rate_frd_rad_s, imu.specific_force_frd_m_s2, imu.period_us
    return (sample.time_us, *rate, period_us, 0, *force, period_us, 0, 0, 0, 0)


_MOTORS = 12
_OUTPUTS = 16
_FAST_US = 20_000  # 50 Hz
_USUAL_US = 100_000
_SLOW_US = 500_000
_ARMED, _DISARMED = 2, 1  # vehicle_status.arming_state
_ROTARY_WING = 1
_ESTIMATOR_IN_AIR = 1 << 7  # of estimator_status.control_mode_flags


Collector = Callable[[LogSample], Values | None]
"""From a sample to values in the topic's order; None: nothing to log."""


def _attitude(sample: LogSample) -> Values:
    time_us = sample.time_us
    return (time_us, time_us, *sample.autopilot.state.attitude, 0.0, 0.0, 0.0, 0.0, 0)


def _attitude_setpoint(sample: LogSample) -> Values | None:
    followed = sample.autopilot.status.setpoint
    if not isinstance(followed, AttitudeSetpoint):
        return None
    yaw_rate_rad_s = followed.yaw_rate_rad_s
    return (sample.time_us, yaw_rate_rad_s, *followed.attitude, 0.0, 0.0, -followed.thrust)


def _rates_setpoint(sample: LogSample) -> Values | None:
    followed = sample.autopilot.status.setpoint
    if not isinstance(followed, BodyRateSetpoint):
        return None
    return (sample.time_us, *followed.rate_frd_rad_s, 0.0, 0.0, -followed.thrust)


def _angular_velocity(sample: LogSample) -> Values:
    return (sample.time_us, sample.time_us, *sample.autopilot.state.angular_rate_frd_rad_s)


def _thrust_setpoint(sample: LogSample) -> Values:
    return (sample.time_us, sample.time_us, 0.0, 0.0, -sample.autopilot.output.throttle)


def _actuator_motors(sample: LogSample) -> Values:
    """Thrust of each motor as a share of full thrust; NaN while disarmed, as PX4's."""
    autopilot = sample.autopilot
    speeds, full_rad_s = autopilot.output.speeds_rad_s, autopilot.airframe.motor.max_speed_rad_s
    turning = speeds[:_MOTORS] if autopilot.status.armed else ()
    shares = [(speed / full_rad_s) ** 2 for speed in turning]
    return (sample.time_us, sample.time_us, *shares, *[nan] * (_MOTORS - len(shares)), 0)


def _actuator_outputs(sample: LogSample) -> Values:
    """Pulses in microseconds, as SERVO_OUTPUT_RAW."""
    pulses = pulses_us(sample.autopilot)
    count = len(pulses)
    return (sample.time_us, count, *pulses, *[0.0] * (_OUTPUTS - count))


def _local_position(sample: LogSample) -> Values | None:
    state, origin = sample.autopilot.state, sample.autopilot.status.origin
    if origin is None:
        return None
    return (
        sample.time_us,
        sample.time_us,
        0,
        origin.latitude_deg,
        origin.longitude_deg,
        *state.position_ned_m,
        *state.velocity_ned_m_s,
        state.velocity_ned_m_s[2],
        state.yaw_rad,
        origin.altitude_m,
        *_local_quality(sample.report),
    )


def _local_quality(report: EstimatorReport) -> Values:
    """Height above ground, accuracies and validity."""
    horizontal_m, vertical_m = accuracy_m(report)
    place, height, speed = report.has_position, report.has_height, report.has_velocity
    above_ground_m = report.height_above_ground_m
    return (
        above_ground_m,
        horizontal_m,
        vertical_m,
        *(place, height, speed, height, report.has_attitude, place, height),
        *(isfinite(above_ground_m), not place),
    )


def _local_position_setpoint(sample: LogSample) -> Values:
    followed = sample.autopilot.status.setpoint.trajectory
    return (
        sample.time_us,
        *followed.position_ned_m,
        *followed.velocity_ned_m_s,
        *followed.acceleration_ned_m_s2,
        nan,
        nan,
        -sample.autopilot.output.throttle,
        followed.yaw_rad,
        followed.yaw_rate_rad_s,
    )


def _global_position(sample: LogSample) -> Values | None:
    place = sample.place
    if place is None:
        return None
    return (
        sample.time_us,
        sample.time_us,
        place.latitude_deg,
        place.longitude_deg,
        place.altitude_m,
        place.altitude_m,
        0.0,
        0.0,
        nan,
        *(True, True, False, False),
    )


def _land_detected(sample: LogSample) -> Values:
    landed = sample.autopilot.status.landed_state is LandedState.ON_GROUND
    low_throttle = sample.autopilot.output.throttle < 0.1
    return (sample.time_us, False, landed, landed, landed, low_throttle)


def _battery(sample: LogSample) -> Values:
    battery = sample.autopilot.battery
    warning = max(battery.warning - 1, 0)  # MAV_BATTERY_CHARGE_STATE counts from 1
    return (
        sample.time_us,
        battery.voltage_v,
        battery.current_a,
        battery.current_a,
        battery.used_mah,
        battery.remaining,
        1.0,
        nan,
        nan,
        *(True, battery.cells, 1, warning),
    )


def _vehicle_status(sample: LogSample) -> Values:
    autopilot = sample.autopilot
    status, flight = autopilot.status, autopilot.flight
    return (
        sample.time_us,
        flight.armed_us if status.armed else 0,
        flight.takeoff_us,
        _ARMED if status.armed else _DISARMED,
        NAVIGATION_STATES[status.intended_mode],
        NAVIGATION_STATES[status.mode],
        0,
        _ROTARY_WING,
        status.failsafe,
        *(False, False, False, False, False),
        2,
        autopilot.parameters.integer("MAV_SYS_ID"),
        1,
        status.ready,
    )


def _estimator_status(sample: LogSample) -> Values:
    flying = sample.autopilot.status.landed_state is not LandedState.ON_GROUND
    report = sample.report
    return (
        sample.time_us,
        sample.time_us,
        control_mode_flags(report) | (_ESTIMATOR_IN_AIR if flying else 0),
        0,
        *(0.0, 0.0, 0.0),
        *accuracies_and_ratios(report),
        *(0.0, 0.0),
        0,
        solution_flags(sample.autopilot, report),
        0,
        0,
    )


@dataclass(frozen=True, slots=True)
class Logged:
    """A topic, the period in which it is logged, and its collector."""

    topic: Topic
    period_us: int
    collect: Collector


_T = "uint64_t timestamp; "
_TT = _T + "uint64_t timestamp_sample; "

_LAYOUTS: tuple[tuple[str, int, Collector, str], ...] = (
    (
        "vehicle_attitude",
        _FAST_US,
        _attitude,
        _TT + "float[4] q; float[4] delta_q_reset; uint8_t quat_reset_counter",
    ),
    (
        "vehicle_attitude_setpoint",
        _FAST_US,
        _attitude_setpoint,
        _T + "float yaw_sp_move_rate; float[4] q_d; float[3] thrust_body",
    ),
    (
        "vehicle_rates_setpoint",
        _FAST_US,
        _rates_setpoint,
        _T + "float roll; float pitch; float yaw; float[3] thrust_body",
    ),
    ("vehicle_angular_velocity", _FAST_US, _angular_velocity, _TT + "float[3] xyz"),
    (
        "sensor_combined",
        _FAST_US,
        sensor_combined,
        _T + "float[3] gyro_rad; uint32_t gyro_integral_dt; int32_t accelerometer_timestamp_relative; "
        "float[3] accelerometer_m_s2; uint32_t accelerometer_integral_dt; uint8_t accelerometer_clipping; "
        "uint8_t gyro_clipping; uint8_t accel_calibration_count; uint8_t gyro_calibration_count",
    ),
    ("vehicle_thrust_setpoint", _FAST_US, _thrust_setpoint, _TT + "float[3] xyz"),
    ("actuator_motors", _FAST_US, _actuator_motors, _TT + "float[12] control; uint16_t reversible_flags"),
    ("actuator_outputs", _USUAL_US, _actuator_outputs, _T + "uint32_t noutputs; float[16] output"),
    (
        "vehicle_local_position",
        _USUAL_US,
        _local_position,
        _TT + "uint64_t ref_timestamp; double ref_lat; double ref_lon; float x; float y; float z; float vx; "
        "float vy; float vz; float z_deriv; float heading; float ref_alt; float dist_bottom; float eph; "
        "float epv; bool xy_valid; bool z_valid; bool v_xy_valid; bool v_z_valid; "
        "bool heading_good_for_control; bool xy_global; bool z_global; bool dist_bottom_valid; "
        "bool dead_reckoning",
    ),
    (
        "vehicle_local_position_setpoint",
        _USUAL_US,
        _local_position_setpoint,
        _T
        + "float x; float y; float z; float vx; float vy; float vz; float[3] acceleration; float[3] thrust; "
        "float yaw; float yawspeed",
    ),
    (
        "vehicle_global_position",
        _USUAL_US,
        _global_position,
        _TT
        + "double lat; double lon; float alt; float alt_ellipsoid; float eph; float epv; float terrain_alt; "
        "bool lat_lon_valid; bool alt_valid; bool terrain_alt_valid; bool dead_reckoning",
    ),
    (
        "vehicle_gps_position",
        _USUAL_US,
        gps,
        _TT + "uint64_t time_utc_usec; double latitude_deg; double longitude_deg; double altitude_msl_m; "
        "double altitude_ellipsoid_m; float s_variance_m_s; float c_variance_rad; float eph; float epv; "
        "float hdop; float vdop; int32_t noise_per_ms; int32_t jamming_indicator; float vel_m_s; "
        "float vel_n_m_s; float vel_e_m_s; float vel_d_m_s; float cog_rad; float heading; uint8_t fix_type; "
        "uint8_t jamming_state; uint8_t spoofing_state; bool vel_ned_valid; uint8_t satellites_used",
    ),
    (
        "vehicle_air_data",
        _USUAL_US,
        air_data,
        _TT + "float baro_alt_meter; float baro_pressure_pa; float ambient_temperature; float rho",
    ),
    ("vehicle_magnetometer", _USUAL_US, magnetometer, _TT + "float[3] magnetometer_ga"),
    (
        "vehicle_land_detected",
        _USUAL_US,
        _land_detected,
        _T + "bool freefall; bool ground_contact; bool maybe_landed; bool landed; bool has_low_throttle",
    ),
    (
        "battery_status",
        _SLOW_US,
        _battery,
        _T + "float voltage_v; float current_a; float current_average_a; float discharged_mah; "
        "float remaining; float scale; float time_remaining_s; float temperature; bool connected; "
        "uint8_t cell_count; uint8_t id; uint8_t warning",
    ),
    (
        "vehicle_status",
        _SLOW_US,
        _vehicle_status,
        _T + "uint64_t armed_time; uint64_t takeoff_time; uint8_t arming_state; "
        "uint8_t nav_state_user_intention; uint8_t nav_state; uint8_t hil_state; uint8_t vehicle_type; "
        "bool failsafe; bool failsafe_and_user_took_over; bool gcs_connection_lost; bool is_vtol; "
        "bool in_transition_mode; bool in_transition_to_fw; uint8_t system_type; uint8_t system_id; "
        "uint8_t component_id; bool pre_flight_checks_pass",
    ),
    (
        "estimator_status",
        _SLOW_US,
        _estimator_status,
        _TT + "uint64_t control_mode_flags; uint32_t filter_fault_flags; float[3] output_tracking_error; "
        "float pos_horiz_accuracy; float pos_vert_accuracy; float hdg_test_ratio; float vel_test_ratio; "
        "float pos_test_ratio; float hgt_test_ratio; float tas_test_ratio; float time_slip; "
        "uint16_t gps_check_fail_flags; uint16_t solution_status_flags; uint8_t health_flags; "
        "uint8_t timeout_flags",
    ),
)

LOGGED = tuple(
    Logged(Topic(name, fields, number), period_us, collect)
    for number, (name, period_us, collect, fields) in enumerate(_LAYOUTS)
)
STATUS_TOPIC = next(each for each in LOGGED if each.topic.name == "vehicle_status")
