"""The visit: find the drone, listen, ask, for some seconds of wall time.

Nothing here changes the drone: messages are requested and parameters read.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from framerunner.doctor.record import Record
from wire.dialect import (
    AUTOPILOT_COMPONENT_ID,
    Message,
    command_long,
    companion_heartbeat,
    ground_station_heartbeat,
    mavlink,
    request_message,
)
from wire.transports.vehicle_link import VehicleLink

SYSTEM_ID = 247
COMPONENT_ID = 190
FIND_S = 10.0
_ASK_AGAIN_S = 1.0
_QUESTION_GAP_S = 0.02  # a serial line should not choke on questions
_PREARM_S = 0.5
_PREARM_AGAIN_S = 2.0  # while no report of its arming checks has come
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

Progress = Callable[[str, float], None]


def find(link: VehicleLink, record: Record, progress: Progress) -> bool:
    """Wait for a vehicle's heartbeat.

    Args:
        link: on which to listen.
        record: takes what is heard.
        progress: called with what is done and how far, 0 to 1.

    Returns:
        Whether one was found within ten seconds.
    """
    began_s = time.monotonic()
    beat_s = -1.0
    while (now_s := time.monotonic()) - began_s < FIND_S:
        if now_s - beat_s >= 1.0:
            beat_s = now_s
            link.send(companion_heartbeat())  # over udpout the vehicle does not know us before
        progress("looking for a vehicle", (now_s - began_s) / FIND_S)
        _hear(link, record)
        if record.system_id is not None:
            return True
    return False


def listen(link: VehicleLink, record: Record, seconds: float, progress: Progress) -> None:
    """Hear and ask.

    While the vehicle is disarmed this speaks as a ground station, since PX4 tells its reasons to no one
    else. To an armed one it does not: when it leaves, that would be a lost ground station to the vehicle.

    Args:
        link: to the vehicle.
        record: of it, which knows its system id.
        seconds: how long.
        progress: called with what is done and how far, 0 to 1.
    """
    began_s = time.monotonic()
    beat_s = asked_s = -10.0
    prearm_s = began_s + _PREARM_S
    questions = open_questions(record)
    question_s = began_s
    while (now_s := time.monotonic()) - began_s < seconds:
        progress("listening and asking", (now_s - began_s) / seconds)
        if now_s - beat_s >= 1.0:
            beat_s = now_s
            link.send(companion_heartbeat() if record.armed else ground_station_heartbeat())
        if now_s > prearm_s and not record.armed and record.arming.armable_modes is None:
            prearm_s = now_s + _PREARM_AGAIN_S
            link.send(prearm_question(record))
        if now_s - question_s >= _QUESTION_GAP_S:
            question_s = now_s
            question = next(questions, None)
            if question is not None:
                asked_s = now_s
                link.send(question)
            elif now_s - asked_s >= _ASK_AGAIN_S:
                questions = open_questions(record)
        _hear(link, record)


def _hear(link: VehicleLink, record: Record) -> None:
    messages = link.receive(0.02)
    now_s = time.monotonic()
    for message in messages:
        record.take(message, now_s)


def open_questions(record: Record) -> Iterator[Message]:
    """What has not been answered yet, one message after the other."""
    system_id = record.system_id
    assert system_id is not None, "the vehicle is known before it is asked"
    for name, number in _ONCE:
        if name not in record.latest:
            yield request_message(system_id, number)
    for name in PARAMETERS:
        if name not in record.parameters:
            yield mavlink.MAVLink_param_request_read_message(
                system_id, AUTOPILOT_COMPONENT_ID, name.encode(), -1
            )


def prearm_question(record: Record) -> Message:
    """Ask a disarmed drone to check itself and to say what it finds."""
    assert record.system_id is not None
    return command_long(record.system_id, mavlink.MAV_CMD_RUN_PREARM_CHECKS)
