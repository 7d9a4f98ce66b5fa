"""Whether the packets of a system id come from one vehicle.

Two vehicles with the same id on one link look like one that is in two places: a program would command both,
by the state of either. They are told apart by the numbers of their hardware, and by the counters and clocks
of their packets; their addresses are told beside that.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from framerunner.wire.dialect import Message
from framerunner.wire.vehicle_identity import vehicle_uid

MIN_RETURNS = 20
MIN_RETURN_SHARE = 0.02
MIN_CLOCK_JUMPS = 3  # a vehicle that restarts makes one
CLOCK_JUMP_MS = 1000  # a packet that is overtaken by so much is none of the same vehicle
_CLOCKED = ("ATTITUDE", "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED")
_NUMBERS = 256


class SequenceCounters:
    """Tells one counter of packets from two that are interleaved.

    A packet continues one of the two latest series of consecutive numbers, or begins another in the place of
    the older one. One vehicle leaves a series for good when a packet is lost; two vehicles return to theirs.

    Attributes:
        packets: counted.
        returns: how often a series was continued after the other one had been.
    """

    def __init__(self) -> None:
        self.packets = self.returns = 0
        self._last = [-1, -1]  # number of the latest packet of each series
        self._lengths = [0, 0]
        self._current = 0  # the series that was continued last

    def take(self, number: int) -> None:
        """Count a packet by its number, 0 to 255."""
        self.packets += 1
        other = 1 - self._current
        for series in (self._current, other):
            if self._last[series] >= 0 and number == (self._last[series] + 1) % _NUMBERS:
                if series == other and self._lengths[other] > 1 and self._lengths[self._current] > 1:
                    self.returns += 1
                self._last[series] = number
                self._lengths[series] += 1
                self._current = series
                return
        self._last[other], self._lengths[other] = number, 1
        if self._lengths[self._current] == 0:
            self._current = other

    @property
    def are_two(self) -> bool:
        """Whether two counters are interleaved."""
        return self.returns >= max(MIN_RETURNS, MIN_RETURN_SHARE * self.packets)


@dataclass(slots=True)
class Senders:
    """What distinguishes the senders of one autopilot's packets.

    Attributes:
        uids: numbers of hardware that were reported.
        addresses: from which packets came, HOST:PORT; empty on a link without addresses.
        counters: of the packets.
        clock_jumps: how often the vehicle's clock went back.
    """

    uids: set[str] = field(default_factory=set)
    addresses: tuple[str, ...] = ()
    counters: SequenceCounters = field(default_factory=SequenceCounters)
    clock_jumps: int = 0
    _clock_ms: int = 0

    def take(self, message: Message) -> None:
        """Take a packet of the autopilot."""
        self.counters.take(message.get_seq())
        kind = message.get_type()
        if kind == "AUTOPILOT_VERSION" and (uid := vehicle_uid(message)):
            self.uids.add(uid)
        elif kind in _CLOCKED:
            self.clock_jumps += message.time_boot_ms < self._clock_ms - CLOCK_JUMP_MS
            self._clock_ms = message.time_boot_ms

    @property
    def problem(self) -> str:
        """Why they are more than one, in words; empty if nothing says so."""
        places = f", from {' and '.join(self.addresses)}" if len(self.addresses) > 1 else ""
        if len(self.uids) > 1:
            return f"two vehicles have this system id: hardware {' and '.join(sorted(self.uids))}{places}"
        if self.clock_jumps >= MIN_CLOCK_JUMPS:
            return f"two vehicles have this system id, by their clocks{places}"
        if self.counters.are_two:
            return f"two vehicles have this system id, or one is heard twice{places}"
        return ""
