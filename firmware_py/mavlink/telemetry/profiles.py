"""Which messages each kind of link has by itself, and how often: PX4 v1.17's rates."""

from __future__ import annotations

from types import MappingProxyType

from framerunner.wire.dialect import mavlink
from framerunner.wire.link import LinkProfile

# Hz on the onboard link (UDP 14540), the ground station link (UDP 14550) and a radio; 0: not streamed.
_RATES_HZ: dict[str, tuple[float, float, float]] = {
    "HEARTBEAT": (1, 1, 1),
    "ALTITUDE": (10, 1, 1),
    "ATTITUDE": (100, 50, 15),
    "ATTITUDE_QUATERNION": (50, 50, 10),
    "ATTITUDE_TARGET": (10, 50, 2),
    "BATTERY_STATUS": (0.5, 0.5, 0.5),
    "CURRENT_MODE": (0.5, 0.5, 0.5),
    "DISTANCE_SENSOR": (10, 0.5, 0.5),
    "ESTIMATOR_STATUS": (1, 0.5, 0.5),
    "EXTENDED_SYS_STATE": (5, 1, 1),
    "GLOBAL_POSITION_INT": (50, 50, 5),
    "GNSS_INTEGRITY": (1, 1, 1),
    "GPS_RAW_INT": (8, 5, 5),
    "HIGHRES_IMU": (50, 0, 0),
    "HOME_POSITION": (0.5, 0.5, 0.5),
    "LINK_NODE_STATUS": (1, 1, 1),
    "LOCAL_POSITION_NED": (30, 50, 1),
    "MISSION_CURRENT": (1, 1, 1),
    "ODOMETRY": (30, 0, 0),
    "OPEN_DRONE_ID_LOCATION": (1, 1, 1),
    "OPEN_DRONE_ID_SYSTEM": (1, 1, 1),
    "PING": (1, 0.1, 0.1),
    "POSITION_TARGET_GLOBAL_INT": (10, 1, 1),
    "POSITION_TARGET_LOCAL_NED": (10, 50, 1.5),
    "RC_CHANNELS": (20, 20, 5),
    "SCALED_PRESSURE": (1, 1, 1),
    "SERVO_OUTPUT_RAW": (10, 50, 1),
    "SYSTEM_TIME": (1, 0, 0),
    "SYS_STATUS": (5, 1, 1),
    "TIMESYNC": (10, 0, 0),
    "TIME_ESTIMATE_TO_TARGET": (0.5, 0.5, 0.5),
    "VFR_HUD": (10, 4, 4),
    "VIBRATION": (0.5, 0.1, 0.1),
    "WIND_COV": (1, 0.5, 0.5),
}


def _profile(name: str, column: int) -> LinkProfile:
    rates_hz = {
        int(getattr(mavlink, f"MAVLINK_MSG_ID_{message}")): rates[column]
        for message, rates in _RATES_HZ.items()
        if rates[column]
    }
    return LinkProfile(name, MappingProxyType(rates_hz))


ONBOARD = _profile("onboard", 0)
GROUND = _profile("ground", 1)
NORMAL = _profile("normal", 2)  # PX4's name for what it sends on a telemetry radio
