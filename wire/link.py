"""One link of a MAVLink system: what is due on it, what it can carry, what it has carried."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf, isfinite

from wire.dialect import Message, mavlink
from wire.framing import Packet, PacketReader
from wire.schedule import Schedule
from wire.signing import Signing

_RATE_WINDOW_US = 1_000_000
_MAX_SENDERS = 64  # whose gaps are counted; a noisy network must not fill the memory
_LATE = 128  # a sequence number that far ahead is an old packet that came late
_ADAPT_US = 1_000_000
_MAX_STRETCH = 20.0  # PX4 slows streams down to a twentieth at most
_USUAL_PACKET_BYTES = 45  # for a first estimate, before anything was counted
_BACKLOG_S = 0.5  # how much may wait, at the link's rate, before transfers and streams hold back
_DATAGRAM_BYTES = 1400  # packets are joined up to this, below the usual MTU


@dataclass(frozen=True, slots=True)
class LinkProfile:
    """A kind of link.

    Attributes:
        name: of the link; each of a system's links has another.
        rates_hz: message id to rate, in vehicle time.
        bytes_s: what the link can carry; PX4's MAV_0_RATE.
        trusted: it cannot be reached from outside, so a drone with a signing key hears unsigned packets.
    """

    name: str
    rates_hz: Mapping[int, float]
    bytes_s: float = inf
    trusted: bool = True


@dataclass(slots=True)
class Traffic:
    """Counts of one link, both ways.

    Attributes:
        messages_sent: packets, forwarded ones too.
        bytes_sent: of these packets.
        messages_heard: sound packets that came in.
        bytes_heard: of these packets.
        messages_lost: gaps in the senders' sequence numbers.
    """

    messages_sent: int = 0
    bytes_sent: int = 0
    messages_heard: int = 0
    bytes_heard: int = 0
    messages_lost: int = 0
    _next: dict[tuple[int, int], int] = field(default_factory=dict)  # sequence number by sender
    _window: tuple[int, int, int] = (0, 0, 0)  # time, bytes sent and heard where it began
    _rates_bytes_s: tuple[int, int] = (0, 0)

    def hear(self, sender: tuple[int, int], sequence: int, size: int) -> None:
        """Count a sound packet: its sender's system and component id, its number, its size in bytes."""
        self.messages_heard += 1
        self.bytes_heard += size
        expected = self._next.get(sender)
        if expected is None:
            if len(self._next) >= _MAX_SENDERS:
                return
        else:
            gap = (sequence - expected) % 256
            if gap >= _LATE:
                return
            self.messages_lost += gap
        self._next[sender] = (sequence + 1) % 256

    def rates_bytes_s(self, time_us: int) -> tuple[int, int]:
        """Bytes sent and heard a second, over the last second or more."""
        since_us, sent, heard = self._window
        span_us = time_us - since_us
        if span_us >= _RATE_WINDOW_US:
            self._rates_bytes_s = (
                (self.bytes_sent - sent) * 1_000_000 // span_us,
                (self.bytes_heard - heard) * 1_000_000 // span_us,
            )
            self._window = (time_us, self.bytes_sent, self.bytes_heard)
        return self._rates_bytes_s


class Budget:
    """What a slow link can carry: stretches its streams to fit, and says when too much waits.

    Attributes:
        bytes_s: what the link can carry.
        stretch: by how much the intervals of streams are longer than asked for, 1 to 20.
    """

    __slots__ = ("_backlog", "_counted", "_drained_us", "_since_us", "bytes_s", "stretch")

    def __init__(self, bytes_s: float, rates_hz: Mapping[int, float]) -> None:
        self.bytes_s = bytes_s
        self._counted = 0
        self._since_us = 0
        self._backlog = 0.0
        self._drained_us = 0
        self.stretch = self._limited(sum(rates_hz.values()) * _USUAL_PACKET_BYTES)

    @property
    def congested(self) -> bool:
        """Whether so much waits that nothing but answers and heartbeats should be added."""
        return self._backlog > self.bytes_s * _BACKLOG_S

    def spend(self, size: int) -> None:
        """Count bytes of any kind."""
        self._backlog += size

    def count_stream(self, size: int) -> None:
        """Count bytes of a stream, to learn what the streams want."""
        self._counted += size

    def advance(self, time_us: int) -> None:
        """Let the link carry, and once a second fit the streams to it."""
        self._backlog = max(0.0, self._backlog - self.bytes_s * (time_us - self._drained_us) * 1e-6)
        self._drained_us = time_us
        span_us = time_us - self._since_us
        if span_us >= _ADAPT_US:
            self.stretch = self._limited(self._counted * self.stretch * 1e6 / span_us)
            self._counted, self._since_us = 0, time_us

    def _limited(self, wanted_bytes_s: float) -> float:
        return min(max(1.0, wanted_bytes_s / self.bytes_s), _MAX_STRETCH)


@dataclass(slots=True)
class Link:
    """One link at run time.

    Attributes:
        profile: what it is.
        signing: of the vehicle; None: it never signs.
        number: link id in signatures.
        reader: bytes in.
        schedule: which messages are due when.
        budget: of a slow link.
        traffic: what it has carried.
        gcs_heard: a ground station's heartbeat came in here, so people read its texts.
        open: False once it is gone; what is sent then is lost without a word.
    """

    profile: LinkProfile
    signing: Signing | None = None
    number: int = 0
    reader: PacketReader = field(default_factory=PacketReader)
    schedule: Schedule = field(init=False)
    budget: Budget | None = field(init=False)
    traffic: Traffic = field(default_factory=Traffic)
    gcs_heard: bool = False
    open: bool = True
    _sequences: dict[int, int] = field(default_factory=dict)  # of each component's next packet
    _datagrams: list[bytearray] = field(default_factory=list)

    def __post_init__(self) -> None:
        profile = self.profile
        self.schedule = Schedule(profile.rates_hz)
        self.budget = Budget(profile.bytes_s, profile.rates_hz) if isfinite(profile.bytes_s) else None

    @property
    def congested(self) -> bool:
        """Whether a transfer should wait before it sends more."""
        return self.budget is not None and self.budget.congested

    def send(self, packet: Packet) -> None:
        """Queue a packet."""
        signing, component_id = self.signing, packet.component_id
        sequence = self._sequences.get(component_id, 0)
        if signing is None or not signing.active:
            data = packet.numbered(sequence)
        else:
            data = packet.numbered(sequence, signed=True)
            data += signing.block(data, self.number)
        self._sequences[component_id] = (sequence + 1) % 256
        self.forward(data)

    def send_stream(self, packet: Packet) -> None:
        """Queue a packet of a stream; one that a slow link has no room for is left out."""
        budget = self.budget
        if budget is None:
            self.send(packet)
            return
        budget.count_stream(packet.length)
        if packet.is_heartbeat or not budget.congested:
            self.send(packet)

    def due(self, time_us: int) -> list[int]:
        """Ids of the streamed messages that are due at a vehicle time, which never goes back."""
        if self.budget is not None:
            self.budget.advance(time_us)
            self.schedule.stretch = self.budget.stretch
        return self.schedule.due(time_us)

    def node_status(self, time_us: int) -> Message:
        """LINK_NODE_STATUS at a vehicle time; bytes that were no part of a packet count as parse errors."""
        traffic, reader = self.traffic, self.reader
        sent_bytes_s, heard_bytes_s = traffic.rates_bytes_s(time_us)
        return mavlink.MAVLink_link_node_status_message(
            time_us,
            0,
            0,
            min(sent_bytes_s, 0xFFFFFFFF),
            min(heard_bytes_s, 0xFFFFFFFF),
            min(reader.skipped_bytes, 0xFFFF),
            0,
            min(reader.overflows, 0xFFFF),
            traffic.messages_sent & 0xFFFFFFFF,
            traffic.messages_heard & 0xFFFFFFFF,
            traffic.messages_lost & 0xFFFFFFFF,
        )

    def forward(self, data: bytes) -> None:
        """Queue a whole packet as it is."""
        if not self.open:
            return
        self.traffic.messages_sent += 1
        self.traffic.bytes_sent += len(data)
        if self.budget is not None:
            self.budget.spend(len(data))
        if self._datagrams and len(self._datagrams[-1]) + len(data) <= _DATAGRAM_BYTES:
            self._datagrams[-1] += data
        else:
            self._datagrams.append(bytearray(data))

    def take(self) -> list[bytes]:
        """What is queued, in whole packets, several to a datagram."""
        if not self._datagrams:
            return []
        taken = [bytes(datagram) for datagram in self._datagrams]
        self._datagrams.clear()
        return taken
