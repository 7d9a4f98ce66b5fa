"""COMMAND_LONG and COMMAND_INT: one table from command to handler, and one COMMAND_ACK with the result.

Different from PX4: DO_SET_MODE has no early ACCEPTED, and every unknown command is UNSUPPORTED.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from math import nan

from firmware_py.mavlink.service import CommandHandler, Handler, Service, VehicleCommand
from firmware_py.status import CommandResult
from framerunner.wire.dialect import BROADCAST, Message, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

_TO_EVERYONE = (
    mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION,
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
)


class CommandService(Service):
    """Passes one component's commands to their handlers and acknowledges them.

    Args:
        component_id: of the component.
        table: of all its services, by MAV_CMD.
        owner: the component that answers a command to all components.
    """

    def __init__(
        self,
        exchange: Exchange,
        component_id: int,
        table: Mapping[int, CommandHandler],
        owner: Callable[[int], int],
    ) -> None:
        self._exchange = exchange
        self.component_id = component_id
        self._table = table
        self._owner = owner
        handlers: dict[int, Handler] = {
            mavlink.MAVLINK_MSG_ID_COMMAND_LONG: partial(self._receive, VehicleCommand.from_long),
            mavlink.MAVLINK_MSG_ID_COMMAND_INT: partial(self._receive, VehicleCommand.from_int),
        }
        if mavlink.MAV_CMD_DO_SET_MODE in table:
            handlers[mavlink.MAVLINK_MSG_ID_SET_MODE] = self._receive_set_mode
        self.handlers = handlers

    def _receive(self, read: Callable[[Link, Message], VehicleCommand], link: Link, message: Message) -> None:
        """Execute a command, unless it is for another target."""
        number = message.command
        or_everyone = number in _TO_EVERYONE and number in self._table
        if not self._exchange.is_for_us(message, or_everyone=or_everyone, component_id=self.component_id):
            return
        if message.target_component != BROADCAST or self._owner(number) == self.component_id:
            self._run(number, read(link, message))

    def _receive_set_mode(self, link: Link, message: Message) -> None:
        """The legacy SET_MODE, which QGroundControl uses; acknowledged as DO_SET_MODE, as PX4 does."""
        if message.target_system != self._exchange.system_id:
            return
        main, sub = message.custom_mode >> 16 & 0xFF, message.custom_mode >> 24 & 0xFF
        if message.custom_mode & 0xFFFF:
            main = 0  # reserved bits are set, so this is no custom mode of PX4's
        params = (float(message.base_mode), float(main), float(sub), nan)
        sender = (message.get_srcSystem(), message.get_srcComponent())
        self._run(mavlink.MAV_CMD_DO_SET_MODE, VehicleCommand(link, params, sender=sender))

    def _run(self, number: int, command: VehicleCommand) -> None:
        handler = self._table.get(number)
        result = CommandResult.UNSUPPORTED if handler is None else handler(command)
        if result is not None:
            acknowledgement = mavlink.MAVLink_command_ack_message(number, int(result), 0, 0, *command.sender)
            self._exchange.send(command.link, acknowledgement, self.component_id)
