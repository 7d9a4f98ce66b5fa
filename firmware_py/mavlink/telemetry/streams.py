"""Streams and requests: what is due on each link, REQUEST_MESSAGE and its relatives.

PX4 has streams that are silent without a device that is missing here. Their intervals can be set here too,
with PX4's answer and PX4's silence. Difference from PX4: CURRENT_MODE, which PX4 denies on request, is sent.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from math import isfinite, nan

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import CommandHandler, Reply, Service, Source, VehicleCommand
from firmware_py.status import CommandResult
from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, Message, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.framing import Packet
from framerunner.wire.link import Link

AutopilotSource = Callable[[Autopilot], Message | None]
"""Makes a message from the autopilot's state; None: it has no content yet."""

_REPEATS_A_SECOND = 10
_MAX_MESSAGE_ID = 0xFFFFFF
_MAX_INTERVAL_US = 0x7FFFFFFF
_LINK_NODE_STATUS = mavlink.MAVLINK_MSG_ID_LINK_NODE_STATUS  # the one message that differs from link to link
_SILENT = """
    ADSB_VEHICLE CAMERA_TRIGGER COLLISION DEBUG DEBUG_FLOAT_ARRAY DEBUG_VECT EFI_STATUS
    GIMBAL_DEVICE_ATTITUDE_STATUS GIMBAL_DEVICE_INFORMATION GIMBAL_DEVICE_SET_ATTITUDE
    GIMBAL_MANAGER_INFORMATION GIMBAL_MANAGER_STATUS GPS2_RAW GPS_STATUS HYGROMETER_SENSOR
    LANDING_TARGET MAG_CAL_REPORT MANUAL_CONTROL MOUNT_ORIENTATION NAMED_VALUE_FLOAT
    NAV_CONTROLLER_OUTPUT OBSTACLE_DISTANCE OPEN_DRONE_ID_ARM_STATUS
    ORBIT_EXECUTION_STATUS RAW_RPM RC_CHANNELS SCALED_IMU2 SCALED_IMU3 SCALED_PRESSURE2
    SCALED_PRESSURE3
"""


_OLDER_REQUESTS = {
    mavlink.MAV_CMD_GET_HOME_POSITION: (mavlink.MAVLINK_MSG_ID_HOME_POSITION, 0),
    mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION: (mavlink.MAVLINK_MSG_ID_PROTOCOL_VERSION, 0),
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: (mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION, 0),
}


class AutopilotTelemetry(Service):
    """Offers the messages that functions make from the autopilot's state."""

    def __init__(self, autopilot: Autopilot, sources: Mapping[int, AutopilotSource]) -> None:
        self.sources = {message_id: partial(make, autopilot) for message_id, make in sources.items()}


class RequestService(Service):
    """Answers REQUEST_MESSAGE, and the older commands that request one message, for one component.

    Args:
        component_id: of the component.
        replies: what can be requested, by message id.
        older: by MAV_CMD: the message, and which of the command's parameters is its index (0: none).
    """

    def __init__(
        self,
        exchange: Exchange,
        component_id: int,
        replies: Mapping[int, Reply],
        older: Mapping[int, tuple[int, int]],
    ) -> None:
        self._exchange = exchange
        self.component_id = component_id
        self._replies = replies
        self.commands: Mapping[int, CommandHandler] = {
            mavlink.MAV_CMD_REQUEST_MESSAGE: lambda command: self._request(command.link, *command.params[:2]),
            **{number: partial(self._request_older, *request) for number, request in older.items()},
        }

    def _request_older(self, message_id: int, index_param: int, command: VehicleCommand) -> CommandResult:
        argument = command.all_params[index_param - 1] if index_param else nan
        return self._request(command.link, message_id, argument)

    def _request(self, link: Link, message_id: float, argument: float) -> CommandResult:
        """Send a message on a link; any number that is no message of ours is denied."""
        requested = _message_id(message_id)
        messages = [] if requested is None else self._requested(link, requested, _message_id(argument) or 0)
        for message in messages:
            self._exchange.send(link, message, self.component_id)
        return CommandResult.ACCEPTED if messages else CommandResult.DENIED

    def _requested(self, link: Link, message_id: int, argument: int) -> list[Message]:
        reply = self._replies.get(message_id)
        return [] if reply is None else reply(link, argument)


class StreamService(RequestService):
    """Sends the streams that are due on each link, and what is requested of the autopilot."""

    def __init__(
        self, exchange: Exchange, sources: Mapping[int, Source], replies: Mapping[int, Reply]
    ) -> None:
        super().__init__(exchange, AUTOPILOT_COMPONENT_ID, replies, _OLDER_REQUESTS)
        self._sources = sources
        self._repeats = 0
        silent = (getattr(mavlink, f"MAVLINK_MSG_ID_{name}") for name in _SILENT.split())
        self._streamable = frozenset({*sources, _LINK_NODE_STATUS, *silent})
        self.commands = {
            **self.commands,
            mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_interval,
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
        }

    def update(self) -> None:
        """Send what is due on each link; a message for several links is made once."""
        time_us = self._exchange.time_us
        packets: dict[int, Packet | None] = {}
        for link in self._exchange.links.values():
            for message_id in link.due(time_us):
                if message_id not in packets or message_id == _LINK_NODE_STATUS:
                    packets[message_id] = self._packet(message_id, link)
                packet = packets[message_id]
                if packet is not None:
                    link.send_stream(packet)
                    link.schedule.keep(message_id, packet)

    def repeat(self) -> None:
        """Send all streams again; those on the grid of requested ones as they were there.

        Where somebody has answered, heartbeats keep to one a second: others take them for a clock.
        """
        beat = self._repeats % _REPEATS_A_SECOND == 0
        self._repeats += 1
        for link in self._exchange.links.values():
            answered = link.traffic.messages_received > 0
            for message_id, latest in link.schedule.again():
                if message_id == mavlink.MAVLINK_MSG_ID_HEARTBEAT and answered and not beat:
                    continue
                packet = latest or self._packet(message_id, link)
                if packet is not None:
                    link.send_stream(packet)

    def _packet(self, message_id: int, link: Link) -> Packet | None:
        message = self._message(message_id, link)
        return None if message is None else self._exchange.packet(message)

    def _message(self, message_id: int, link: Link) -> Message | None:
        """The message as it is now; None when it does not exist or has no content yet."""
        source = self._sources.get(message_id)
        if source is not None:
            return source()
        return link.node_status(self._exchange.time_us) if message_id == _LINK_NODE_STATUS else None

    def _requested(self, link: Link, message_id: int, argument: int) -> list[Message]:
        if message_id in self._replies:
            return super()._requested(link, message_id, argument)
        if message_id == mavlink.MAVLINK_MSG_ID_MESSAGE_INTERVAL:
            return [self._interval(link, argument)]
        message = self._message(message_id, link)
        return [] if message is None else [message]

    def _get_interval(self, command: VehicleCommand) -> CommandResult:
        return self._request(command.link, mavlink.MAVLINK_MSG_ID_MESSAGE_INTERVAL, command.params[0])

    def _set_interval(self, command: VehicleCommand) -> CommandResult:
        """0: default, -1: off. HEARTBEAT and unknown messages fail, as in PX4."""
        message_id, interval_us = _message_id(command.params[0]), command.params[1]
        if message_id is None or message_id not in self._streamable:
            return CommandResult.FAILED
        if message_id == mavlink.MAVLINK_MSG_ID_HEARTBEAT or not isfinite(interval_us):
            return CommandResult.FAILED
        kept_us = -1 if interval_us < 0 else min(round(interval_us), _MAX_INTERVAL_US)
        command.link.schedule.set_interval(message_id, kept_us, self._exchange.time_us)
        return CommandResult.ACCEPTED

    def _interval(self, link: Link, message_id: int) -> Message:
        """MESSAGE_INTERVAL: 0 for a message that does not exist, -1 for one that is off."""
        interval_us = link.schedule.interval_us(message_id) if message_id in self._streamable else 0
        return mavlink.MAVLink_message_interval_message(message_id & 0xFFFF, interval_us)


def _message_id(number: float) -> int | None:
    if not isfinite(number) or number % 1 or not 0 <= number <= _MAX_MESSAGE_ID:
        return None
    return int(number)
