"""Faults of the link between a drone and its app: packets that are lost or late."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Generic, TypeVar

from scenarios.faults.declaration import Fault, FaultKind
from sitl.faults.effects import Lossy
from sitl.sensors.noise import Delay

T = TypeVar("T")


class LinkFault:
    """An active fault of the link, for both directions.

    Args:
        fault: of the link.
        seed: of the flight.

    Attributes:
        up: from the app.
        down: to the app.
    """

    def __init__(self, fault: Fault, seed: int) -> None:
        self.fault = fault
        self._off = fault.kind is FaultKind.OFF
        delay_s = fault.amount if fault.kind is FaultKind.DELAYED else 0.0
        self.up: Way[Any] = Way(self.loses, delay_s)
        self.down: Way[Any] = Way(self.loses, delay_s)
        self._lossy: Lossy | None = None
        if fault.kind is FaultKind.LOSSY:
            self._lossy = Lossy(fault.amount, seed, "faults.link.lossy")

    def loses(self) -> bool:
        """Whether the next packet is lost."""
        return self._off or (self._lossy is not None and self._lossy(0, True) is None)


class Way(Generic[T]):
    """Packets in one direction.

    Args:
        loses: whether a packet is lost.
        delay_s: by which the others are late.
    """

    def __init__(self, loses: Callable[[], bool], delay_s: float) -> None:
        self._loses = loses
        self._delay: Delay[T] = Delay(delay_s)

    def send(self, now_us: int, packet: T) -> None:
        """Send a packet, which may be lost."""
        if not self._loses():
            self._delay.send(now_us, packet)

    def all(self, now_us: int) -> Iterator[T]:
        """All packets that have arrived since the last call, oldest first."""
        return self._delay.all(now_us)

    def newest(self, now_us: int) -> T | None:
        """The newest packet that has arrived since the last call."""
        return self._delay.newest(now_us)
