"""Telemetry of motion: attitude, position, velocity, their setpoints, home and the local frame's origin."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import degrees, hypot, isfinite, isnan, nan

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import AutopilotService
from firmware_py.mavlink.telemetry.streams import AutopilotSource
from firmware_py.setpoints import AttitudeSetpoint, BodyRateSetpoint, TrajectorySetpoint
from firmware_py.status import FlightMode
from framerunner.geometry.rotations import rotation
from framerunner.geometry.vectors import NAN3, Quaternion
from framerunner.vehicle.geodesy import GeodeticPoint, LocalProjection
from framerunner.vehicle.measurements import Sensors
from framerunner.wire.dialect import Message, boot_ms, degrees_e7, mavlink, millimetres, whole
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

_COVARIANCE_UNKNOWN = [nan] + [0.0] * 20
_DIAGONAL = (0, 6, 11, 15, 18, 20)  # of a symmetric matrix of 6 rows, in the rows of its upper triangle
_MILLI_G = 1000.0 / 9.80665  # of 1 m/s²
_GLOBAL_MODES = frozenset(
    mode
    for mode in FlightMode
    if mode is FlightMode.ORBIT or mode.value.flags & mavlink.MAV_MODE_FLAG_AUTO_ENABLED
)
_NO_ATTITUDE: Quaternion = (nan, nan, nan, nan)
_RATES_IGNORED = (
    mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE
    | mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE
    | mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE
)
_NO_ESTIMATE = -1

Truth = Callable[[], tuple[Sensors, GeodeticPoint]]
"""The true state of a simulated vehicle, and its place on Earth."""


def attitude(autopilot: Autopilot) -> Message:
    """ATTITUDE."""
    state = autopilot.state
    return mavlink.MAVLink_attitude_message(
        boot_ms(state.time_us), state.roll_rad, state.pitch_rad, state.yaw_rad, *state.angular_rate_frd_rad_s
    )


def attitude_quaternion(autopilot: Autopilot) -> Message:
    """ATTITUDE_QUATERNION."""
    state = autopilot.state
    return mavlink.MAVLink_attitude_quaternion_message(
        boot_ms(state.time_us), *state.attitude, *state.angular_rate_frd_rad_s
    )


def local_position_ned(autopilot: Autopilot) -> Message | None:
    """LOCAL_POSITION_NED; None before a position is known."""
    state = autopilot.state
    if autopilot.status.origin is None:
        return None
    return mavlink.MAVLink_local_position_ned_message(
        boot_ms(state.time_us), *state.position_ned_m, *state.velocity_ned_m_s
    )


def global_position_int(autopilot: Autopilot) -> Message | None:
    """GLOBAL_POSITION_INT; None before a position is known."""
    state, home, place = autopilot.state, autopilot.status.home, autopilot.global_position()
    if place is None:
        return None
    above_home_m = place.altitude_m - home.altitude_m if home else 0.0
    north_m_s, east_m_s, down_m_s = state.velocity_ned_m_s
    return mavlink.MAVLink_global_position_int_message(
        boot_ms(state.time_us),
        degrees_e7(place.latitude_deg),
        degrees_e7(place.longitude_deg),
        millimetres(place.altitude_m),
        millimetres(above_home_m),
        whole(north_m_s * 100, 16),
        whole(east_m_s * 100, 16),
        whole(down_m_s * 100, 16),
        whole(degrees(state.yaw_rad) % 360 * 100, 16, signed=False) % 36000,
    )


def vfr_hud(autopilot: Autopilot) -> Message | None:
    """VFR_HUD; airspeed is NaN, as in PX4 without such a sensor."""
    state, place = autopilot.state, autopilot.global_position()
    if place is None:
        return None
    north_m_s, east_m_s, down_m_s = state.velocity_ned_m_s
    return mavlink.MAVLink_vfr_hud_message(
        nan,
        hypot(north_m_s, east_m_s),
        whole(degrees(state.yaw_rad) % 360, 16) % 360,
        whole(autopilot.output.throttle * 100, 16, signed=False),
        place.altitude_m,
        -down_m_s,
    )


def altitude(autopilot: Autopilot) -> Message | None:
    """ALTITUDE; the terrain is not known."""
    state, home, place = autopilot.state, autopilot.status.home, autopilot.global_position()
    if place is None:
        return None
    return mavlink.MAVLink_altitude_message(
        state.time_us,
        place.altitude_m,
        place.altitude_m,
        -state.position_ned_m[2],
        place.altitude_m - home.altitude_m if home else nan,
        nan,
        nan,
    )


def odometry(autopilot: Autopilot) -> Message | None:
    """ODOMETRY; velocity in the local frame, variances of position, attitude and velocity, as in PX4."""
    state = autopilot.state
    if autopilot.status.origin is None:
        return None
    report = autopilot.estimator.report()
    squared = [component * component for component in rotation(state.attitude)]
    about_body = [
        sum(squared[3 * row + column] * report.attitude_variance_rad2[row] for row in range(3))
        for column in range(3)
    ]
    return mavlink.MAVLink_odometry_message(
        state.time_us,
        mavlink.MAV_FRAME_LOCAL_NED,
        mavlink.MAV_FRAME_LOCAL_NED,
        *state.position_ned_m,
        state.attitude,
        *state.velocity_ned_m_s,
        *state.angular_rate_frd_rad_s,
        _covariance((*report.position_variance_m2, *about_body)),
        _covariance(report.velocity_variance_m2_s2),
        report.resets & 0xFF,
        mavlink.MAV_ESTIMATOR_TYPE_AUTOPILOT,
        0,
    )


def _covariance(variances: Sequence[float]) -> list[float]:
    """A covariance matrix of which only variances are known, as in PX4."""
    entries = [nan] * 21
    for index, variance in zip(_DIAGONAL, variances, strict=False):
        entries[index] = variance
    return entries


def hil_state_quaternion(autopilot: Autopilot, truth: Truth | None) -> Message | None:
    """HIL_STATE_QUATERNION: the true state, of a simulated vehicle."""
    if truth is None:
        return None
    state, place = truth()
    return mavlink.MAVLink_hil_state_quaternion_message(
        state.time_us,
        state.attitude,
        *state.angular_rate_frd_rad_s,
        degrees_e7(place.latitude_deg),
        degrees_e7(place.longitude_deg),
        millimetres(place.altitude_m),
        *[whole(velocity_m_s * 100, 16) for velocity_m_s in state.velocity_ned_m_s],
        0,
        0,
        *[whole(force * _MILLI_G, 16) for force in state.specific_force_frd_m_s2],
    )


def position_target_local_ned(autopilot: Autopilot) -> Message:
    """POSITION_TARGET_LOCAL_NED: the present setpoint; an uncontrolled component is NaN and masked out."""
    followed = autopilot.status.setpoint.trajectory
    return mavlink.MAVLink_position_target_local_ned_message(
        boot_ms(autopilot.state.time_us),
        mavlink.MAV_FRAME_LOCAL_NED,
        _mask(followed),
        *followed.position_ned_m,
        *followed.velocity_ned_m_s,
        *followed.acceleration_ned_m_s2,
        followed.yaw_rad,
        followed.yaw_rate_rad_s,
    )


def position_target_global_int(autopilot: Autopilot) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT, while armed in a mode that flies to a position, as in PX4."""
    status = autopilot.status
    followed, origin = status.setpoint.trajectory, status.origin
    north_m, east_m, down_m = followed.position_ned_m
    if not status.armed or status.mode not in _GLOBAL_MODES or origin is None:
        return None
    if not (isfinite(north_m) and isfinite(east_m)):
        return None
    place = LocalProjection(origin).to_geodetic((north_m, east_m, down_m))
    return mavlink.MAVLink_position_target_global_int_message(
        boot_ms(autopilot.state.time_us),
        mavlink.MAV_FRAME_GLOBAL_INT,
        _mask(followed),
        degrees_e7(place.latitude_deg),
        degrees_e7(place.longitude_deg),
        place.altitude_m,
        *followed.velocity_ned_m_s,
        *followed.acceleration_ned_m_s2,
        followed.yaw_rad,
        followed.yaw_rate_rad_s,
    )


def attitude_target(autopilot: Autopilot) -> Message:
    """ATTITUDE_TARGET: attitude and rates where a setpoint contains them, else masked; the thrust always.

    The stabiliser computes motor speeds from a velocity directly, so there is no other attitude setpoint.
    """
    followed = autopilot.status.setpoint
    mask = 0
    attitude, rates, thrust = _NO_ATTITUDE, NAN3, autopilot.output.throttle
    if isinstance(followed, AttitudeSetpoint):
        attitude, thrust = followed.attitude, followed.thrust
    else:
        mask |= mavlink.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE
    if isinstance(followed, BodyRateSetpoint):
        rates, thrust = followed.rate_frd_rad_s, followed.thrust
    else:
        mask |= _RATES_IGNORED
    return mavlink.MAVLink_attitude_target_message(
        boot_ms(autopilot.state.time_us), mask, attitude, *rates, thrust
    )


def time_estimate_to_target(autopilot: Autopilot) -> Message | None:
    """TIME_ESTIMATE_TO_TARGET: seconds that a return would take; -1 where PX4 has no value either.

    Climb to RTL_RETURN_ALT, cruise home, descend, wait RTL_LAND_DELAY, land: distances over the speeds of
    the parameters, without acceleration and without PX4's reserve.
    """
    status, state = autopilot.status, autopilot.state
    if status.home is None:
        return None
    value = autopilot.parameters.value
    height_m = status.home_ned_m[2] - state.position_ned_m[2]
    distance_m = hypot(
        state.position_ned_m[0] - status.home_ned_m[0], state.position_ned_m[1] - status.home_ned_m[1]
    )
    top_m = max(height_m, value("RTL_RETURN_ALT")) if distance_m > value("RTL_MIN_DIST") else height_m
    slow_from_m = min(top_m, max(0.0, value("RTL_DESCEND_ALT")))
    seconds = (
        (top_m - height_m) / value("MPC_Z_V_AUTO_UP")
        + distance_m / value("MPC_XY_CRUISE")
        + (top_m - slow_from_m) / value("MPC_Z_V_AUTO_DN")
        + max(0.0, value("RTL_LAND_DELAY"))
        + slow_from_m / value("MPC_LAND_SPEED")
    )
    return mavlink.MAVLink_time_estimate_to_target_message(
        whole(seconds, 32), _NO_ESTIMATE, _NO_ESTIMATE, _NO_ESTIMATE, _NO_ESTIMATE
    )


def _mask(followed: TrajectorySetpoint) -> int:
    """POSITION_TARGET_TYPEMASK: the components that are not controlled."""
    components = (*followed.position_ned_m, *followed.velocity_ned_m_s, *followed.acceleration_ned_m_s2)
    mask = sum(1 << bit for bit, value in enumerate(components) if isnan(value))
    if isnan(followed.yaw_rad):
        mask |= int(mavlink.POSITION_TARGET_TYPEMASK_YAW_IGNORE)
    if isnan(followed.yaw_rate_rad_s):
        mask |= int(mavlink.POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE)
    return mask


MOTION: dict[int, AutopilotSource] = {
    mavlink.MAVLINK_MSG_ID_ALTITUDE: altitude,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: attitude,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: attitude_quaternion,
    mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET: attitude_target,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: global_position_int,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: local_position_ned,
    mavlink.MAVLINK_MSG_ID_ODOMETRY: odometry,
    mavlink.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT: position_target_global_int,
    mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: position_target_local_ned,
    mavlink.MAVLINK_MSG_ID_TIME_ESTIMATE_TO_TARGET: time_estimate_to_target,
    mavlink.MAVLINK_MSG_ID_VFR_HUD: vfr_hud,
}


class HomeAndOriginService(AutopilotService):
    """HOME_POSITION, GPS_GLOBAL_ORIGIN and SET_GPS_GLOBAL_ORIGIN."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        super().__init__(autopilot, exchange)
        self._sent_origin: GeodeticPoint | None = None
        self._sent_home: GeodeticPoint | None = None
        self.handlers = {mavlink.MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN: self._set_origin}
        self.sources = {
            mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: self._gps_global_origin,
            mavlink.MAVLINK_MSG_ID_HOME_POSITION: self._home_position,
        }

    def update(self) -> None:
        """Broadcast what has changed, without waiting for its stream's next turn."""
        status = self._autopilot.status
        if status.origin is not self._sent_origin:
            self._sent_origin = status.origin
            self._broadcast(self._gps_global_origin())
        if status.home is not self._sent_home:
            self._sent_home = status.home
            self._broadcast(self._home_position())

    def _broadcast(self, message: Message | None) -> None:
        if message is not None:
            self._exchange.broadcast(message)

    def _home_position(self) -> Message | None:
        status = self._autopilot.status
        if status.home is None:
            return None
        return mavlink.MAVLink_home_position_message(
            degrees_e7(status.home.latitude_deg),
            degrees_e7(status.home.longitude_deg),
            millimetres(status.home.altitude_m),
            *status.home_ned_m,
            (1.0, 0.0, 0.0, 0.0),
            0.0,
            0.0,
            0.0,
            self._autopilot.state.time_us,
        )

    def _gps_global_origin(self) -> Message | None:
        origin = self._autopilot.status.origin
        if origin is None:
            return None
        return mavlink.MAVLink_gps_global_origin_message(
            degrees_e7(origin.latitude_deg),
            degrees_e7(origin.longitude_deg),
            millimetres(origin.altitude_m),
            self._autopilot.state.time_us,
        )

    def _set_origin(self, _link: Link, message: Message) -> None:
        if message.target_system == self._exchange.system_id:
            self._autopilot.set_origin(
                GeodeticPoint(message.latitude / 1e7, message.longitude / 1e7, message.altitude / 1e3)
            )
