"""All that can be streamed: message id to the function that makes it from the autopilot's data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from firmware_py.mavlink import condition, motion, sensing, time_sync
from firmware_py.mavlink.dialect import Message, mavlink
from firmware_py.mavlink.exchange import Exchange
from firmware_py.mavlink.heartbeat import heartbeat
from firmware_py.mavlink.port import AutopilotPort

Source = Callable[[AutopilotPort, int], "Message | None"]

SOURCES: Mapping[int, Source] = MappingProxyType(
    {
        mavlink.MAVLINK_MSG_ID_HEARTBEAT: heartbeat,
        mavlink.MAVLINK_MSG_ID_ALTITUDE: motion.altitude,
        mavlink.MAVLINK_MSG_ID_ATTITUDE: motion.attitude,
        mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: motion.attitude_quaternion,
        mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: condition.battery_status,
        mavlink.MAVLINK_MSG_ID_CURRENT_MODE: condition.current_mode,
        mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS: condition.estimator_status,
        mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: condition.extended_sys_state,
        mavlink.MAVLINK_MSG_ID_FLIGHT_INFORMATION: condition.flight_information,
        mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: motion.global_position_int,
        mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: condition.gps_global_origin,
        mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: sensing.gps_raw_int,
        mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: sensing.highres_imu,
        mavlink.MAVLINK_MSG_ID_HOME_POSITION: condition.home_position,
        mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: motion.local_position_ned,
        mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: condition.mission_current,
        mavlink.MAVLINK_MSG_ID_ODOMETRY: motion.odometry,
        mavlink.MAVLINK_MSG_ID_PING: time_sync.ping_request,
        mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: motion.position_target_local_ned,
        mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE: sensing.scaled_pressure,
        mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: condition.servo_output_raw,
        mavlink.MAVLINK_MSG_ID_SYS_STATUS: condition.sys_status,
        mavlink.MAVLINK_MSG_ID_TIMESYNC: time_sync.timesync_request,
        mavlink.MAVLINK_MSG_ID_VFR_HUD: motion.vfr_hud,
        mavlink.MAVLINK_MSG_ID_VIBRATION: condition.vibration,
    }
)
_SYSTEM_TIME = mavlink.MAVLINK_MSG_ID_SYSTEM_TIME


def can_stream(message_id: int) -> bool:
    """Whether a message of that id exists as a stream."""
    return message_id in SOURCES or message_id == _SYSTEM_TIME


def stream_message(exchange: Exchange, message_id: int) -> Message | None:
    """The message as it is now; None when it does not exist or has nothing to tell yet."""
    if message_id == _SYSTEM_TIME:
        return time_sync.system_time(exchange.boot_unix_us, exchange.time_us)
    source = SOURCES.get(message_id)
    return None if source is None else source(exchange.autopilot, exchange.time_us)
