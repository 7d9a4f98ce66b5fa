"""Numbers of MAVLink and PX4 in words, as far as a person who wants to fly cares."""

from __future__ import annotations

from wire.dialect import mavlink
from wire.px4_modes import mode_words

AUTOPILOTS = {mavlink.MAV_AUTOPILOT_PX4: "PX4", mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA: "ArduPilot"}
STATES = (
    "not ready",
    "booting",
    "calibrating",
    "standby",
    "active",
    "critical (a failsafe acts)",
    "emergency",
    "powering off",
    "terminated",
)
SENSORS = {
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO: "gyroscope",
    mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL: "accelerometer",
    mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG: "compass",
    mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE: "barometer",
    mavlink.MAV_SYS_STATUS_SENSOR_GPS: "GPS",
    mavlink.MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW: "optical flow",
    mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION: "vision position",
    mavlink.MAV_SYS_STATUS_SENSOR_LASER_POSITION: "range finder",
    mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS: "motor outputs",
    mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER: "radio control",
    mavlink.MAV_SYS_STATUS_GEOFENCE: "geofence",
    mavlink.MAV_SYS_STATUS_AHRS: "attitude estimate",
    mavlink.MAV_SYS_STATUS_LOGGING: "logging",
    mavlink.MAV_SYS_STATUS_SENSOR_BATTERY: "battery",
    mavlink.MAV_SYS_STATUS_SENSOR_PROPULSION: "propulsion",
    mavlink.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL: "position control",
    mavlink.MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL: "height control",
}
CAPABILITIES = {
    mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED: "local setpoints",
    mavlink.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET: "attitude setpoints",
    mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT: "missions",
    mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE: "geofence",
    mavlink.MAV_PROTOCOL_CAPABILITY_FTP: "files",
    mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2: "MAVLink 2",
}
# Values of PX4's parameters.
OFFBOARD_LOSS = {
    0: "position mode",
    1: "altitude mode",
    2: "stabilised mode",
    3: "return",
    4: "land",
    5: "hold",
    6: "terminate",
    7: "disarm",
}
LINK_LOSS = {0: "nothing", 1: "hold", 2: "return", 3: "land", 5: "terminate", 6: "disarm"}
LOW_BATTERY = {0: "warns", 2: "lands", 3: "returns, then lands"}
HEIGHT_SOURCE = {0: "barometer", 1: "GPS", 2: "range finder", 3: "vision"}


def mode_name(custom_mode: int, listed: dict[int, str]) -> str:
    """A PX4 flight mode inside a sentence: as the vehicle lists it, else as PX4 numbers it."""
    return listed.get(custom_mode) or mode_words(custom_mode)


def kind_name(vehicle_type: int) -> str:
    """A MAV_TYPE in words."""
    entry = mavlink.enums["MAV_TYPE"].get(vehicle_type)
    return "unknown type" if entry is None else entry.name.removeprefix("MAV_TYPE_").replace("_", " ").lower()


def version_text(number: int) -> str:
    """A flight_sw_version: three bytes and the kind of release."""
    kind = {0: " dev", 64: " alpha", 128: " beta", 192: " rc", 255: ""}.get(number & 0xFF, "")
    return f"{number >> 24}.{number >> 16 & 0xFF}.{number >> 8 & 0xFF}{kind}"
