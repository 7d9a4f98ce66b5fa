"""COMPONENT_METADATA and the older COMPONENT_INFORMATION: where the files are that explain this vehicle."""

from __future__ import annotations

from firmware_py.mavlink.component_metadata import GENERAL_FILE, extras, file_crc
from firmware_py.mavlink.port import AutopilotPort
from firmware_py.mavlink.scaling import boot_ms
from wire.dialect import Message, mavlink

MESSAGE_IDS = (mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA, mavlink.MAVLINK_MSG_ID_COMPONENT_INFORMATION)
"""What `component_message` can make."""

_URI = f"mftp://{GENERAL_FILE}".encode()


def component_message(autopilot: AutopilotPort, message_id: int, time_us: int) -> Message:
    """One of `MESSAGE_IDS`. The files are made for the first one, which takes some hundredths of a second.

    Args:
        autopilot: whose parameters are explained.
        message_id: which.
        time_us: vehicle time.
    """
    crc = file_crc(extras(autopilot.parameters)[GENERAL_FILE])
    if message_id == mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA:
        return mavlink.MAVLink_component_metadata_message(boot_ms(time_us), crc, _URI)
    return mavlink.MAVLink_component_information_message(boot_ms(time_us), crc, _URI, 0, b"")
