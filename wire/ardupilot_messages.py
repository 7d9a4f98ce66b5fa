"""ArduPilot's own messages, beyond those that it shares with PX4; loaded only when one is there.

pymavlink's dialect of ArduPilot takes a third of a second to import.
"""

from __future__ import annotations

from importlib import import_module

from wire.dialect import mavlink

EKF_STATUS_REPORT_ID = 193
POSE_ARRIVAL_EARLY_MS = 12
"""ArduPilot counts a pose as so much older than it is on arrival (measured)."""


def add_ardupilot_messages() -> None:
    """Let all readers decode EKF_STATUS_REPORT from now on."""
    if EKF_STATUS_REPORT_ID not in mavlink.mavlink_map:
        ardupilotmega = import_module("pymavlink.dialects.v20.ardupilotmega")
        mavlink.mavlink_map[EKF_STATUS_REPORT_ID] = ardupilotmega.MAVLink_ekf_status_report_message
