"""The camera as a MAVLink component of PX4's system, by which ground stations find its video."""

from __future__ import annotations

from collections.abc import Sequence

from firmware_py.mavlink.camera.messages import stream_information
from firmware_py.mavlink.camera.model import VideoStream
from framerunner.wire.dialect import device_heartbeat, mavlink

COMPONENT_ID = int(mavlink.MAV_COMP_ID_CAMERA)
_COMMAND = mavlink.mavlink_map[mavlink.MAVLINK_MSG_ID_COMMAND_LONG].unpacker


class CameraComponent:
    """Answers requests for its video streams, and nothing else.

    Args:
        system_id: PX4's.
        streams: of the camera.
    """

    def __init__(self, system_id: int, streams: Sequence[VideoStream]) -> None:
        self._system_id, self._streams = system_id, tuple(streams)
        self._mavlink = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=COMPONENT_ID)

    def heartbeat(self, custom_mode: int) -> bytes:
        """HEARTBEAT with the vehicle's mode."""
        message = device_heartbeat(mavlink.MAV_TYPE_CAMERA, custom_mode)
        return bytes(message.pack(self._mavlink))

    def answers(self, payload: bytes, sender: tuple[int, int]) -> list[bytes]:
        """The packets that answer a COMMAND_LONG; none if it is not for this component.

        Args:
            payload: of the command, without trailing zeros.
            sender: its system and component id.
        """
        size = _COMMAND.size
        *parameters, command, system, component, _ = _COMMAND.unpack(payload[:size].ljust(size, b"\0"))
        if system != self._system_id or component != COMPONENT_ID:
            return []
        asked = command == mavlink.MAV_CMD_REQUEST_MESSAGE
        asked &= parameters[0] == mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION
        result = mavlink.MAV_RESULT_ACCEPTED if asked else mavlink.MAV_RESULT_UNSUPPORTED
        messages = [mavlink.MAVLink_command_ack_message(command, result, 0, 0, *sender)]
        if asked:
            count = len(self._streams)
            messages += [
                stream_information(stream, number, count, running=True)
                for number, stream in enumerate(self._streams, 1)
            ]
        return [bytes(message.pack(self._mavlink)) for message in messages]
