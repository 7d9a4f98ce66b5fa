"""ArduPilot's own messages and values, beyond those that it shares with PX4.

The messages are loaded only when an ArduPilot is there: pymavlink's dialect of it takes a third of a second
to import.
"""

from __future__ import annotations

from importlib import import_module

from framerunner.wire.dialect import Message, mavlink

EKF_STATUS_REPORT_ID = 193
EKF_ATTITUDE, EKF_POS_HORIZ_REL, EKF_POS_HORIZ_ABS, EKF_POS_VERT_ABS, EKF_CONST_POS_MODE = 1, 8, 16, 32, 128
"""EKF_STATUS_FLAGS of EKF_STATUS_REPORT, by MAVLink's names."""
EXTERNAL_NAVIGATION = 6
"""Value of EK3_SRC1_POSXY and the other sources of its estimator, such as for poses of a motion capture."""
POSE_ARRIVAL_EARLY_MS = 12
"""ArduPilot counts a pose as so much older than it is on arrival (measured)."""


def has_position(report: Message) -> bool:
    """Whether the estimator that sends this EKF_STATUS_REPORT knows its horizontal position."""
    known = report.flags & (EKF_POS_HORIZ_REL | EKF_POS_HORIZ_ABS)
    return bool(known) and not report.flags & EKF_CONST_POS_MODE


def add_ardupilot_messages() -> None:
    """Let all readers decode EKF_STATUS_REPORT from now on."""
    if EKF_STATUS_REPORT_ID not in mavlink.mavlink_map:
        ardupilotmega = import_module("pymavlink.dialects.v20.ardupilotmega")
        mavlink.mavlink_map[EKF_STATUS_REPORT_ID] = ardupilotmega.MAVLink_ekf_status_report_message
