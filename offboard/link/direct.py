"""Messages from and to one vehicle through MAVSDK's plugin `mavlink_direct`, which sends each once, at once.

They are pymavlink's here, as for all clients of vehicles; the plugin's are JSON.
"""

from __future__ import annotations

import contextlib
import json
import threading
from collections.abc import Callable
from math import nan
from typing import Any

from mavsdk.asyncio import MavsdkError
from mavsdk.plugins.mavlink_direct import MavlinkMessage

from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, Message, command_long, mavlink
from offboard.drone import VelocityFluCommand
from offboard.link.dialect import Dialect

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


def synchronous(wrapper: Any) -> Any:  # noqa: ANN401 - MAVSDK is untyped
    """The synchronous object inside one of MAVSDK's asyncio wrappers; they have no public access to it."""
    inner = getattr(wrapper, "_plugin", None)
    return wrapper._system if inner is None else inner


def subscribe(direct: Any, name: str, take: Callable[[Message], None]) -> None:  # noqa: ANN401
    """Let MAVSDK's thread call a function with each message of a name, of any component of the vehicle.

    Numbers that JSON cannot express, which are not finite, are NaN.
    """
    kind = getattr(mavlink, f"MAVLink_{name.lower()}_message")

    def receive(message: Any, _user: object) -> None:  # noqa: ANN401
        fields = json.loads(message.fields_json)
        found = kind(*(_finite(fields.get(each, 0)) for each in kind.fieldnames))
        header = found.get_header()
        header.srcSystem, header.srcComponent = message.system_id, message.component_id
        take(found)

    direct.subscribe_message(name, receive)


def _finite(value: Any) -> Any:  # noqa: ANN401
    if isinstance(value, list):
        return [_finite(each) for each in value]
    return nan if value is None else value


class DirectMessages:
    """Sends messages to an autopilot; from any thread.

    Args:
        direct: MAVSDK's asyncio plugin.
        system_id: the vehicle's.
    """

    def __init__(self, direct: Any, system_id: int) -> None:  # noqa: ANN401 - MAVSDK is untyped
        self._direct = synchronous(direct)
        self.system_id = system_id

    def send(self, message: Message) -> None:
        """Send a message."""
        self._direct.send_message(_encoded(message))

    def send_velocity(self, command: VelocityFluCommand) -> None:
        """Send a velocity and a yaw rate in body axes."""
        message = mavlink.MAVLink_set_position_target_local_ned_message(
            time_boot_ms=0,
            target_system=self.system_id,
            target_component=AUTOPILOT_COMPONENT_ID,
            coordinate_frame=mavlink.MAV_FRAME_BODY_NED,
            type_mask=_VELOCITY_AND_YAW_RATE,
            x=0.0,
            y=0.0,
            z=0.0,
            vx=command.forward_m_s,
            vy=-command.left_m_s,
            vz=-command.up_m_s,
            afx=0.0,
            afy=0.0,
            afz=0.0,
            yaw=0.0,
            yaw_rate=-command.yaw_rate_rad_s,
        )
        self.send(message)

    def send_command(self, number: int, *parameters: float) -> None:
        """Send a MAV_CMD without waiting for its answer."""
        self.send(command_long(self.system_id, number, *parameters))

    def command(self, number: int, *parameters: float) -> None:
        """Send a MAV_CMD and wait for its answer, which blocks. Raises `CommandRefusedError`."""
        message = _encoded(command_long(self.system_id, number, *parameters))
        result = json.loads(self._direct.send_command(message).fields_json).get("result")
        if result != mavlink.MAV_RESULT_ACCEPTED:
            raise CommandRefusedError.of(result)


def _encoded(message: Message) -> MavlinkMessage:
    fields = message.to_dict()
    name = fields.pop("mavpackettype")
    system_id, component_id = fields.get("target_system", 0), fields.get("target_component", 0)
    return MavlinkMessage(name, 0, 0, system_id, component_id, json.dumps(fields))


class DirectDialect(Dialect):
    """A vehicle whose velocities are sent here: each at once, and the last one again in each tick.

    Args:
        direct: MAVSDK's asyncio plugin.
        system_id: the vehicle's.
    """

    def __init__(self, direct: Any, system_id: int) -> None:  # noqa: ANN401 - MAVSDK is untyped
        self._messages = DirectMessages(direct, system_id)
        self._command: VelocityFluCommand | None = None  # the last one; None: the stream has ended
        self._sent_since_repeat = False
        self._lock = threading.Lock()  # the watchdog's thread sends, too

    def send(self, command: VelocityFluCommand) -> None:
        """Send a velocity; ignored after `end`."""
        with self._lock:
            if self.ended:
                return
            self._command, self._sent_since_repeat = command, True
            with contextlib.suppress(MavsdkError):  # the link is closed; telemetry shows that
                self._transmit(command)

    def repeat(self) -> None:
        """Send the last velocity again if nothing was sent since the last call."""
        command, sent = self._command, self._sent_since_repeat
        if command is not None and not sent:
            self.send(command)
        self._sent_since_repeat = False

    def request_hold_blocking(self) -> None:
        """End the setpoints until the next one, and request hold, from a thread that waits for the answer."""
        self._command = None
        self._messages.command(mavlink.MAV_CMD_DO_SET_MODE, *self.kind.hold)

    def request_land_blocking(self) -> None:
        """End the setpoints permanently and request landing, from a thread, which waits for the answer."""
        self.end()
        self._messages.command(mavlink.MAV_CMD_DO_SET_MODE, *self.kind.land)

    def end(self) -> None:
        """End the setpoints permanently; from any thread."""
        with self._lock:
            self.ended, self._command = True, None

    def _transmit(self, command: VelocityFluCommand) -> None:
        """Send a velocity now."""
        self._messages.send_velocity(command)
