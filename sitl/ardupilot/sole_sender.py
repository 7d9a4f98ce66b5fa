"""Whose datagrams count on a UDP port that serves one program: the first sender's, until that has gone."""

from __future__ import annotations

import errno
import socket
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from typing import Generic, TypeVar

from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader
from framerunner.wire.transports.sockets import Address
from framerunner.wire.transports.urls import in_url
from sitl.autopilots import WARNING

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Sign(Generic[T]):
    """By which the program is told from others that send to its port."""

    is_in: Callable[[T], bool]  # whether what was received shows it; only asked about new senders
    words: str  # what it is, for people, after "it is no"
    may_come_before: Callable[[T], bool] = lambda item: False  # what the program sends first, without it


class SoleSender(Generic[T]):
    """Selects what the connected program has sent; what others send is dropped, and reported once.

    Another sender is connected when the port of the one before is closed, which is known at once on this
    machine, or when that has been silent for too long.

    Args:
        name: of the program, for people.
        port: that is served.
        notice: called with a line for people about a sender that is not connected, once until another is.
        silent_s: wall time of silence after which a sender has gone; infinite: its port must be closed.
        clock: monotonic wall time, seconds.

    Attributes:
        address: of the connected sender; None: nobody is connected.
        sign: of the program, which may be set; None: the first sender is the program.
    """

    def __init__(
        self,
        name: str,
        port: int,
        notice: Callable[[str], None],
        silent_s: float = inf,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.address: Address | None = None
        self.sign: Sign[T] | None = None
        self._name, self._port, self._notice = name, port, notice
        self._silent_s, self._clock = silent_s, clock
        self._heard_s = 0.0
        self._noticed = False

    def select(self, received: Sequence[tuple[T, Address]]) -> list[T]:
        """What the connected sender has sent, of all that has arrived since the last call, in order."""
        if not received:
            return []
        if all(sender != self.address for _, sender in received) and self._has_gone():
            genuine = next((sender for item, sender in received if self._is_genuine(item)), None)
            if genuine is None:
                self._report_strangers(received)
                return []
            self.address, self._noticed = genuine, False
        selected = [item for item, sender in received if sender == self.address]
        if selected:
            self._heard_s = self._clock()
        if len(selected) < len(received):
            self._report(next(sender for _, sender in received if sender != self.address))
        return selected

    def forget(self) -> None:
        """Nobody is connected from now on."""
        self.address, self._noticed = None, False

    def _is_genuine(self, item: T) -> bool:
        return self.sign is None or self.sign.is_in(item)

    def _report_strangers(self, received: Sequence[tuple[T, Address]]) -> None:
        """Report who has sent what the program does not send."""
        assert self.sign is not None, "the first sender would be connected"
        strange = (sender for item, sender in received if not self.sign.may_come_before(item))
        if (stranger := next(strange, None)) is not None:
            self._report(stranger)

    def _report(self, other: Address) -> None:
        if self._noticed:
            return
        self._noticed = True
        connected = self.address
        if connected is None:
            assert self.sign is not None, "the first sender would be connected"
            reason = f"it is no {self.sign.words}; end it, or choose another --instance"
        else:
            reason = (
                f"{self._name} at {in_url(*connected[:2])} is connected; end one of the two, or choose "
                "another --instance"
            )
        sender = in_url(*other[:2])
        self._notice(f"{WARNING}what {sender} sends to UDP {self._port} is ignored: {reason}")

    def _has_gone(self) -> bool:
        address = self.address
        return address is None or self._clock() - self._heard_s > self._silent_s or _is_closed(address)


def _is_closed(address: Address) -> bool:
    """Whether no program of this machine has this UDP port; False for an address of another machine."""
    family = socket.AF_INET6 if ":" in address[0] else socket.AF_INET
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(address)
        except OSError as error:
            return error.errno not in (errno.EADDRINUSE, errno.EADDRNOTAVAIL, errno.EACCES)
    return True


def mavlink_sender(port: int, system_id: int, notice: Callable[[str], None]) -> SoleSender[bytes]:
    """Selects ArduPilot's datagrams; others cannot take its place by being the first.

    Its first port is its console until its MAVLink begins: it prints text there.

    Args:
        port: UDP port that they are sent to.
        system_id: of its MAVLink.
        notice: called with lines for people.
    """

    def is_of_vehicle(data: bytes) -> bool:
        return any(
            message.get_type() == "HEARTBEAT"
            and message.get_srcSystem() == system_id
            and message.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
            for message in PacketReader().feed(data)
        )

    sender = SoleSender[bytes]("ArduPilot", port, notice)
    sender.sign = Sign(is_of_vehicle, f"MAVLink of ArduPilot with --sysid {system_id}", bytes.isascii)
    return sender
