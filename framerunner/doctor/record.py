"""What was heard from a drone: counts, rates, losses, and the latest of each message that matters."""

from __future__ import annotations

import struct
from collections import deque
from dataclasses import dataclass, field
from math import dist, isfinite

from framerunner.doctor.arming import ArmingReport
from wire.dialect import Message, mavlink
from wire.transports.vehicle_link import AUTOPILOT_COMPONENT, is_vehicle

TEXTS_KEPT = 12
_HALF_TURN = 128
_CHUNK_CHARS = 50


class StreamCounter:
    """Packets of one component, counted against their sequence numbers.

    Attributes:
        received: packets that came.
        passed: packets that were sent meanwhile, by their numbers.
    """

    __slots__ = ("_last", "passed", "received")

    def __init__(self) -> None:
        self._last: int | None = None
        self.received = self.passed = 0

    def take(self, sequence: int) -> None:
        """Count a packet; one that comes late, after its successor, is no loss.

        Args:
            sequence: its number, 0 to 255.
        """
        self.received += 1
        if self._last is None:
            self.passed, self._last = 1, sequence
            return
        ahead = (sequence - self._last) % 256
        if 0 < ahead < _HALF_TURN:
            self.passed += ahead
            self._last = sequence

    @property
    def lost_share(self) -> float:
        """Of the packets sent, 0 to 1."""
        return max(0.0, 1.0 - self.received / self.passed) if self.passed else 0.0


@dataclass(slots=True)
class Record:
    """Everything heard on one link, seen from one vehicle.

    Attributes:
        system_id: of the vehicle; None before its first heartbeat.
        latest: the latest message of each name from its autopilot.
        counts: how many of each name came.
        times_s: wall time of the first and of the latest of each name.
        packets: of the autopilot, against its sequence numbers.
        octets: bytes of the autopilot's packets.
        cameras: component ids that say they are cameras.
        stations: (system, component) of ground stations on the same link.
        parameters: by name, as numbers.
        modes: names of the modes it lists, by custom_mode.
        texts: (severity, text), the latest last.
        clock_ms: vehicle's time stamps of attitude, first and latest; with wall time, seconds.
        places: local positions heard, NED metres.
        arming: what it says of its arming checks.
    """

    system_id: int | None = None
    latest: dict[str, Message] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    times_s: dict[str, tuple[float, float]] = field(default_factory=dict)
    packets: StreamCounter = field(default_factory=StreamCounter)
    octets: int = 0
    cameras: set[int] = field(default_factory=set)
    stations: set[tuple[int, int]] = field(default_factory=set)
    parameters: dict[str, float] = field(default_factory=dict)
    modes: dict[int, str] = field(default_factory=dict)
    texts: deque[tuple[int, str]] = field(default_factory=lambda: deque(maxlen=TEXTS_KEPT))
    clock_ms: list[tuple[int, float]] = field(default_factory=list)
    places: list[tuple[float, float, float]] = field(default_factory=list)
    arming: ArmingReport = field(default_factory=ArmingReport)
    _pieces: dict[int, str] = field(default_factory=dict)

    def take(self, message: Message, now_s: float) -> None:
        """Take a message.

        Args:
            message: any.
            now_s: wall time, seconds.
        """
        kind = message.get_type()
        if kind == "HEARTBEAT":
            self._take_heartbeat(message)
        if message.get_srcSystem() != self.system_id or message.get_srcComponent() != AUTOPILOT_COMPONENT:
            return
        self.packets.take(message.get_seq())
        self.octets += len(message.get_msgbuf())
        self.latest[kind] = message
        self.counts[kind] = self.counts.get(kind, 0) + 1
        self.times_s[kind] = (self.times_s.get(kind, (now_s, now_s))[0], now_s)
        taker = _TAKERS.get(kind)
        if taker is not None:
            taker(self, message, now_s)

    def rate_hz(self, kind: str) -> float:
        """How often a message came, from the first to the latest; 0 if fewer than two came."""
        first_s, last_s = self.times_s.get(kind, (0.0, 0.0))
        count = self.counts.get(kind, 0)
        return (count - 1) / (last_s - first_s) if count > 1 and last_s > first_s else 0.0

    @property
    def armed(self) -> bool:
        """Motors on, by the latest heartbeat."""
        heartbeat = self.latest.get("HEARTBEAT")
        return heartbeat is not None and bool(heartbeat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)

    @property
    def real_time_factor(self) -> float | None:
        """How fast the vehicle's clock runs; None if that cannot be told yet."""
        if len(self.clock_ms) < 2:
            return None
        (first_ms, first_s), (last_ms, last_s) = self.clock_ms[0], self.clock_ms[-1]
        return (last_ms - first_ms) / 1000 / (last_s - first_s) if last_s - first_s > 1.0 else None

    @property
    def wander_m(self) -> float:
        """How far the position wandered from its first report."""
        return max((dist(self.places[0], place) for place in self.places), default=0.0)

    def _take_heartbeat(self, message: Message) -> None:
        sender = (message.get_srcSystem(), message.get_srcComponent())
        if is_vehicle(message):
            if self.system_id is None:
                self.system_id = sender[0]
        elif message.type == mavlink.MAV_TYPE_GCS:
            self.stations.add(sender)
        elif message.type == mavlink.MAV_TYPE_CAMERA:
            self.cameras.add(sender[1])

    def _take_clock(self, message: Message, now_s: float) -> None:
        stamp = (message.time_boot_ms, now_s)
        self.clock_ms[1:] = [stamp]

    def _take_place(self, message: Message, _now_s: float) -> None:
        place = (message.x, message.y, message.z)
        if all(map(isfinite, place)):
            self.places.append(place)

    def _take_text(self, message: Message, _now_s: float) -> None:
        """Put texts of more than fifty characters together again."""
        text = message.text
        if message.id:
            text = self._pieces.pop(message.id, "") + text if message.chunk_seq else text
            if len(message.text) == _CHUNK_CHARS:
                self._pieces[message.id] = text
                return
        clean = " ".join("".join(c if c.isprintable() else " " for c in text).split())
        if clean and (message.severity, clean) not in self.texts:
            self.texts.append((message.severity, clean))

    def _take_parameter(self, message: Message, _now_s: float) -> None:
        self.parameters[message.param_id] = parameter_value(message)

    def _take_event(self, message: Message, _now_s: float) -> None:
        self.arming.take(message)

    def _take_mode(self, message: Message, _now_s: float) -> None:
        if not message.mode_name.startswith("("):  # PX4 lists empty places for modes of others
            self.modes[message.custom_mode] = message.mode_name


_TAKERS = {
    "ATTITUDE": Record._take_clock,
    "LOCAL_POSITION_NED": Record._take_place,
    "STATUSTEXT": Record._take_text,
    "EVENT": Record._take_event,
    "PARAM_VALUE": Record._take_parameter,
    "AVAILABLE_MODES": Record._take_mode,
}


def parameter_value(message: Message) -> float:
    """The number in a PARAM_VALUE: PX4 sends whole numbers by their bytes, in the place of a float's."""
    whole = {mavlink.MAV_PARAM_TYPE_INT32: "<i", mavlink.MAV_PARAM_TYPE_UINT32: "<I"}.get(message.param_type)
    if whole is None:
        return float(message.param_value)
    # From the packet itself: -1 would be a NaN, whose bytes need not survive the way through a float.
    packet = message.get_msgbuf()
    header = 10 if packet[0] == mavlink.PROTOCOL_MARKER_V2 else 6
    return float(struct.unpack_from(whole, packet, header)[0])
