"""SERIAL_CONTROL: a shell on the vehicle, as PX4's on device 10. Only where somebody switched it on.

It knows a few commands of its own, about the vehicle only: nothing of the computer that it runs on can be
reached. Lines are echoed and followed by a prompt, as nsh does. Different from PX4: what comes without the
flag that asks for an answer is answered too, because MAVSDK 4.1 never sets it.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.shell_commands import answer
from wire.dialect import BROADCAST, Message, mavlink

_PROMPT = b"nsh> "
_PIECE = 70
_PIECES = 4  # a link and update
_LONGEST_LINE = 200
_MOST_WAITING = 64  # lines
_SHELLS = 8
_PAYLOAD_START = 10  # of a MAVLink 2 packet
_TARGET_PLACE = 79  # in the payload: an extension that pymavlink does not know
_REPLY = mavlink.SERIAL_CONTROL_FLAG_REPLY
_RESPOND = mavlink.SERIAL_CONTROL_FLAG_RESPOND


@dataclass(slots=True)
class _Shell:
    """One user's shell.

    Attributes:
        link: by which they speak.
        line: what was typed so far.
        lines: typed, to be answered.
        output: to be sent.
    """

    link: str
    line: bytearray = field(default_factory=bytearray)
    lines: deque[bytes] = field(default_factory=lambda: deque(maxlen=_MOST_WAITING))
    output: bytearray = field(default_factory=lambda: bytearray(_PROMPT))


class ShellService:
    """Answers what is typed.

    Args:
        exchange: of the node.
        enabled: otherwise nothing ever answers, as PX4 without a shell.

    Attributes:
        handlers: by message id.
    """

    def __init__(self, exchange: Exchange, *, enabled: bool) -> None:
        self._exchange = exchange
        self._shells: dict[tuple[str, int, int], _Shell] = {}
        self.handlers: dict[int, Handler] = (
            {mavlink.MAVLINK_MSG_ID_SERIAL_CONTROL: self._hear} if enabled else {}
        )

    def update(self) -> None:
        """Answer one line of each shell, and send what there is to send."""
        for key, shell in list(self._shells.items()):
            link = self._exchange.links.get(shell.link)
            if link is None:
                del self._shells[key]
                continue
            if shell.lines and not shell.output:
                line = shell.lines.popleft()
                shell.output += line + b"\r\n"
                text = answer(self._exchange, line.decode("ascii", "replace").split())
                shell.output += text.replace("\n", "\r\n").encode("ascii", "replace") + _PROMPT
            self._send(link, shell)

    def _send(self, link: Link, shell: _Shell) -> None:
        for _ in range(_PIECES):
            if not shell.output or link.congested:
                return
            piece = bytes(shell.output[:_PIECE])
            del shell.output[:_PIECE]
            message = mavlink.MAVLink_serial_control_message(
                mavlink.SERIAL_CONTROL_DEV_SHELL,
                _REPLY,
                0,
                0,
                len(piece),
                piece.ljust(_PIECE, b"\0"),
            )
            self._exchange.send(link, message)

    def _hear(self, exchange: Exchange, link: Link, message: Message) -> None:
        meant = _target_system(message) in (BROADCAST, exchange.system_id)
        if not meant or message.device != mavlink.SERIAL_CONTROL_DEV_SHELL or message.flags & _REPLY:
            return
        key = (link.profile.name, message.get_srcSystem(), message.get_srcComponent())
        if not message.flags & _RESPOND and not message.count:  # goodbye: nobody reads any more
            self._shells.pop(key, None)
            return
        if key not in self._shells:
            if len(self._shells) >= _SHELLS:
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
            elif 0x20 <= code < 0x7F and len(shell.line) < _LONGEST_LINE:
                shell.line.append(code)


def _target_system(message: Message) -> int:
    packet = bytes(message.get_msgbuf())
    if packet[0] != mavlink.PROTOCOL_MARKER_V2 or packet[1] <= _TARGET_PLACE:
        return BROADCAST
    return packet[_PAYLOAD_START + _TARGET_PLACE]
