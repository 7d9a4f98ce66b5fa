"""SERIAL_CONTROL: a shell on the vehicle, as PX4's on device 10; off unless it is enabled.

It has a few commands, about the vehicle only: nothing of the computer that it runs on can be reached. Lines
are echoed and followed by a prompt, as in nsh. Different from PX4: input without the flag that requests an
answer is answered too, because MAVSDK 4.1 never sets it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from math import degrees

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import Service
from firmware_py.mavlink.telemetry.connection import FOLLOWED_PX4_VERSION, OWN_VERSION
from firmware_py.parameters import ParameterError
from framerunner.wire.dialect import BROADCAST, Message, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

_PROMPT = b"nsh> "
_PIECE_BYTES = 70
_PIECES = 4  # per link and update
_MAX_LINE = 200
_MAX_WAITING = 64  # lines
_MAX_SHELLS = 8
_PAYLOAD_START = 10  # of a MAVLink 2 packet
_TARGET_OFFSET = 79  # in the payload: an extension that pymavlink lacks
_HELP = """\
help                     this list
ver all                  versions
status                   where the vehicle is and how it moves
commander status         arming, mode, failsafe
param show [PATTERN]     parameters, such as param show 'MPC_*'
param set NAME VALUE     change a parameter
"""
_SHELL = mavlink.SERIAL_CONTROL_DEV_SHELL
_REPLY = mavlink.SERIAL_CONTROL_FLAG_REPLY
_RESPOND = mavlink.SERIAL_CONTROL_FLAG_RESPOND


class Console:
    """The commands of the shell, as text; they concern the vehicle only."""

    def __init__(self, autopilot: Autopilot, system_id: int) -> None:
        self._autopilot = autopilot
        self._system_id = system_id
        self._commands: dict[str, Callable[[list[str]], str]] = {
            "help": lambda _arguments: _HELP,
            "ver": self._versions,
            "status": self._status,
            "commander": self._commander,
            "param": self._parameters,
            "reboot": lambda _arguments: "reboot: start the simulator again instead\n",
        }

    def answer(self, arguments: list[str]) -> str:
        """The answer to a command and its arguments, ending with a newline unless it is empty."""
        if not arguments:
            return ""
        command = self._commands.get(arguments[0])
        if command is None:
            return f"{arguments[0]}: command not found; try help\n"
        return command(arguments[1:])

    def _versions(self, _arguments: list[str]) -> str:
        own, followed = (".".join(map(str, version)) for version in (OWN_VERSION, FOLLOWED_PX4_VERSION))
        return (
            f"HW arch: simulated {self._autopilot.airframe.name}\n"
            f"FW version: framerunner {own}, compatible with PX4 {followed}\n"
            f"System id: {self._system_id}\n"
        )

    def _status(self, _arguments: list[str]) -> str:
        state, place = self._autopilot.state, self._autopilot.global_position()
        north_m, east_m, down_m = state.position_ned_m
        speeds = " ".join(f"{speed:.2f}" for speed in state.velocity_ned_m_s)
        angles = " ".join(
            f"{degrees(angle):.1f}" for angle in (state.roll_rad, state.pitch_rad, state.yaw_rad)
        )
        where = "not known" if place is None else f"{place.latitude_deg:.7f} {place.longitude_deg:.7f}"
        battery = self._autopilot.battery
        return (
            f"time: {state.time_us / 1e6:.3f} s\n"
            f"position NED: {north_m:.2f} {east_m:.2f} {down_m:.2f} m\n"
            f"velocity NED: {speeds} m/s\n"
            f"roll pitch yaw: {angles} deg\n"
            f"latitude longitude: {where}\n"
            f"battery: {battery.voltage_v:.2f} V, {battery.remaining * 100:.0f} %\n"
        )

    def _commander(self, arguments: list[str]) -> str:
        if arguments != ["status"]:
            return "usage: commander status\n"
        status = self._autopilot.status
        return (
            f"{'Armed' if status.armed else 'Disarmed'}\n"
            f"navigation mode: {status.mode.name.capitalize()}\n"
            f"user intended navigation mode: {status.intended_mode.name.capitalize()}\n"
            f"in failsafe: {'yes' if status.failsafe else 'no'}\n"
            f"landed: {status.landed_state.name.lower()}\n"
        )

    def _parameters(self, arguments: list[str]) -> str:
        match arguments:
            case ["show"]:
                return self._show("*")
            case ["show", pattern]:
                return self._show(pattern.strip("'\""))
            case ["set", name, text]:
                return self._set(name, text)
        return "usage: param show [PATTERN] | param set NAME VALUE\n"

    def _show(self, pattern: str) -> str:
        parameters = self._autopilot.parameters
        lines = [
            f"{'*' if parameters.value(declared.name) != declared.default else ' '} {declared.name:<16} "
            f"{parameters.value(declared.name):g} {declared.unit}".rstrip()
            for declared in parameters.declarations
            if fnmatchcase(declared.name, pattern)
        ]
        return "\n".join([*lines, f"{len(lines)} of {len(parameters)} parameters; *: not the default"]) + "\n"

    def _set(self, name: str, text: str) -> str:
        parameters = self._autopilot.parameters
        try:
            parameters.set(name, float(text))
        except ParameterError as error:
            return f"{error}\n"
        except ValueError:
            return f"{name}: {text} is not a number\n"
        return f"{name}: {parameters.value(name):g}\n"


@dataclass(slots=True)
class _Shell:
    """One user's shell."""

    link: str
    line: bytearray = field(default_factory=bytearray)  # typed so far
    lines: deque[bytes] = field(default_factory=lambda: deque(maxlen=_MAX_WAITING))  # to be answered
    output: bytearray = field(default_factory=lambda: bytearray(_PROMPT))  # to be sent


class ShellService(Service):
    """Runs a shell for each sender."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        self._console = Console(autopilot, exchange.system_id)
        self._exchange = exchange
        self._shells: dict[tuple[str, int, int], _Shell] = {}
        self.handlers = {mavlink.MAVLINK_MSG_ID_SERIAL_CONTROL: self._receive}

    def update(self) -> None:
        """Answer one line of each shell, and send its output."""
        for key, shell in list(self._shells.items()):
            link = self._exchange.links.get(shell.link)
            if link is None:
                del self._shells[key]
                continue
            if shell.lines and not shell.output:
                line = shell.lines.popleft()
                shell.output += line + b"\r\n"
                text = self._console.answer(line.decode("ascii", "replace").split())
                shell.output += text.replace("\n", "\r\n").encode("ascii", "replace") + _PROMPT
            self._send(link, shell)

    def _send(self, link: Link, shell: _Shell) -> None:
        for _ in range(_PIECES):
            if not shell.output or link.congested:
                return
            piece = bytes(shell.output[:_PIECE_BYTES])
            del shell.output[:_PIECE_BYTES]
            data = piece.ljust(_PIECE_BYTES, b"\0")
            message = mavlink.MAVLink_serial_control_message(_SHELL, _REPLY, 0, 0, len(piece), data)
            self._exchange.send(link, message)

    def _receive(self, link: Link, message: Message) -> None:
        is_target = _target_system(message) in (BROADCAST, self._exchange.system_id)
        if not is_target or message.device != _SHELL or message.flags & _REPLY:
            return
        key = (link.profile.name, message.get_srcSystem(), message.get_srcComponent())
        if not message.flags & _RESPOND and not message.count:  # the sender closes its shell
            self._shells.pop(key, None)
            return
        if key not in self._shells:
            if len(self._shells) >= _MAX_SHELLS:
                del self._shells[next(iter(self._shells))]
            self._shells[key] = _Shell(link.profile.name)
        self._type(self._shells[key], bytes(message.data)[: message.count])

    @staticmethod
    def _type(shell: _Shell, data: bytes) -> None:
        for code in data:
            if code in (0x0A, 0x0D):
                if shell.line or code == 0x0A:
                    shell.lines.append(bytes(shell.line))
                    shell.line.clear()
            elif code in (0x08, 0x7F):
                del shell.line[-1:]
            elif 0x20 <= code < 0x7F and len(shell.line) < _MAX_LINE:
                shell.line.append(code)


def _target_system(message: Message) -> int:
    packet = bytes(message.get_msgbuf())
    if packet[0] != mavlink.PROTOCOL_MARKER_V2 or packet[1] <= _TARGET_OFFSET:
        return BROADCAST
    return packet[_PAYLOAD_START + _TARGET_OFFSET]
