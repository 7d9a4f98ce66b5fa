"""Messages to one vehicle through MAVSDK's plugin `mavlink_direct`, which sends each once, at once."""

from __future__ import annotations

import json
from typing import Any

from mavsdk.asyncio import MavsdkError
from mavsdk.plugins.mavlink_direct import MavlinkMessage

from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, mavlink
from offboard.drone import VelocityCommand
from offboard.link.commands import synchronous

_VELOCITY_AND_YAW_RATE = (
    mavlink.POSITION_TARGET_TYPEMASK_X_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_Y_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_Z_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_AX_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_AY_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_AZ_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_YAW_IGNORE
)


class CommandRefusedError(MavsdkError):  # type: ignore[misc]  # MAVSDK is untyped
    """The vehicle answered a command, but not with "accepted"; the message is the MAV_RESULT's name."""

    @classmethod
    def of(cls, result: int | None) -> CommandRefusedError:
        """By the number in COMMAND_ACK."""
        known = mavlink.enums["MAV_RESULT"].get(result)
        return cls(f"result {result}" if known is None else known.name.removeprefix("MAV_RESULT_"))


class DirectMessages:
    """Sends messages to an autopilot; from any thread.

    Args:
        direct: MAVSDK's asyncio plugin.
        system_id: the vehicle's.
    """

    def __init__(self, direct: Any, system_id: int) -> None:  # noqa: ANN401 - MAVSDK is untyped
        self._direct = synchronous(direct)
        self._system_id = system_id

    def send(self, name: str, fields: dict[str, float]) -> None:
        """Send a message to the autopilot."""
        self._direct.send_message(self._message(name, fields))

    def send_velocity(self, command: VelocityCommand) -> None:
        """Send a velocity and a yaw rate in body axes."""
        self.send("SET_POSITION_TARGET_LOCAL_NED", _velocity_target(command))

    def send_ping(self, sequence: int) -> None:
        """Send a PING, which the vehicle returns."""
        fields = {"time_usec": 0, "seq": sequence, "target_system": 0, "target_component": 0}
        self._direct.send_message(MavlinkMessage("PING", 0, 0, 0, 0, json.dumps(fields)))

    def send_command(self, number: int, *parameters: float) -> None:
        """Send a MAV_CMD without waiting for its answer."""
        self.send("COMMAND_LONG", _command_fields(number, *parameters))

    def command(self, number: int, *parameters: float) -> None:
        """Send a MAV_CMD and wait for its answer, which blocks. Raises `CommandRefusedError`."""
        message = self._message("COMMAND_LONG", _command_fields(number, *parameters))
        result = json.loads(self._direct.send_command(message).fields_json).get("result")
        if result != mavlink.MAV_RESULT_ACCEPTED:
            raise CommandRefusedError.of(result)

    def _message(self, name: str, fields: dict[str, float]) -> MavlinkMessage:
        target = {"target_system": self._system_id, "target_component": AUTOPILOT_COMPONENT_ID}
        return MavlinkMessage(
            name, 0, 0, self._system_id, AUTOPILOT_COMPONENT_ID, json.dumps({**target, **fields})
        )


def _command_fields(number: int, *parameters: float) -> dict[str, float]:
    filled = (*parameters, *([0.0] * (7 - len(parameters))))
    values = {f"param{index}": value for index, value in enumerate(filled, start=1)}
    return {"command": number, "confirmation": 0, **values}


def _velocity_target(command: VelocityCommand) -> dict[str, float]:
    """The fields of SET_POSITION_TARGET_LOCAL_NED for a velocity and a yaw rate in body axes."""
    zeros = dict.fromkeys(("x", "y", "z", "afx", "afy", "afz", "yaw"), 0.0)
    return {
        **zeros,
        "time_boot_ms": 0,
        "coordinate_frame": mavlink.MAV_FRAME_BODY_NED,
        "type_mask": _VELOCITY_AND_YAW_RATE,
        "vx": command.forward_m_s,
        "vy": -command.left_m_s,
        "vz": -command.up_m_s,
        "yaw_rate": -command.yaw_rate_rad_s,
    }
