"""What a drone reports: listen to it, request what it does not send by itself, and record the answers.

Nothing here changes the drone: messages are requested and parameters read. ArduPilot sends no streams by
itself, so they are requested of it.
"""

from __future__ import annotations

import struct
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from math import dist, inf, isfinite

from framerunner.doctor.senders import Senders
from framerunner.wire import ardupilot_modes
from framerunner.wire.ardupilot_messages import EKF_STATUS_REPORT_ID, add_ardupilot_messages
from framerunner.wire.dialect import (
    AUTOPILOT_COMPONENT_ID,
    Message,
    command_long,
    companion_heartbeat,
    ground_station_heartbeat,
    is_vehicle,
    mavlink,
    request_message,
    request_rate,
)
from framerunner.wire.framing import missing_before
from framerunner.wire.px4_modes import mode_words
from framerunner.wire.status_text import TextAssembler
from framerunner.wire.transports.vehicle_link import VehicleLink
from framerunner.wire.vehicle_telemetry import VehicleTelemetry

SYSTEM_ID = 247
COMPONENT_ID = 190
FIND_S = 10.0
_ASK_AGAIN_S = 1.0
_REQUEST_GAP_S = 0.02  # so that requests do not fill a serial line
_PREARM_S = 0.5
_PREARM_AGAIN_S = 2.0  # until a report of the arming checks is received
PARAMETERS = (
    *("BAT_CRIT_THR", "BAT_LOW_THR"),
    *("COM_DISARM_LAND", "COM_DISARM_PRFLT", "COM_LOW_BAT_ACT", "COM_OBL_RC_ACT", "COM_OF_LOSS_T"),
    *("COM_RCL_EXCEPT", "COM_RC_IN_MODE"),
    *("EKF2_DELAY_MAX", "EKF2_EVP_NOISE", "EKF2_EVV_NOISE", "EKF2_EV_CTRL", "EKF2_GPS_CTRL"),
    *("EKF2_HGT_REF", "EKF2_RNG_CTRL", "EKF2_TAU_POS", "EKF2_TAU_VEL"),
    *("GF_ACTION", "GF_MAX_HOR_DIST", "GF_MAX_VER_DIST"),
    *("MC_YAWRATE_MAX", "MPC_THR_HOVER", "MPC_TKO_RAMP_T", "MPC_XY_VEL_I_ACC", "MPC_XY_VEL_MAX"),
    *("MPC_XY_VEL_P_ACC", "MPC_Z_VEL_MAX_DN", "MPC_Z_VEL_MAX_UP"),
    *("NAV_DLL_ACT", "NAV_RCL_ACT", "RTL_RETURN_ALT"),
)
_ONCE = {
    "AUTOPILOT_VERSION": mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
    "HOME_POSITION": mavlink.MAVLINK_MSG_ID_HOME_POSITION,
    "GPS_GLOBAL_ORIGIN": mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN,
    "ESTIMATOR_STATUS": mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS,
    "AVAILABLE_MODES": mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES,
}
ARDUPILOT_PARAMETERS = (
    *("BATT_FS_LOW_ACT", "BATT_MONITOR", "DISARM_DELAY"),
    *("EK3_SRC1_POSXY", "EK3_SRC1_POSZ", "EK3_SRC1_VELXY", "EK3_SRC1_YAW", "VISO_TYPE"),
    *("FENCE_ACTION", "FENCE_ALT_MAX", "FENCE_ENABLE", "FENCE_RADIUS"),
    *("FS_EKF_ACTION", "FS_GCS_ENABLE", "FS_THR_ENABLE"),
    *("GUID_OPTIONS", "GUID_TIMEOUT", "LAND_SPEED", "RTL_ALT"),
    *("WPNAV_ACCEL", "WPNAV_SPEED", "WPNAV_SPEED_DN", "WPNAV_SPEED_UP"),
)
_ARDUPILOT_ONCE = {
    "AUTOPILOT_VERSION": mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
    "HOME_POSITION": mavlink.MAVLINK_MSG_ID_HOME_POSITION,
    "GPS_GLOBAL_ORIGIN": mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN,
}
_ARDUPILOT_STREAMS_HZ = {  # it sends none by itself; these are requested for this link until its next start
    "ATTITUDE": (mavlink.MAVLINK_MSG_ID_ATTITUDE, 50.0),
    "LOCAL_POSITION_NED": (mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, 50.0),
    "SYS_STATUS": (mavlink.MAVLINK_MSG_ID_SYS_STATUS, 2.0),
    "EXTENDED_SYS_STATE": (mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 2.0),
    "GPS_RAW_INT": (mavlink.MAVLINK_MSG_ID_GPS_RAW_INT, 2.0),
    "EKF_STATUS_REPORT": (EKF_STATUS_REPORT_ID, 2.0),
}
TEXTS_KEPT = 12
SILENT_S = 2.5  # wall time; every vehicle sends a heartbeat each second, and a link loses one
_AUTOPILOTS = {mavlink.MAV_AUTOPILOT_PX4: "PX4", mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA: "ArduPilot"}
_STATES = (
    *("not ready", "booting", "calibrating", "standby", "active"),
    *("critical (a failsafe acts)", "emergency", "powering off", "terminated"),
)
# Bits of PX4's navigation states. An offboard flight by velocity requires what a take-off requires: attitude,
# height and local position. Offboard's own bit is never set while no setpoints are sent.
TAKEOFF_MODE = 1 << 17
_ARGUMENTS = struct.Struct("<BIIII")  # chunk, errors, warnings, modes that can be armed, that can be flown
_CHECK_ARGUMENTS = struct.Struct("<IB")  # modes, component
_ERROR_LEVEL = 3
_AUTOPILOT_EVENTS = 1

Progress = Callable[[str, float], None]
"""Called with what is being done and how far it is, 0 to 1."""


def event_id(name: str) -> int:
    """Number of one of the autopilot's events: component 1, then 24 bits of its name's FNV-1a hash."""
    number = 0x811C9DC5
    for byte in name.encode():
        number = (number ^ byte) * 0x01000193 & 0xFFFFFFFF
    return _AUTOPILOT_EVENTS << 24 | number & 0xFFFFFF


SUMMARY = event_id("commander_arming_check_summary")
_REASONS = {
    event_id("check_modes_attitude"): "no valid attitude",
    event_id("check_modes_angular_velocity"): "no valid angular velocity",
    event_id("check_modes_local_alt"): "no valid height",
    event_id("check_modes_local_pos"): "no valid local position",
    event_id("check_modes_manual_control"): "no manual control input",
    event_id("check_rc_dl_no_dllink"): "no ground station is heard",
}


@dataclass(slots=True)
class ArmingReport:
    """PX4's latest report of its arming checks: the modes in which it could be armed, whichever is active.

    PX4 sends it as EVENTs: a summary, then an event for each failed check, then a summary of its sensors'
    health (https://mavlink.io/en/services/events.html; the arguments are those of PX4 1.14 and later).
    """

    armable_modes: int | None = None  # bits of the navigation states; None before the first report
    failures: tuple[str, ...] = ()  # what prevents arming for a flight in offboard, in words

    @property
    def ready_for_offboard(self) -> bool:
        """Whether it can be armed in offboard once setpoints are sent; False until that is known."""
        return self.armable_modes is not None and bool(self.armable_modes & TAKEOFF_MODE)

    def take(self, event: Message) -> None:
        """Take an EVENT; those on other subjects are ignored."""
        arguments = bytes(event.arguments)
        if event.id == SUMMARY:
            self.armable_modes = _ARGUMENTS.unpack_from(arguments)[3]
            self.failures = ()
        elif event.id in _REASONS and event.log_levels & 0xF <= _ERROR_LEVEL:
            modes, _component = _CHECK_ARGUMENTS.unpack_from(arguments)
            words = _REASONS[event.id]
            if modes & TAKEOFF_MODE and words not in self.failures:
                self.failures = (*self.failures, words)


class StreamCounter:
    """Packets of one component, counted against their sequence numbers."""

    def __init__(self) -> None:
        self._last: int | None = None
        self.received = 0
        self.passed = 0  # sent meanwhile, by their numbers

    def take(self, sequence: int) -> None:
        """Count a packet by its number, 0 to 255; one that is received after its successor is not lost."""
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
    """All that was received on one link about one vehicle."""

    system_id: int | None = None  # of the vehicle; None before its first heartbeat
    heard_s: float = 0.0  # wall time of its autopilot's latest packet
    listened_s: float = 0.0  # wall time until which it was listened to
    latest: dict[str, Message] = field(default_factory=dict)  # by name, from its autopilot
    counts: dict[str, int] = field(default_factory=dict)  # messages received, by name
    times_s: dict[str, tuple[float, float]] = field(default_factory=dict)  # wall time, first and latest
    packets: StreamCounter = field(default_factory=StreamCounter)  # of the autopilot
    octets: int = 0  # bytes of the autopilot's packets
    cameras: set[int] = field(default_factory=set)  # component ids
    stations: set[tuple[int, int]] = field(default_factory=set)  # (system, component) on the same link
    parameters: dict[str, float] = field(default_factory=dict)  # by name, as numbers
    modes: dict[int, str] = field(default_factory=dict)  # names of the modes it lists, by custom_mode
    texts: deque[tuple[int, str]] = field(default_factory=lambda: deque(maxlen=TEXTS_KEPT))  # with severity
    clock_ms: list[tuple[int, float]] = field(default_factory=list)  # first and latest, with wall time, s
    places: list[tuple[float, float, float]] = field(default_factory=list)  # local positions, NED metres
    arming: ArmingReport = field(default_factory=ArmingReport)
    telemetry: VehicleTelemetry = field(default_factory=VehicleTelemetry)
    senders: Senders = field(default_factory=Senders)  # of the autopilot's packets
    _texts: TextAssembler = field(default_factory=TextAssembler)

    def take(self, message: Message, now_s: float) -> None:
        """Take any message, received at a wall time in seconds."""
        kind = message.get_type()
        if kind == "HEARTBEAT":
            self._note_sender(message)
        if message.get_srcSystem() != self.system_id or message.get_srcComponent() != AUTOPILOT_COMPONENT_ID:
            return
        self.heard_s = now_s
        self.packets.take(message.get_seq())
        self.senders.take(message)
        self.octets += len(message.get_msgbuf())
        self.latest[kind] = message
        self.counts[kind] = self.counts.get(kind, 0) + 1
        self.times_s[kind] = (self.times_s.get(kind, (now_s, now_s))[0], now_s)
        is_newest = self.telemetry.take(message, now_s)
        if kind == "LOCAL_POSITION_NED" and is_newest:
            self.places.append((message.x, message.y, message.z))
        elif kind == "ATTITUDE":
            self.clock_ms[1:] = [(message.time_boot_ms, now_s)]
        elif kind == "STATUSTEXT":
            self._take_text(message, now_s)
        elif kind == "EVENT":
            self.arming.take(message)
        elif kind == "PARAM_VALUE":
            value = float(message.param_value) if self.is_ardupilot else parameter_value(message)
            if isfinite(value):
                self.parameters[message.param_id] = value
        elif kind == "AVAILABLE_MODES" and not message.mode_name.startswith("("):  # "(": PX4 does not use it
            self.modes[message.custom_mode] = message.mode_name

    @property
    def silence(self) -> str:
        """That the vehicle is heard no longer, in words, so that all it has told is old; empty: it is."""
        silent_s = self.listened_s - self.heard_s
        return f"not heard for {silent_s:.0f} s" if self.system_id and silent_s > SILENT_S else ""

    def rate_hz(self, kind: str) -> float:
        """Mean rate of a message from the first to the latest; 0 if fewer than two were received."""
        first_s, last_s = self.times_s.get(kind, (0.0, 0.0))
        count = self.counts.get(kind, 0)
        return (count - 1) / (last_s - first_s) if count > 1 and last_s > first_s else 0.0

    @property
    def armed(self) -> bool:
        """Motors on, by the latest heartbeat."""
        return self.telemetry.armed

    @property
    def autopilot_name(self) -> str:
        """The kind of autopilot in words."""
        number = self.latest["HEARTBEAT"].autopilot
        return _AUTOPILOTS.get(number, f"autopilot {number}")

    @property
    def is_ardupilot(self) -> bool:
        """Its autopilot is ArduPilot."""
        heartbeat = self.latest.get("HEARTBEAT")
        return heartbeat is not None and ardupilot_modes.is_ardupilot(heartbeat)

    @property
    def type_name(self) -> str:
        """The kind of vehicle (MAV_TYPE) in words."""
        entry = mavlink.enums["MAV_TYPE"].get(self.latest["HEARTBEAT"].type)
        if entry is None:
            return "unknown type"
        return str(entry.name).removeprefix("MAV_TYPE_").replace("_", " ").lower()

    @property
    def state_name(self) -> str:
        """MAV_STATE in words."""
        return _STATES[min(self.latest["HEARTBEAT"].system_status, len(_STATES) - 1)]

    @property
    def mode_name(self) -> str:
        """The flight mode inside a sentence: as the vehicle lists it, else as its autopilot numbers it."""
        custom_mode = self.latest["HEARTBEAT"].custom_mode
        if self.is_ardupilot:
            return ardupilot_modes.mode_name(custom_mode)
        return self.modes.get(custom_mode) or mode_words(custom_mode)

    @property
    def real_time_factor(self) -> float | None:
        """Vehicle time per wall time; None before a second has passed."""
        if len(self.clock_ms) < 2:
            return None
        (first_ms, first_s), (last_ms, last_s) = self.clock_ms
        return (last_ms - first_ms) / 1000 / (last_s - first_s) if last_s - first_s > 1.0 else None

    @property
    def wander_m(self) -> float:
        """Largest distance of the position from its first report."""
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

    def _take_text(self, message: Message, now_s: float) -> None:
        for status_text in self._texts.take(message, AUTOPILOT_COMPONENT_ID, now_s):
            text = (status_text.severity, " ".join(status_text.text.split()))
            if text not in self.texts:
                self.texts.append(text)


def parameter_value(message: Message) -> float:
    """The number in a PARAM_VALUE: PX4 sends an integer's bytes in the place of a float's."""
    layout = {mavlink.MAV_PARAM_TYPE_INT32: "<i", mavlink.MAV_PARAM_TYPE_UINT32: "<I"}.get(message.param_type)
    if layout is None:
        return float(message.param_value)
    # From the packet itself: -1 would be a NaN, whose bytes may change when it is parsed as a float.
    packet = message.get_msgbuf()
    header = 10 if packet[0] == mavlink.PROTOCOL_MARKER_V2 else 6
    return float(struct.unpack_from(layout, packet, header)[0])


def find(link: VehicleLink, record: Record, progress: Progress) -> bool:
    """Wait for a vehicle's heartbeat, for `FIND_S` at most; returns whether there was one."""
    began_s = time.monotonic()
    beat_s = -1.0
    while (now_s := time.monotonic()) - began_s < FIND_S:
        if now_s - beat_s >= 1.0:
            beat_s = now_s
            link.send(companion_heartbeat())  # over udpout the vehicle cannot send before it has this address
        progress("looking for a vehicle", (now_s - began_s) / FIND_S)
        _receive(link, record)
        if record.system_id is not None:
            return True
    return False


def listen(link: VehicleLink, record: Record, seconds: float, progress: Progress) -> None:
    """Receive and request, for some seconds of wall time.

    To a disarmed vehicle this is a ground station, since PX4 reports its reasons only to one. To an armed
    one it is not: the vehicle would take its end for a lost ground station.
    """
    if record.is_ardupilot:
        add_ardupilot_messages()
    began_s = request_s = time.monotonic()
    beat_s = requested_s = -10.0
    prearm_s = began_s + _PREARM_S
    requests = open_requests(record)
    identify_s = began_s + seconds / 2  # all senders are heard by then
    while (now_s := time.monotonic()) - began_s < seconds:
        progress("listening and requesting", (now_s - began_s) / seconds)
        if now_s - beat_s >= 1.0:
            beat_s = now_s
            link.send(companion_heartbeat() if record.armed else ground_station_heartbeat())
        if now_s >= identify_s:
            identify_s = inf
            version = request_message(_system_id(record), mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
            link.send_to_all(version)
        if now_s > prearm_s and not record.armed and record.arming.armable_modes is None:
            prearm_s = now_s + _PREARM_AGAIN_S
            link.send(command_long(_system_id(record), mavlink.MAV_CMD_RUN_PREARM_CHECKS))
        if now_s - request_s >= _REQUEST_GAP_S:
            request_s = now_s
            request = next(requests, None)
            if request is not None:
                requested_s = now_s
                link.send(request)
            elif now_s - requested_s >= _ASK_AGAIN_S:
                requests = open_requests(record)
        _receive(link, record)
    record.listened_s = time.monotonic()
    record.senders.addresses = link.addresses(_system_id(record), AUTOPILOT_COMPONENT_ID)


def _receive(link: VehicleLink, record: Record) -> None:
    messages = link.receive(0.02)
    now_s = time.monotonic()
    for message in messages:
        record.take(message, now_s)


def _system_id(record: Record) -> int:
    assert record.system_id is not None, "find the vehicle before sending requests to it"
    return record.system_id


def open_requests(record: Record) -> Iterator[Message]:
    """The requests that have not been answered yet."""
    system_id = _system_id(record)
    if record.is_ardupilot:
        for name, (number, rate_hz) in _ARDUPILOT_STREAMS_HZ.items():
            if name not in record.latest:
                yield request_rate(system_id, number, rate_hz)
    for name, number in (_ARDUPILOT_ONCE if record.is_ardupilot else _ONCE).items():
        if name not in record.latest:
            yield request_message(system_id, number)
    for name in ARDUPILOT_PARAMETERS if record.is_ardupilot else PARAMETERS:
        if name not in record.parameters:
            yield mavlink.MAVLink_param_request_read_message(
                system_id, AUTOPILOT_COMPONENT_ID, name.encode(), -1
            )
