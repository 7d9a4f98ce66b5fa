"""Links: what is sent on each unasked, and what one link has seen and is owed.

The rates are PX4 v1.17's: its onboard link (UDP 14540), its ground station link (UDP 14550), and the ones it
uses on a telemetry radio ("normal").
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf, isfinite
from types import MappingProxyType

from wire.dialect import mavlink
from wire.framing import Packet, PacketReader
from wire.schedule import Schedule
from wire.signing import Signing
from wire.traffic import Traffic

_ADAPT_US = 1_000_000
_MAX_STRETCH = 20.0  # PX4 slows streams down to a twentieth at most
_USUAL_PACKET_BYTES = 45  # for a first guess, before anything was counted
_BACKLOG_S = 0.5  # how much may wait, at the link's rate, before transfers and streams hold back
_DATAGRAM_BYTES = 1400  # packets are joined up to this, below the usual MTU


@dataclass(frozen=True, slots=True)
class LinkProfile:
    """A kind of link.

    Attributes:
        name: by which `MavlinkNode` is told and tells where bytes belong.
        rates_hz: message id to rate, in vehicle time.
        bytes_s: what the link can carry; PX4's MAV_0_RATE.
        trusted: it cannot be reached from outside, so a drone with a signing key hears unsigned packets.
    """

    name: str
    rates_hz: Mapping[int, float]
    bytes_s: float = inf
    trusted: bool = True


def _profile(name: str, rates_hz: dict[str, float]) -> LinkProfile:
    by_id = {int(getattr(mavlink, f"MAVLINK_MSG_ID_{message}")): rate for message, rate in rates_hz.items()}
    return LinkProfile(name, MappingProxyType(by_id))


ONBOARD = _profile(
    "onboard",
    {
        "HEARTBEAT": 1,
        "ALTITUDE": 10,
        "ATTITUDE": 100,
        "ATTITUDE_QUATERNION": 50,
        "ATTITUDE_TARGET": 10,
        "BATTERY_STATUS": 0.5,
        "CURRENT_MODE": 0.5,
        "DISTANCE_SENSOR": 10,
        "ESTIMATOR_STATUS": 1,
        "EXTENDED_SYS_STATE": 5,
        "GLOBAL_POSITION_INT": 50,
        "GNSS_INTEGRITY": 1,
        "GPS_RAW_INT": 8,
        "HIGHRES_IMU": 50,
        "HOME_POSITION": 0.5,
        "LINK_NODE_STATUS": 1,
        "LOCAL_POSITION_NED": 30,
        "MISSION_CURRENT": 1,
        "ODOMETRY": 30,
        "OPEN_DRONE_ID_LOCATION": 1,
        "OPEN_DRONE_ID_SYSTEM": 1,
        "PING": 1,
        "POSITION_TARGET_GLOBAL_INT": 10,
        "POSITION_TARGET_LOCAL_NED": 10,
        "RC_CHANNELS": 20,
        "SCALED_PRESSURE": 1,
        "SERVO_OUTPUT_RAW": 10,
        "SYSTEM_TIME": 1,
        "SYS_STATUS": 5,
        "TIMESYNC": 10,
        "TIME_ESTIMATE_TO_TARGET": 0.5,
        "VFR_HUD": 10,
        "VIBRATION": 0.5,
    },
)

GROUND = _profile(
    "ground",
    {
        "HEARTBEAT": 1,
        "ALTITUDE": 1,
        "ATTITUDE": 50,
        "ATTITUDE_QUATERNION": 50,
        "ATTITUDE_TARGET": 50,
        "BATTERY_STATUS": 0.5,
        "CURRENT_MODE": 0.5,
        "DISTANCE_SENSOR": 0.5,
        "ESTIMATOR_STATUS": 0.5,
        "EXTENDED_SYS_STATE": 1,
        "GLOBAL_POSITION_INT": 50,
        "GNSS_INTEGRITY": 1,
        "GPS_RAW_INT": 5,
        "HOME_POSITION": 0.5,
        "LINK_NODE_STATUS": 1,
        "LOCAL_POSITION_NED": 50,
        "MISSION_CURRENT": 1,
        "OPEN_DRONE_ID_LOCATION": 1,
        "OPEN_DRONE_ID_SYSTEM": 1,
        "PING": 0.1,
        "POSITION_TARGET_GLOBAL_INT": 1,
        "POSITION_TARGET_LOCAL_NED": 50,
        "RC_CHANNELS": 20,
        "SCALED_PRESSURE": 1,
        "SERVO_OUTPUT_RAW": 50,
        "SYS_STATUS": 1,
        "TIME_ESTIMATE_TO_TARGET": 0.5,
        "VFR_HUD": 4,
        "VIBRATION": 0.1,
    },
)


NORMAL = _profile(
    "normal",
    {
        "HEARTBEAT": 1,
        "ALTITUDE": 1,
        "ATTITUDE": 15,
        "ATTITUDE_QUATERNION": 10,
        "ATTITUDE_TARGET": 2,
        "BATTERY_STATUS": 0.5,
        "CURRENT_MODE": 0.5,
        "DISTANCE_SENSOR": 0.5,
        "ESTIMATOR_STATUS": 0.5,
        "EXTENDED_SYS_STATE": 1,
        "GLOBAL_POSITION_INT": 5,
        "GNSS_INTEGRITY": 1,
        "GPS_RAW_INT": 5,
        "HOME_POSITION": 0.5,
        "LINK_NODE_STATUS": 1,
        "LOCAL_POSITION_NED": 1,
        "MISSION_CURRENT": 1,
        "OPEN_DRONE_ID_LOCATION": 1,
        "OPEN_DRONE_ID_SYSTEM": 1,
        "PING": 0.1,
        "POSITION_TARGET_GLOBAL_INT": 1,
        "POSITION_TARGET_LOCAL_NED": 1.5,
        "RC_CHANNELS": 5,
        "SCALED_PRESSURE": 1,
        "SERVO_OUTPUT_RAW": 1,
        "SYS_STATUS": 1,
        "TIME_ESTIMATE_TO_TARGET": 0.5,
        "VFR_HUD": 4,
        "VIBRATION": 0.1,
    },
)


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

    def advance(self, time_us: int) -> None:
        """Let vehicle time pass on a slow link."""
        if self.budget is not None:
            self.budget.advance(time_us)
            self.schedule.stretch = self.budget.stretch

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
