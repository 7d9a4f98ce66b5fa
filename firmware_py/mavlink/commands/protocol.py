"""COMMAND_LONG and COMMAND_INT: one table from command to handler, one true COMMAND_ACK each.

Differences from PX4, on purpose:

* DO_SET_MODE gets one acknowledgement, the true one (PX4 sends an early ACCEPTED before it). A mode that does
  not exist here is TEMPORARILY_REJECTED with the reason as text, also where PX4 accepts and does nothing.
* Every unknown command is UNSUPPORTED; PX4 is silent to a few (gimbal and camera).
"""

from __future__ import annotations

from collections.abc import Mapping
from math import nan

from firmware_py.mavlink.service import Command, CommandHandler, Service
from firmware_py.status import CommandResult
from wire.dialect import BROADCAST, Message, mavlink
from wire.exchange import Exchange
from wire.link import Link

_TO_EVERYONE = (
    mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION,
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
)


class CommandService(Service):
    """Takes commands to their handlers and acknowledges them.

    Args:
        exchange: of the vehicle.
        table: of all the autopilot's services, by MAV_CMD.
        reserved: commands that another component answers when they are sent to all components.
    """

    def __init__(
        self, exchange: Exchange, table: Mapping[int, CommandHandler], reserved: frozenset[int]
    ) -> None:
        self._exchange = exchange
        self._table = table
        self._reserved = reserved
        self.handlers = {
            mavlink.MAVLINK_MSG_ID_COMMAND_LONG: self._receive_long,
            mavlink.MAVLINK_MSG_ID_COMMAND_INT: self._receive_int,
            mavlink.MAVLINK_MSG_ID_SET_MODE: self._receive_set_mode,
        }

    def _receive_long(self, link: Link, message: Message) -> None:
        self._receive(message, Command.from_long(link, message))

    def _receive_int(self, link: Link, message: Message) -> None:
        self._receive(message, Command.from_int(link, message))

    def _receive(self, message: Message, command: Command) -> None:
        """Run a command; one with a wrong target is ignored."""
        number = message.command
        if not self._exchange.is_for_us(message, or_everyone=number in _TO_EVERYONE):
            return
        if message.target_component != BROADCAST or number not in self._reserved:
            self._run(message, number, command)

    def _receive_set_mode(self, link: Link, message: Message) -> None:
        """The legacy SET_MODE, which QGroundControl uses; acknowledged as DO_SET_MODE, as PX4 does."""
        if message.target_system != self._exchange.system_id:
            return
        main, sub = message.custom_mode >> 16 & 0xFF, message.custom_mode >> 24 & 0xFF
        if message.custom_mode & 0xFFFF:
            main = 0  # reserved bits are set, so this is no custom mode of PX4's
        command = Command(link, (float(message.base_mode), float(main), float(sub), nan))
        self._run(message, mavlink.MAV_CMD_DO_SET_MODE, command)

    def _run(self, message: Message, number: int, command: Command) -> None:
        handler = self._table.get(number)
        result = CommandResult.UNSUPPORTED if handler is None else handler(command)
        if result is None:
            return
        acknowledgement = mavlink.MAVLink_command_ack_message(
            number, int(result), 0, 0, message.get_srcSystem(), message.get_srcComponent()
        )
        self._exchange.send(command.link, acknowledgement)
