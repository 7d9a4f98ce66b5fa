"""COMMAND_LONG and COMMAND_INT: one table from command to handler, one true COMMAND_ACK each.

Differences from PX4, on purpose:

* DO_SET_MODE gets one acknowledgement, the true one (PX4 sends an early ACCEPTED before it). A mode that does
  not exist here is TEMPORARILY_REJECTED with the reason as text, also where PX4 accepts and does nothing.
* Every unknown command is UNSUPPORTED; PX4 is silent to a few (gimbal and camera).
"""

from __future__ import annotations

from math import nan

from firmware_py.mavlink.calibration import calibrate
from firmware_py.mavlink.command import Command, CommandHandler, from_int, from_long
from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.failure_injection import inject_failure
from firmware_py.mavlink.flight_commands import FLIGHT_COMMANDS, set_mode
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.message_requests import request_message, set_interval
from firmware_py.mavlink.parameter_storage import preflight_storage
from firmware_py.status import CommandResult
from wire.dialect import BROADCAST, Message, mavlink

_TO_EVERYONE = (
    mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION,
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
)


def _run_checks(exchange: Exchange, _command: Command) -> CommandResult:
    armed = exchange.autopilot.status.armed
    return CommandResult.TEMPORARILY_REJECTED if armed else CommandResult.ACCEPTED  # they run all the time


def _storage(exchange: Exchange, command: Command) -> CommandResult:
    return preflight_storage(exchange, command.params[0])


def _reboot(exchange: Exchange, command: Command) -> CommandResult:
    """A simulator is started anew by whoever started it; PX4's SITL ends."""
    if exchange.autopilot.status.armed:
        return CommandResult.DENIED
    if command.params[0] > 0:
        exchange.autopilot.say(mavlink.MAV_SEVERITY_WARNING, "No reboot here: start the simulator again")
    return CommandResult.UNSUPPORTED


def _test_actuator(exchange: Exchange, _command: Command) -> CommandResult:
    return CommandResult.DENIED if exchange.autopilot.status.armed else CommandResult.UNSUPPORTED


def _set_actuator(_exchange: Exchange, _command: Command) -> CommandResult:
    return CommandResult.ACCEPTED  # as PX4 to which no such actuator is connected


def _inject(exchange: Exchange, command: Command) -> CommandResult:
    return inject_failure(exchange, *command.params[:3])


def _request(exchange: Exchange, command: Command) -> CommandResult:
    return request_message(exchange, command.link, command.params[0], command.params[1])


def _requester(message_id: int) -> CommandHandler:
    def request(exchange: Exchange, command: Command) -> CommandResult:
        return request_message(exchange, command.link, message_id, nan)

    return request


def _set_interval(exchange: Exchange, command: Command) -> CommandResult:
    return set_interval(command.link, command.params[0], command.params[1], exchange.time_us)


def _get_interval(exchange: Exchange, command: Command) -> CommandResult:
    return request_message(exchange, command.link, mavlink.MAVLINK_MSG_ID_MESSAGE_INTERVAL, command.params[0])


COMMANDS: dict[int, CommandHandler] = {
    **FLIGHT_COMMANDS,
    mavlink.MAV_CMD_DO_SET_ACTUATOR: _set_actuator,
    mavlink.MAV_CMD_PREFLIGHT_CALIBRATION: calibrate,
    mavlink.MAV_CMD_PREFLIGHT_STORAGE: _storage,
    mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: _reboot,
    mavlink.MAV_CMD_INJECT_FAILURE: _inject,
    mavlink.MAV_CMD_ACTUATOR_TEST: _test_actuator,
    mavlink.MAV_CMD_RUN_PREARM_CHECKS: _run_checks,
    mavlink.MAV_CMD_GET_HOME_POSITION: _requester(mavlink.MAVLINK_MSG_ID_HOME_POSITION),
    mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: _get_interval,
    mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: _set_interval,
    mavlink.MAV_CMD_REQUEST_MESSAGE: _request,
    mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION: _requester(mavlink.MAVLINK_MSG_ID_PROTOCOL_VERSION),
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: _requester(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION),
}


def _receive_long(exchange: Exchange, link: Link, message: Message) -> None:
    _run(exchange, message, from_long(link, message))


def _receive_int(exchange: Exchange, link: Link, message: Message) -> None:
    _run(exchange, message, from_int(link, message))


def _run(exchange: Exchange, message: Message, command: Command) -> None:
    """Silence for a wrong target, else run it and acknowledge."""
    if not exchange.is_for_us(message, or_everyone=message.command in _TO_EVERYONE):
        return
    if message.target_component == BROADCAST and message.command in exchange.claimed:
        return
    handler = COMMANDS.get(message.command)
    result = CommandResult.UNSUPPORTED if handler is None else handler(exchange, command)
    if result is not None:
        _acknowledge(exchange, command.link, message, message.command, result)


def _receive_set_mode(exchange: Exchange, link: Link, message: Message) -> None:
    """The legacy SET_MODE, which QGroundControl uses; acknowledged as DO_SET_MODE, as PX4 does."""
    if message.target_system != exchange.system_id:
        return
    main, sub = message.custom_mode >> 16 & 0xFF, message.custom_mode >> 24 & 0xFF
    if message.custom_mode & 0xFFFF:
        main = 0  # reserved bits are set, so this is no custom mode of PX4's
    result = set_mode(exchange, float(message.base_mode), float(main), float(sub))
    _acknowledge(exchange, link, message, mavlink.MAV_CMD_DO_SET_MODE, result)


def _acknowledge(
    exchange: Exchange, link: Link, message: Message, number: int, result: CommandResult
) -> None:
    acknowledgement = mavlink.MAVLink_command_ack_message(
        number, int(result), 0, 0, message.get_srcSystem(), message.get_srcComponent()
    )
    exchange.send(link, acknowledgement)


HANDLERS: dict[int, Handler] = {
    mavlink.MAVLINK_MSG_ID_COMMAND_LONG: _receive_long,
    mavlink.MAVLINK_MSG_ID_COMMAND_INT: _receive_int,
    mavlink.MAVLINK_MSG_ID_SET_MODE: _receive_set_mode,
}
