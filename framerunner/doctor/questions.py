"""What a drone is asked. Nothing here changes it: messages are requested and parameters read."""

from __future__ import annotations

from collections.abc import Iterator

from framerunner.doctor.record import Record
from wire.dialect import Message, mavlink
from wire.transports.vehicle_link import AUTOPILOT_COMPONENT, command

PARAMETERS = (
    "BAT_CRIT_THR",
    "BAT_LOW_THR",
    "COM_DISARM_LAND",
    "COM_DISARM_PRFLT",
    "COM_LOW_BAT_ACT",
    "COM_OBL_RC_ACT",
    "COM_OF_LOSS_T",
    "COM_RCL_EXCEPT",
    "COM_RC_IN_MODE",
    "EKF2_DELAY_MAX",
    "EKF2_EVP_NOISE",
    "EKF2_EVV_NOISE",
    "EKF2_EV_CTRL",
    "EKF2_GPS_CTRL",
    "EKF2_HGT_REF",
    "EKF2_RNG_CTRL",
    "EKF2_TAU_POS",
    "EKF2_TAU_VEL",
    "GF_ACTION",
    "GF_MAX_HOR_DIST",
    "GF_MAX_VER_DIST",
    "MC_YAWRATE_MAX",
    "MPC_THR_HOVER",
    "MPC_TKO_RAMP_T",
    "MPC_XY_VEL_I_ACC",
    "MPC_XY_VEL_MAX",
    "MPC_XY_VEL_P_ACC",
    "MPC_Z_VEL_MAX_DN",
    "MPC_Z_VEL_MAX_UP",
    "NAV_DLL_ACT",
    "NAV_RCL_ACT",
    "RTL_RETURN_ALT",
)
_ONCE = (
    ("AUTOPILOT_VERSION", mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION),
    ("HOME_POSITION", mavlink.MAVLINK_MSG_ID_HOME_POSITION),
    ("GPS_GLOBAL_ORIGIN", mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN),
    ("ESTIMATOR_STATUS", mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS),
    ("AVAILABLE_MODES", mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES),
)


def open_questions(record: Record) -> Iterator[Message]:
    """What has not been answered yet, one message after the other."""
    system_id = record.system_id
    assert system_id is not None, "the vehicle is known before it is asked"
    for name, number in _ONCE:
        if name not in record.latest:
            yield command(system_id, mavlink.MAV_CMD_REQUEST_MESSAGE, number)
    for name in PARAMETERS:
        if name not in record.parameters:
            yield mavlink.MAVLink_param_request_read_message(
                system_id, AUTOPILOT_COMPONENT, name.encode(), -1
            )


def prearm_question(record: Record) -> Message:
    """Ask a disarmed drone to check itself and to say what it finds."""
    assert record.system_id is not None
    return command(record.system_id, mavlink.MAV_CMD_RUN_PREARM_CHECKS)


def station_heartbeat() -> Message:
    """PX4 says its reasons (STATUSTEXT) only where it hears a ground station."""
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE, 3
    )
