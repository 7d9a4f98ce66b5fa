"""What was heard from a drone: counts, rates, losses, and the latest of each message that matters."""

from __future__ import annotations

import struct
from collections import deque
from dataclasses import dataclass, field
from math import dist

from wire.dialect import AUTOPILOT_COMPONENT_ID, Message, is_vehicle, mavlink
from wire.framing import missing_before
from wire.status_text import TextAssembler
from wire.vehicle_telemetry import VehicleTelemetry

TEXTS_KEPT = 12
# Bits of PX4's navigation states. An offboard flight by velocity needs what a take-off needs: attitude,
# height and local position. Offboard's own bit is never set while nobody sends setpoints.
TAKEOFF_MODE = 1 << 17
_ARGUMENTS = struct.Struct("<BIIII")  # chunk, errors, warnings, modes that can be armed, that can be flown
_CHECK_ARGUMENTS = struct.Struct("<IB")  # modes, component
_ERROR_LEVEL = 3
_AUTOPILOT_EVENTS = 1


def event_id(name: str) -> int:
    """Number of one of the autopilot's events: component 1, then 24 bits of its name's FNV-1a hash."""
    number = 0x811C9DC5
    for byte in name.encode():
        number = (number ^ byte) * 0x01000193 & 0xFFFFFFFF
    return _AUTOPILOT_EVENTS << 24 | number & 0xFFFFFF


SUMMARY = event_id("commander_arming_check_summary")
REASONS = {
    event_id("check_modes_attitude"): "no valid attitude",
    event_id("check_modes_angular_velocity"): "no valid angular velocity",
    event_id("check_modes_local_alt"): "no valid height",
    event_id("check_modes_local_pos"): "no valid local position",
    event_id("check_modes_manual_control"): "no manual control input",
    event_id("check_rc_dl_no_dllink"): "no ground station is heard",
}


@dataclass(slots=True)
class ArmingReport:
    """PX4's latest report of its arming checks: in which modes it could be armed, whichever it is in now.

    PX4 sends it as EVENTs: a summary, then an event for each failed check, then a summary of its sensors'
    health (https://mavlink.io/en/services/events.html; the arguments are those of PX4 1.14 and later).

    Attributes:
        armable_modes: bits of the navigation states in which it can be armed; None before the first report.
        failures: what keeps it from being armed for a flight in offboard, in words.
    """

    armable_modes: int | None = None
    failures: tuple[str, ...] = ()

    @property
    def ready_for_offboard(self) -> bool:
        """Whether it can be armed in offboard as soon as setpoints come; False as long as it is unknown."""
        return self.armable_modes is not None and bool(self.armable_modes & TAKEOFF_MODE)

    def take(self, event: Message) -> None:
        """Take an EVENT; those of other subjects are passed over."""
        arguments = bytes(event.arguments)
        if event.id == SUMMARY:
            self.armable_modes = _ARGUMENTS.unpack_from(arguments)[3]
            self.failures = ()
        elif event.id in REASONS and event.log_levels & 0xF <= _ERROR_LEVEL:
            modes, _component = _CHECK_ARGUMENTS.unpack_from(arguments)
            words = REASONS[event.id]
            if modes & TAKEOFF_MODE and words not in self.failures:
                self.failures = (*self.failures, words)


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
        missing = missing_before(sequence, self._last)
        if missing >= 0:
            self.passed += missing + 1
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
        telemetry: its state.
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
    telemetry: VehicleTelemetry = field(default_factory=VehicleTelemetry)
    _texts: TextAssembler = field(default_factory=TextAssembler)

    def take(self, message: Message, now_s: float) -> None:
        """Take a message.

        Args:
            message: any.
            now_s: wall time, seconds.
        """
        kind = message.get_type()
        if kind == "HEARTBEAT":
            self._note_sender(message)
        if message.get_srcSystem() != self.system_id or message.get_srcComponent() != AUTOPILOT_COMPONENT_ID:
            return
        self.packets.take(message.get_seq())
        self.octets += len(message.get_msgbuf())
        self.latest[kind] = message
        self.counts[kind] = self.counts.get(kind, 0) + 1
        self.times_s[kind] = (self.times_s.get(kind, (now_s, now_s))[0], now_s)
        if self.telemetry.take(message, now_s) and kind == "LOCAL_POSITION_NED":
            self.places.append((message.x, message.y, message.z))
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
        return self.telemetry.armed

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

    def _note_sender(self, message: Message) -> None:
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

    def _take_text(self, message: Message, now_s: float) -> None:
        for told in self._texts.take(message, AUTOPILOT_COMPONENT_ID, now_s):
            text = (told.severity, " ".join(told.text.split()))
            if text not in self.texts:
                self.texts.append(text)

    def _take_parameter(self, message: Message, _now_s: float) -> None:
        self.parameters[message.param_id] = parameter_value(message)

    def _take_event(self, message: Message, _now_s: float) -> None:
        self.arming.take(message)

    def _take_mode(self, message: Message, _now_s: float) -> None:
        if not message.mode_name.startswith("("):  # PX4 lists empty places for modes of others
            self.modes[message.custom_mode] = message.mode_name


_TAKERS = {
    "ATTITUDE": Record._take_clock,
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
