"""ArduPilot's own messages and values, beyond those that it shares with PX4.

The messages are loaded only when an ArduPilot is there: pymavlink's dialect of it takes a third of a second
to import.
"""

from __future__ import annotations

from importlib import import_module

from framerunner.wire.dialect import mavlink

EKF_STATUS_REPORT_ID = 193
EXTERNAL_NAVIGATION = 6
"""Value of EK3_SRC1_POSXY and the other sources of its estimator, such as for poses of a motion capture."""
POSE_ARRIVAL_EARLY_MS = 12
"""ArduPilot counts a pose as so much older than it is on arrival (measured)."""


def add_ardupilot_messages() -> None:
    """Let all readers decode EKF_STATUS_REPORT from now on."""
    if EKF_STATUS_REPORT_ID not in mavlink.mavlink_map:
        ardupilotmega = import_module("pymavlink.dialects.v20.ardupilotmega")
        mavlink.mavlink_map[EKF_STATUS_REPORT_ID] = ardupilotmega.MAVLink_ekf_status_report_message
