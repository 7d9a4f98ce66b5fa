"""COMMAND_LONG and COMMAND_INT: one table from command to handler, one true COMMAND_ACK each.

Differences from PX4, on purpose:

* DO_SET_MODE gets one acknowledgement, the true one (PX4 sends an early ACCEPTED before it). A mode that does
  not exist here is TEMPORARILY_REJECTED with the reason as text, also where PX4 accepts and does nothing.
* Every unknown command is UNSUPPORTED; PX4 is silent to a few (gimbal and camera).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import floor, isfinite, isinf, isnan, nan

from firmware_py.mavlink import version
from firmware_py.mavlink.dialect import BROADCAST, Message, mavlink
from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.message_requests import request_message, set_interval
from firmware_py.status import CommandResult, FlightMode

FORCE_MAGIC = 21196.0  # param2 of COMPONENT_ARM_DISARM
_RELATIVE_FRAMES = (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)
_TO_EVERYONE = (
    mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION,
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
)
_STANDARD_MODES = {
    mavlink.MAV_STANDARD_MODE_LAND: FlightMode.LAND,
    mavlink.MAV_STANDARD_MODE_TAKEOFF: FlightMode.TAKEOFF,
}
_MODES = {mode.value: mode for mode in FlightMode}
_WARNING = mavlink.MAV_SEVERITY_WARNING
_CRITICAL = mavlink.MAV_SEVERITY_CRITICAL


@dataclass(frozen=True, slots=True)
class Command:
    """A command, whichever message brought it.

    Attributes:
        link: it came by.
        param1: NaN means "not given", as in the others.
        altitude_m: param7 or z; above mean sea level unless the frame says above home.
        frame: MAV_FRAME of COMMAND_INT.
    """

    link: Link
    param1: float
    param2: float
    param3: float
    altitude_m: float
    frame: int = mavlink.MAV_FRAME_GLOBAL


def _arm_disarm(exchange: Exchange, command: Command) -> CommandResult | None:
    autopilot = exchange.autopilot
    if isnan(command.param1):
        return CommandResult.ACCEPTED  # PX4's odd answer: nothing happens
    action = floor(command.param1 + 0.5) if isfinite(command.param1) else -1
    force = command.param2 == FORCE_MAGIC
    if action == 1:
        return autopilot.arm(force=force)
    if action == 0:
        return autopilot.disarm(force=force)
    autopilot.say(_CRITICAL, f"Unsupported ARM_DISARM param: {command.param1:g}")
    return None  # PX4 does not acknowledge this either


def _takeoff(exchange: Exchange, command: Command) -> CommandResult:
    altitude_m = command.altitude_m
    if isinf(altitude_m):
        return CommandResult.DENIED
    if command.frame in _RELATIVE_FRAMES:
        home = exchange.autopilot.status.home
        altitude_m = altitude_m + home.altitude_m if home else nan
    return exchange.autopilot.takeoff(altitude_m)


def _land(exchange: Exchange, _command: Command) -> CommandResult:
    return exchange.autopilot.land()


def _set_mode(exchange: Exchange, command: Command) -> CommandResult:
    if not isfinite(command.param1) or not int(command.param1) & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
        exchange.autopilot.say(_WARNING, "Mode change refused: only PX4 custom modes are understood")
        return CommandResult.TEMPORARILY_REJECTED
    main, sub = _small(command.param2), _small(command.param3)
    return choose_mode(exchange, main, sub)


def choose_mode(exchange: Exchange, main: int, sub: int) -> CommandResult:
    """Ask the autopilot for the mode with PX4's numbers; a mode that is not there is refused in words."""
    mode = _MODES.get((main, sub))
    if mode is None:
        exchange.autopilot.say(_WARNING, f"Mode change refused: no mode {main}.{sub} here")
        return CommandResult.TEMPORARILY_REJECTED
    return exchange.autopilot.set_mode(mode)


def _set_standard_mode(exchange: Exchange, command: Command) -> CommandResult:
    mode = _STANDARD_MODES.get(_small(command.param1))
    if mode is None:
        exchange.autopilot.say(_WARNING, f"Mode change refused: no standard mode {command.param1:g} here")
        return CommandResult.TEMPORARILY_REJECTED
    return exchange.autopilot.set_mode(mode)


def _small(number: float) -> int:
    """A mode number; what cannot be one is 0, which is no mode."""
    return int(number) if isfinite(number) and 0 <= number <= 255 else 0


def _start_mission(_exchange: Exchange, _command: Command) -> CommandResult:
    return CommandResult.DENIED  # as PX4 without a mission; there never is one


def _run_checks(exchange: Exchange, _command: Command) -> CommandResult:
    armed = exchange.autopilot.status.armed
    return CommandResult.TEMPORARILY_REJECTED if armed else CommandResult.ACCEPTED  # they run all the time


def _request(exchange: Exchange, command: Command) -> CommandResult:
    return request_message(exchange, command.link, command.param1, command.param2)


def _requester(message_id: int) -> CommandHandler:
    def request(exchange: Exchange, command: Command) -> CommandResult:
        return request_message(exchange, command.link, message_id, nan)

    return request


def _set_interval(exchange: Exchange, command: Command) -> CommandResult:
    return set_interval(command.link, command.param1, command.param2, exchange.time_us)


def _get_interval(exchange: Exchange, command: Command) -> CommandResult:
    return request_message(exchange, command.link, mavlink.MAVLINK_MSG_ID_MESSAGE_INTERVAL, command.param1)


CommandHandler = Callable[[Exchange, Command], "CommandResult | None"]

COMMANDS: dict[int, CommandHandler] = {
    mavlink.MAV_CMD_NAV_LAND: _land,
    mavlink.MAV_CMD_NAV_TAKEOFF: _takeoff,
    mavlink.MAV_CMD_DO_SET_MODE: _set_mode,
    mavlink.MAV_CMD_DO_SET_STANDARD_MODE: _set_standard_mode,
    mavlink.MAV_CMD_MISSION_START: _start_mission,
    mavlink.MAV_CMD_COMPONENT_ARM_DISARM: _arm_disarm,
    mavlink.MAV_CMD_RUN_PREARM_CHECKS: _run_checks,
    mavlink.MAV_CMD_GET_HOME_POSITION: _requester(mavlink.MAVLINK_MSG_ID_HOME_POSITION),
    mavlink.MAV_CMD_GET_MESSAGE_INTERVAL: _get_interval,
    mavlink.MAV_CMD_SET_MESSAGE_INTERVAL: _set_interval,
    mavlink.MAV_CMD_REQUEST_MESSAGE: _request,
    mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION: _requester(version.ProtocolVersionMessage.id),
    mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: _requester(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION),
}


def _receive_long(exchange: Exchange, link: Link, message: Message) -> None:
    command = Command(link, message.param1, message.param2, message.param3, message.param7)
    _run(exchange, message, command)


def _receive_int(exchange: Exchange, link: Link, message: Message) -> None:
    command = Command(link, message.param1, message.param2, message.param3, message.z, message.frame)
    _run(exchange, message, command)


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
    command = Command(link, float(message.base_mode), float(main), float(sub), nan)
    result = _set_mode(exchange, command)
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
