"""One link of a MAVLink system: its streams and their schedule, its capacity, and its traffic."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf, isfinite

from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.framing import Packet, PacketReader, SequenceCounter
from framerunner.wire.signing import Signing

_RATE_WINDOW_US = 1_000_000
_MAX_SENDERS = 64  # whose gaps are counted; a noisy network must not fill the memory
_ADAPT_US = 1_000_000
_MAX_STRETCH = 20.0  # PX4 slows streams down to a twentieth at most
_USUAL_PACKET_BYTES = 45  # for a first estimate
_BACKLOG_S = 0.5  # how much may wait, at the link's rate, before transfers and streams pause
_DATAGRAM_BYTES = 1400  # packets are joined up to this, below the usual MTU
_NEVER_US = 1 << 62
_REQUESTED_PHASE_US = 16_000


@dataclass(frozen=True, slots=True)
class LinkProfile:
    """A kind of link."""

    name: str  # of the link; unique within a system
    rates_hz: Mapping[int, float]  # by message id, in vehicle time
    bytes_s: float = inf  # capacity; PX4's MAV_0_RATE
    trusted: bool = True  # it cannot be reached from outside: unsigned packets are accepted in spite of a key
    requested_us: Mapping[int, int] = field(default_factory=dict)  # intervals, as if requested at boot


@dataclass(slots=True)
class Traffic:
    """Counts of packets and bytes of one link; `messages_lost` are gaps in the senders' sequence numbers."""

    messages_sent: int = 0  # forwarded ones too
    bytes_sent: int = 0
    messages_received: int = 0
    bytes_received: int = 0
    messages_lost: int = 0
    _senders: dict[tuple[int, int], SequenceCounter] = field(default_factory=dict)
    _window: tuple[int, int, int] = (0, 0, 0)  # time, bytes sent and received at its start
    _rates_bytes_s: tuple[int, int] = (0, 0)

    def receive(self, sender: tuple[int, int], sequence: int, size: int) -> None:
        """Count a valid packet: its sender's system and component id, its number, its size in bytes."""
        self.messages_received += 1
        self.bytes_received += size
        counter = self._senders.get(sender)
        if counter is None:
            if len(self._senders) >= _MAX_SENDERS:
                return
            counter = self._senders[sender] = SequenceCounter()
        self.messages_lost += max(0, counter.take(sequence))

    def rates_bytes_s(self, time_us: int) -> tuple[int, int]:
        """Bytes sent and received a second, over the last second or more."""
        since_us, sent, received = self._window
        span_us = time_us - since_us
        if span_us >= _RATE_WINDOW_US:
            self._rates_bytes_s = (
                (self.bytes_sent - sent) * 1_000_000 // span_us,
                (self.bytes_received - received) * 1_000_000 // span_us,
            )
            self._window = (time_us, self.bytes_sent, self.bytes_received)
        return self._rates_bytes_s


@dataclass(slots=True)
class _Stream:
    message_id: int
    interval_us: int
    due_us: int = 0
    requested: bool = False  # its interval was, so it has the grid of such streams
    latest: Packet | None = None  # that was sent, if it is requested


class Schedule:
    """Message streams and when they are due, in vehicle time. All are due at the first call.

    Args:
        rates_hz: default rates by message id.

    Attributes:
        next_due_us: nothing is due before; makes the common case one comparison.
        stretch: factor of all intervals but the heartbeat's on a slow link.
    """

    def __init__(self, rates_hz: Mapping[int, float]) -> None:
        self._defaults_us = {
            message_id: max(1, round(1e6 / rate)) for message_id, rate in rates_hz.items() if rate > 0
        }
        self._streams = {
            message_id: _Stream(message_id, interval) for message_id, interval in self._defaults_us.items()
        }
        self.next_due_us = 0
        self.stretch = 1.0

    def due(self, time_us: int) -> list[int]:
        """Message ids due now. Phases are kept, so rates are exact on average; missed ones are skipped."""
        if time_us < self.next_due_us:
            return []
        ids: list[int] = []
        next_due_us = _NEVER_US
        for stream in self._streams.values():
            if stream.due_us <= time_us:
                ids.append(stream.message_id)
                interval_us = stream.interval_us
                if self.stretch > 1.0 and stream.message_id != mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                    interval_us = round(interval_us * self.stretch)
                stream.due_us += interval_us
                if stream.due_us <= time_us:
                    stream.due_us = time_us + interval_us
            if stream.due_us < next_due_us:  # noqa: PLR1730  # a call of min for each is slower
                next_due_us = stream.due_us
        self.next_due_us = next_due_us
        return ids

    def keep(self, message_id: int, packet: Packet) -> None:
        """Keep the last packet of a requested stream."""
        stream = self._streams[message_id]
        if stream.requested:
            stream.latest = packet

    def again(self) -> list[tuple[int, Packet | None]]:
        """All streams, for a vehicle whose time stands; of a requested one its last packet, else None."""
        return [(stream.message_id, stream.latest) for stream in self._streams.values()]

    def interval_us(self, message_id: int) -> int:
        """Interval of a stream; -1 when it is off."""
        stream = self._streams.get(message_id)
        return -1 if stream is None else stream.interval_us

    def set_interval(self, message_id: int, interval_us: int, time_us: int) -> None:
        """Change a stream.

        Its times are multiples of the interval plus 16 ms, whenever the request is received: so flights
        repeat, and no requested message coincides with one of the default streams, where the order would
        matter.

        Args:
            message_id: of the stream.
            interval_us: 0: its default, negative: off.
            time_us: present vehicle time.
        """
        if interval_us == 0:
            interval_us = self._defaults_us.get(message_id, -1)
        if interval_us < 0:
            self._streams.pop(message_id, None)
            return
        stream = self._streams.setdefault(message_id, _Stream(message_id, interval_us))
        stream.interval_us, stream.requested = interval_us, True
        phase_us = _REQUESTED_PHASE_US % interval_us
        stream.due_us = ((time_us - phase_us) // interval_us + 1) * interval_us + phase_us
        self.next_due_us = 0


class Budget:
    """A slow link's capacity: `stretch`, 1 to 20, is the factor of intervals with which the streams fit."""

    def __init__(self, bytes_s: float, rates_hz: Mapping[int, float]) -> None:
        self.bytes_s = bytes_s
        self._counted = 0
        self._since_us = 0
        self._backlog = 0.0
        self._drained_us = 0
        self.stretch = self._limited(sum(rates_hz.values()) * _USUAL_PACKET_BYTES)

    @property
    def congested(self) -> bool:
        """Whether so much waits that only answers and heartbeats should be added."""
        return self._backlog > self.bytes_s * _BACKLOG_S

    def spend(self, size: int) -> None:
        """Count bytes of any kind."""
        self._backlog += size

    def count_stream(self, size: int) -> None:
        """Count bytes of a stream, to measure what the streams need."""
        self._counted += size

    def advance(self, time_us: int) -> None:
        """Reduce the backlog by what the link has carried, and once a second fit the streams to it."""
        self._backlog = max(0.0, self._backlog - self.bytes_s * (time_us - self._drained_us) * 1e-6)
        self._drained_us = time_us
        span_us = time_us - self._since_us
        if span_us >= _ADAPT_US:
            self.stretch = self._limited(self._counted * self.stretch * 1e6 / span_us)
            self._counted, self._since_us = 0, time_us

    def _limited(self, needed_bytes_s: float) -> float:
        return min(max(1.0, needed_bytes_s / self.bytes_s), _MAX_STRETCH)


@dataclass(slots=True, eq=False, weakref_slot=True)
class Link:
    """One link at run time."""

    profile: LinkProfile
    signing: Signing | None = None  # of the vehicle; None: it never signs
    number: int = 0  # link id in signatures
    reader: PacketReader = field(default_factory=PacketReader)
    schedule: Schedule = field(init=False)
    budget: Budget | None = field(init=False)  # of a slow link
    traffic: Traffic = field(default_factory=Traffic)
    gcs_heard: bool = False  # a ground station's heartbeat was received here, so it gets status texts
    open: bool = True  # False once it is removed; what is sent then is dropped silently
    _sequences: dict[int, int] = field(default_factory=dict)  # of each component's next packet
    _datagrams: list[bytearray] = field(default_factory=list)

    def __post_init__(self) -> None:
        profile = self.profile
        self.schedule = Schedule(profile.rates_hz)
        for message_id, interval_us in profile.requested_us.items():
            self.schedule.set_interval(message_id, interval_us, 0)
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
        """Queue a packet of a stream, unless it is too much for a slow link."""
        budget = self.budget
        if budget is None:
            self.send(packet)
            return
        budget.count_stream(packet.length)
        if packet.is_heartbeat or not budget.congested:
            self.send(packet)

    def due(self, time_us: int) -> list[int]:
        """Ids of the streamed messages that are due at a vehicle time, which never decreases."""
        if self.budget is not None:
            self.budget.advance(time_us)
            self.schedule.stretch = self.budget.stretch
        return self.schedule.due(time_us)

    def node_status(self, time_us: int) -> Message:
        """LINK_NODE_STATUS at a vehicle time; bytes that were no part of a packet count as parse errors."""
        traffic, reader = self.traffic, self.reader
        sent_bytes_s, received_bytes_s = traffic.rates_bytes_s(time_us)
        return mavlink.MAVLink_link_node_status_message(
            time_us,
            0,
            0,
            min(sent_bytes_s, 0xFFFFFFFF),
            min(received_bytes_s, 0xFFFFFFFF),
            min(reader.skipped_bytes, 0xFFFF),
            0,
            min(reader.overflows, 0xFFFF),
            traffic.messages_sent & 0xFFFFFFFF,
            traffic.messages_received & 0xFFFFFFFF,
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
        """Remove and return the queued datagrams, each with one or more whole packets."""
        if not self._datagrams:
            return []
        taken = [bytes(datagram) for datagram in self._datagrams]
        self._datagrams.clear()
        return taken
