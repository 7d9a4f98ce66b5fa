"""PX4 v1.17's stream rates: of its onboard link (UDP 14540), its ground station link (UDP 14550), a radio."""

from __future__ import annotations

from types import MappingProxyType

from wire.dialect import mavlink
from wire.link import LinkProfile


def _profile(name: str, rates_hz: dict[str, float]) -> LinkProfile:
    by_id = {int(getattr(mavlink, f"MAVLINK_MSG_ID_{message}")): rate for message, rate in rates_hz.items()}
    return LinkProfile(name, MappingProxyType(by_id))


ONBOARD = _profile(
    "onboard",
    {
        "HEARTBEAT": 1,
        "ALTITUDE": 10,
        "ATTITUDE": 100,
        "ATTITUDE_QUATERNION": 50,
        "ATTITUDE_TARGET": 10,
        "BATTERY_STATUS": 0.5,
        "CURRENT_MODE": 0.5,
        "DISTANCE_SENSOR": 10,
        "ESTIMATOR_STATUS": 1,
        "EXTENDED_SYS_STATE": 5,
        "GLOBAL_POSITION_INT": 50,
        "GNSS_INTEGRITY": 1,
        "GPS_RAW_INT": 8,
        "HIGHRES_IMU": 50,
        "HOME_POSITION": 0.5,
        "LINK_NODE_STATUS": 1,
        "LOCAL_POSITION_NED": 30,
        "MISSION_CURRENT": 1,
        "ODOMETRY": 30,
        "OPEN_DRONE_ID_LOCATION": 1,
        "OPEN_DRONE_ID_SYSTEM": 1,
        "PING": 1,
        "POSITION_TARGET_GLOBAL_INT": 10,
        "POSITION_TARGET_LOCAL_NED": 10,
        "RC_CHANNELS": 20,
        "SCALED_PRESSURE": 1,
        "SERVO_OUTPUT_RAW": 10,
        "SYSTEM_TIME": 1,
        "SYS_STATUS": 5,
        "TIMESYNC": 10,
        "TIME_ESTIMATE_TO_TARGET": 0.5,
        "VFR_HUD": 10,
        "VIBRATION": 0.5,
    },
)

GROUND = _profile(
    "ground",
    {
        "HEARTBEAT": 1,
        "ALTITUDE": 1,
        "ATTITUDE": 50,
        "ATTITUDE_QUATERNION": 50,
        "ATTITUDE_TARGET": 50,
        "BATTERY_STATUS": 0.5,
        "CURRENT_MODE": 0.5,
        "DISTANCE_SENSOR": 0.5,
        "ESTIMATOR_STATUS": 0.5,
        "EXTENDED_SYS_STATE": 1,
        "GLOBAL_POSITION_INT": 50,
        "GNSS_INTEGRITY": 1,
        "GPS_RAW_INT": 5,
        "HOME_POSITION": 0.5,
        "LINK_NODE_STATUS": 1,
        "LOCAL_POSITION_NED": 50,
        "MISSION_CURRENT": 1,
        "OPEN_DRONE_ID_LOCATION": 1,
        "OPEN_DRONE_ID_SYSTEM": 1,
        "PING": 0.1,
        "POSITION_TARGET_GLOBAL_INT": 1,
        "POSITION_TARGET_LOCAL_NED": 50,
        "RC_CHANNELS": 20,
        "SCALED_PRESSURE": 1,
        "SERVO_OUTPUT_RAW": 50,
        "SYS_STATUS": 1,
        "TIME_ESTIMATE_TO_TARGET": 0.5,
        "VFR_HUD": 4,
        "VIBRATION": 0.1,
    },
)


NORMAL = _profile(  # PX4's name for what it sends on a telemetry radio
    "normal",
    {
        "HEARTBEAT": 1,
        "ALTITUDE": 1,
        "ATTITUDE": 15,
        "ATTITUDE_QUATERNION": 10,
        "ATTITUDE_TARGET": 2,
        "BATTERY_STATUS": 0.5,
        "CURRENT_MODE": 0.5,
        "DISTANCE_SENSOR": 0.5,
        "ESTIMATOR_STATUS": 0.5,
        "EXTENDED_SYS_STATE": 1,
        "GLOBAL_POSITION_INT": 5,
        "GNSS_INTEGRITY": 1,
        "GPS_RAW_INT": 5,
        "HOME_POSITION": 0.5,
        "LINK_NODE_STATUS": 1,
        "LOCAL_POSITION_NED": 1,
        "MISSION_CURRENT": 1,
        "OPEN_DRONE_ID_LOCATION": 1,
        "OPEN_DRONE_ID_SYSTEM": 1,
        "PING": 0.1,
        "POSITION_TARGET_GLOBAL_INT": 1,
        "POSITION_TARGET_LOCAL_NED": 1.5,
        "RC_CHANNELS": 5,
        "SCALED_PRESSURE": 1,
        "SERVO_OUTPUT_RAW": 1,
        "SYS_STATUS": 1,
        "TIME_ESTIMATE_TO_TARGET": 0.5,
        "VFR_HUD": 4,
        "VIBRATION": 0.1,
    },
)
