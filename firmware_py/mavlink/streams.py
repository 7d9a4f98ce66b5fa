"""All that can be streamed: message id to the function that makes it.

PX4 has streams that say nothing without a device that is not there. Their intervals can be set here too, with
PX4's answer and PX4's silence.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from firmware_py.mavlink import actuators, condition, motion, remote_id, sensing, targets, time_sync
from firmware_py.mavlink.exchange import Exchange
from firmware_py.mavlink.heartbeat import heartbeat
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.mission_progress import mission_current
from firmware_py.mavlink.port import AutopilotPort
from wire.dialect import Message, mavlink
from wire.traffic import link_node_status

Source = Callable[[AutopilotPort, int], "Message | None"]
DatedSource = Callable[[Exchange], "Message | None"]

SOURCES: Mapping[int, Source] = MappingProxyType(
    {
        mavlink.MAVLINK_MSG_ID_HEARTBEAT: heartbeat,
        mavlink.MAVLINK_MSG_ID_ACTUATOR_OUTPUT_STATUS: actuators.actuator_output_status,
        mavlink.MAVLINK_MSG_ID_ALTITUDE: motion.altitude,
        mavlink.MAVLINK_MSG_ID_ATTITUDE: motion.attitude,
        mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: motion.attitude_quaternion,
        mavlink.MAVLINK_MSG_ID_ATTITUDE_TARGET: targets.attitude_target,
        mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: condition.battery_status,
        mavlink.MAVLINK_MSG_ID_CURRENT_MODE: condition.current_mode,
        mavlink.MAVLINK_MSG_ID_DISTANCE_SENSOR: sensing.distance_sensor,
        mavlink.MAVLINK_MSG_ID_ESC_INFO: actuators.esc_info,
        mavlink.MAVLINK_MSG_ID_ESC_STATUS: actuators.esc_status,
        mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS: condition.estimator_status,
        mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: condition.extended_sys_state,
        mavlink.MAVLINK_MSG_ID_FLIGHT_INFORMATION: condition.flight_information,
        mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: motion.global_position_int,
        mavlink.MAVLINK_MSG_ID_GNSS_INTEGRITY: sensing.gnss_integrity,
        mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: condition.gps_global_origin,
        mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: sensing.gps_raw_int,
        mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: sensing.highres_imu,
        mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION: motion.hil_state_quaternion,
        mavlink.MAVLINK_MSG_ID_HOME_POSITION: condition.home_position,
        mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: motion.local_position_ned,
        mavlink.MAVLINK_MSG_ID_MISSION_CURRENT: mission_current,
        mavlink.MAVLINK_MSG_ID_ODOMETRY: motion.odometry,
        mavlink.MAVLINK_MSG_ID_PING: time_sync.ping_request,
        mavlink.MAVLINK_MSG_ID_POSITION_TARGET_GLOBAL_INT: targets.position_target_global_int,
        mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: targets.position_target_local_ned,
        mavlink.MAVLINK_MSG_ID_SCALED_IMU: sensing.scaled_imu,
        mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE: sensing.scaled_pressure,
        mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: actuators.servo_output_raw,
        mavlink.MAVLINK_MSG_ID_SYS_STATUS: condition.sys_status,
        mavlink.MAVLINK_MSG_ID_TIMESYNC: time_sync.timesync_request,
        mavlink.MAVLINK_MSG_ID_TIME_ESTIMATE_TO_TARGET: targets.time_estimate_to_target,
        mavlink.MAVLINK_MSG_ID_VFR_HUD: motion.vfr_hud,
        mavlink.MAVLINK_MSG_ID_VIBRATION: condition.vibration,
    }
)
"""What the autopilot's data alone make."""

DATED_SOURCES: Mapping[int, DatedSource] = MappingProxyType(
    {
        mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_LOCATION: remote_id.location,
        mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_SYSTEM: remote_id.system,
        mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: time_sync.system_time,
    }
)
"""What needs the date too."""

_LINK_NODE_STATUS = mavlink.MAVLINK_MSG_ID_LINK_NODE_STATUS

_SILENT = frozenset(
    int(getattr(mavlink, f"MAVLINK_MSG_ID_{name}"))
    for name in (
        "ADSB_VEHICLE",
        "CAMERA_TRIGGER",
        "COLLISION",
        "DEBUG",
        "DEBUG_FLOAT_ARRAY",
        "DEBUG_VECT",
        "EFI_STATUS",
        "GIMBAL_DEVICE_ATTITUDE_STATUS",
        "GIMBAL_DEVICE_INFORMATION",
        "GIMBAL_DEVICE_SET_ATTITUDE",
        "GIMBAL_MANAGER_INFORMATION",
        "GIMBAL_MANAGER_STATUS",
        "GPS2_RAW",
        "GPS_STATUS",
        "HYGROMETER_SENSOR",
        "LANDING_TARGET",
        "MAG_CAL_REPORT",
        "MANUAL_CONTROL",
        "MOUNT_ORIENTATION",
        "NAMED_VALUE_FLOAT",
        "NAV_CONTROLLER_OUTPUT",
        "OBSTACLE_DISTANCE",
        "OPEN_DRONE_ID_ARM_STATUS",
        "OPEN_DRONE_ID_BASIC_ID",
        "OPTICAL_FLOW_RAD",
        "ORBIT_EXECUTION_STATUS",
        "RAW_RPM",
        "RC_CHANNELS",
        "SCALED_IMU2",
        "SCALED_IMU3",
        "SCALED_PRESSURE2",
        "SCALED_PRESSURE3",
        "WIND_COV",
    )
)
_STREAMABLE = frozenset({*SOURCES, *DATED_SOURCES, _LINK_NODE_STATUS, *_SILENT})


def can_stream(message_id: int) -> bool:
    """Whether the interval of that message can be set."""
    return message_id in _STREAMABLE


def is_shared(message_id: int) -> bool:
    """Whether a message is the same on all links, so that it need be made only once."""
    return bool(message_id != _LINK_NODE_STATUS)


def stream_message(exchange: Exchange, message_id: int, link: Link | None = None) -> Message | None:
    """The message as it is now; None when it does not exist or has nothing to tell yet.

    Args:
        exchange: who tells.
        message_id: which.
        link: where it goes; matters for what `is_shared` is not.
    """
    source = SOURCES.get(message_id)
    if source is not None:
        return source(exchange.autopilot, exchange.time_us)
    dated = DATED_SOURCES.get(message_id)
    if dated is not None:
        return dated(exchange)
    of_service = exchange.sources.get(message_id)
    if of_service is not None:
        return of_service()
    if message_id == _LINK_NODE_STATUS and link is not None:
        return link_node_status(
            link.traffic, link.reader.skipped_bytes, link.reader.overflows, exchange.time_us
        )
    return None
