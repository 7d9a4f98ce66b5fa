"""What the shell knows: words in, text out. Nothing here reaches further than the vehicle."""

from __future__ import annotations

from collections.abc import Callable
from fnmatch import fnmatchcase
from math import degrees

from firmware_py.mavlink.exchange import Exchange
from firmware_py.mavlink.version import FOLLOWED_PX4_VERSION, OWN_VERSION
from firmware_py.parameters import ParameterError

_HELP = """\
help                     what can be asked
ver all                  versions
status                   where the vehicle is and how it moves
commander status         arming, mode, failsafe
param show [PATTERN]     parameters, such as param show 'MPC_*'
param set NAME VALUE     change a parameter
"""


def answer(exchange: Exchange, words: list[str]) -> str:
    """The answer to a line, ending with a newline unless it is empty.

    Args:
        exchange: of the vehicle asked.
        words: of the line.
    """
    if not words:
        return ""
    command = _COMMANDS.get(words[0])
    if command is None:
        return f"{words[0]}: command not found; try help\n"
    return command(exchange, words[1:])


def _help(_exchange: Exchange, _words: list[str]) -> str:
    return _HELP


def _versions(exchange: Exchange, _words: list[str]) -> str:
    own, followed = (".".join(map(str, version)) for version in (OWN_VERSION, FOLLOWED_PX4_VERSION))
    return (
        f"HW arch: simulated {exchange.autopilot.airframe.name}\n"
        f"FW version: framerunner {own}, speaks as PX4 {followed}\n"
        f"System id: {exchange.system_id}\n"
    )


def _status(exchange: Exchange, _words: list[str]) -> str:
    state, place = exchange.autopilot.state, exchange.autopilot.global_position()
    north_m, east_m, down_m = state.position_ned_m
    speeds = " ".join(f"{speed:.2f}" for speed in state.velocity_ned_m_s)
    angles = " ".join(f"{degrees(angle):.1f}" for angle in (state.roll_rad, state.pitch_rad, state.yaw_rad))
    where = "not known" if place is None else f"{place.latitude_deg:.7f} {place.longitude_deg:.7f}"
    battery = exchange.autopilot.battery
    return (
        f"time: {state.time_us / 1e6:.3f} s\n"
        f"position NED: {north_m:.2f} {east_m:.2f} {down_m:.2f} m\n"
        f"velocity NED: {speeds} m/s\n"
        f"roll pitch yaw: {angles} deg\n"
        f"latitude longitude: {where}\n"
        f"battery: {battery.voltage_v:.2f} V, {battery.remaining * 100:.0f} %\n"
    )


def _commander(exchange: Exchange, words: list[str]) -> str:
    if words != ["status"]:
        return "usage: commander status\n"
    status = exchange.autopilot.status
    return (
        f"{'Armed' if status.armed else 'Disarmed'}\n"
        f"navigation mode: {status.mode.name.capitalize()}\n"
        f"user intended navigation mode: {status.intended_mode.name.capitalize()}\n"
        f"in failsafe: {'yes' if status.failsafe else 'no'}\n"
        f"landed: {status.landed_state.name.lower()}\n"
    )


def _parameters(exchange: Exchange, words: list[str]) -> str:
    match words:
        case ["show"]:
            return _show(exchange, "*")
        case ["show", pattern]:
            return _show(exchange, pattern.strip("'\""))
        case ["set", name, text]:
            return _set(exchange, name, text)
    return "usage: param show [PATTERN] | param set NAME VALUE\n"


def _show(exchange: Exchange, pattern: str) -> str:
    parameters = exchange.autopilot.parameters
    lines = [
        f"{'*' if parameters.value(declared.name) != declared.default else ' '} {declared.name:<16} "
        f"{parameters.value(declared.name):g} {declared.unit}".rstrip()
        for declared in parameters.declarations
        if fnmatchcase(declared.name, pattern)
    ]
    return "\n".join([*lines, f"{len(lines)} of {len(parameters)} parameters; *: not the default"]) + "\n"


def _set(exchange: Exchange, name: str, text: str) -> str:
    parameters = exchange.autopilot.parameters
    try:
        parameters.set(name, float(text))
    except ParameterError as error:
        return f"{error}\n"
    except ValueError:
        return f"{name}: {text} is not a number\n"
    return f"{name}: {parameters.value(name):g}\n"


def _reboot(_exchange: Exchange, _words: list[str]) -> str:
    return "reboot: start the simulator again instead\n"


_COMMANDS: dict[str, Callable[[Exchange, list[str]], str]] = {
    "help": _help,
    "ver": _versions,
    "status": _status,
    "commander": _commander,
    "param": _parameters,
    "reboot": _reboot,
}
