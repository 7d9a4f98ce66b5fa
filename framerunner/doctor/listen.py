"""What a drone reports: listen to it, request what it does not send by itself, and record the answers.

Nothing here changes the drone: messages are requested and parameters read. ArduPilot sends no streams by
itself, so they are requested of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

from framerunner.wire.ardupilot_messages import EKF_STATUS_REPORT_ID, add_ardupilot_messages
from framerunner.wire.dialect import (
    AUTOPILOT_COMPONENT_ID,
    Message,
    command_long,
    mavlink,
    message_name,
    request_message,
    request_parameter,
    request_rate,
)
from framerunner.wire.session.client import VehicleClient
from framerunner.wire.session.record import Record

SYSTEM_ID = 247
COMPONENT_ID = 190
_ASK_AGAIN_S = 1.0
_REQUEST_GAP_S = 0.02  # so that requests do not fill a serial line
_PREARM_S = 0.5
_PREARM_AGAIN_S = 2.0  # until a report of the arming checks is received
PARAMETERS = (
    *("BAT_CRIT_THR", "BAT_LOW_THR"),
    *("COM_DISARM_LAND", "COM_DISARM_PRFLT", "COM_LOW_BAT_ACT", "COM_OBL_RC_ACT", "COM_OF_LOSS_T"),
    *("COM_RCL_EXCEPT", "COM_RC_IN_MODE"),
    *("EKF2_DELAY_MAX", "EKF2_EVP_NOISE", "EKF2_EVV_NOISE", "EKF2_EV_CTRL", "EKF2_GPS_CTRL"),
    *("EKF2_HGT_REF", "EKF2_RNG_CTRL", "EKF2_TAU_POS", "EKF2_TAU_VEL"),
    *("GF_ACTION", "GF_MAX_HOR_DIST", "GF_MAX_VER_DIST"),
    *("MC_YAWRATE_MAX", "MPC_THR_HOVER", "MPC_TKO_RAMP_T", "MPC_XY_VEL_I_ACC", "MPC_XY_VEL_MAX"),
    *("MPC_XY_VEL_P_ACC", "MPC_Z_VEL_MAX_DN", "MPC_Z_VEL_MAX_UP"),
    *("NAV_DLL_ACT", "NAV_RCL_ACT", "RTL_RETURN_ALT"),
)
_ARDUPILOT_ONCE = (
    mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION,
    mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN,
)
_ONCE = (
    *_ARDUPILOT_ONCE,
    mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS,
    mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES,
)
ARDUPILOT_PARAMETERS = (
    *("BATT_FS_LOW_ACT", "BATT_MONITOR", "DISARM_DELAY"),
    *("EK3_SRC1_POSXY", "EK3_SRC1_POSZ", "EK3_SRC1_VELXY", "EK3_SRC1_YAW", "VISO_TYPE"),
    *("FENCE_ACTION", "FENCE_ALT_MAX", "FENCE_ENABLE", "FENCE_RADIUS"),
    *("FS_EKF_ACTION", "FS_GCS_ENABLE", "FS_THR_ENABLE"),
    *("GUID_OPTIONS", "GUID_TIMEOUT", "LAND_SPEED", "RTL_ALT"),
    *("WPNAV_ACCEL", "WPNAV_SPEED", "WPNAV_SPEED_DN", "WPNAV_SPEED_UP"),
)
_ARDUPILOT_STREAMS_HZ = {  # it sends none by itself; these are requested for this link until its next start
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 50.0,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 50.0,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: 2.0,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 2.0,
    mavlink.MAVLINK_MSG_ID_GPS_RAW_INT: 2.0,
    EKF_STATUS_REPORT_ID: 2.0,
}


def listen(client: VehicleClient, seconds: float) -> None:
    """Receive and request, for some seconds of wall time."""
    record, link = client.session, client.link
    began_s = request_s = client.clock()
    requested_s = -10.0
    prearm_s = began_s + _PREARM_S
    requests = open_requests(record)
    identify_s = began_s + seconds / 2  # all senders are heard by then
    while (now_s := client.clock()) - began_s < seconds:
        client.progress("listening and requesting", (now_s - began_s) / seconds)
        if now_s >= identify_s:
            identify_s = inf
            link.send_to_all(request_message(record.vehicle, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION))
        if now_s > prearm_s and not record.armed and record.arming.armable_modes is None:
            prearm_s = now_s + _PREARM_AGAIN_S
            record.send(command_long(record.vehicle, mavlink.MAV_CMD_RUN_PREARM_CHECKS))
        if now_s - request_s >= _REQUEST_GAP_S:
            request_s = now_s
            request = next(requests, None)
            if request is not None:
                requested_s = now_s
                record.send(request)
            elif now_s - requested_s >= _ASK_AGAIN_S:
                requests = open_requests(record)
        client.turn()
    record.listened_s = client.clock()
    record.senders.addresses = link.addresses(record.vehicle, AUTOPILOT_COMPONENT_ID)


def open_requests(record: Record) -> Iterator[Message]:
    """The requests that have not been answered yet."""
    system_id = record.vehicle
    if record.is_ardupilot:
        add_ardupilot_messages()
        for number, rate_hz in _ARDUPILOT_STREAMS_HZ.items():
            if message_name(number) not in record.latest:
                yield request_rate(system_id, number, rate_hz)
    for number in _ARDUPILOT_ONCE if record.is_ardupilot else _ONCE:
        if message_name(number) not in record.latest:
            yield request_message(system_id, number)
    for name in ARDUPILOT_PARAMETERS if record.is_ardupilot else PARAMETERS:
        if name not in record.parameters:
            yield request_parameter(system_id, name)
