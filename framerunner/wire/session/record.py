"""All that a vehicle has sent in a session, for programs that judge it."""

from __future__ import annotations

import struct
from collections import deque
from dataclasses import dataclass
from math import dist, isfinite, nan

from framerunner.wire import ardupilot_modes
from framerunner.wire.dialect import (
    AUTOPILOT_COMPONENT_ID,
    BROADCAST,
    Message,
    event_id,
    is_vehicle,
    mavlink,
)
from framerunner.wire.framing import SequenceCounter
from framerunner.wire.px4_modes import mode_words
from framerunner.wire.session.estimator import EstimatorStatus
from framerunner.wire.session.senders import Senders
from framerunner.wire.session.session import Heartbeat, ParameterValue, Session
from framerunner.wire.status_text import TextAssembler

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


class Record(Session):
    """A session that keeps what its vehicle sends; see `Session` for the arguments.

    Attributes:
        heard_s: wall time of its autopilot's latest packet.
        listened_s: wall time until which it was listened to.
        latest: by name, from its autopilot.
        counts: messages received, by name.
        times_s: wall time of the first and the latest, by name.
        packets: of the autopilot.
        octets: bytes of the autopilot's packets.
        cameras: component ids.
        stations: (system, component) of ground stations on the same link.
        parameters: by name, as numbers.
        modes: names of the modes that it lists, by custom_mode.
        texts: with severity.
        clock_ms: first and latest vehicle time, with wall time in seconds.
        places: local positions, NED metres.
        arming: see `ArmingReport`.
        senders: of the autopilot's packets.
    """

    def __init__(
        self,
        own_system_id: int = BROADCAST,
        system_id: int | None = None,
        *,
        heartbeat: Heartbeat = "none",
    ) -> None:
        super().__init__(own_system_id, system_id, heartbeat=heartbeat)
        self.heard_s = self.listened_s = 0.0
        self.latest: dict[str, Message] = {}
        self.counts: dict[str, int] = {}
        self.times_s: dict[str, tuple[float, float]] = {}
        self.packets = SequenceCounter()
        self.octets = 0
        self.cameras: set[int] = set()
        self.stations: set[tuple[int, int]] = set()
        self.parameters: dict[str, float] = {}
        self.modes: dict[int, str] = {}
        self.texts: deque[tuple[int, str]] = deque(maxlen=TEXTS_KEPT)
        self.clock_ms: list[tuple[int, float]] = []
        self.places: list[tuple[float, float, float]] = []
        self.arming = ArmingReport()
        self.senders = Senders()
        self._texts = TextAssembler()

    def take(self, message: Message, now_s: float) -> bool:
        """Take any message, received at a wall time in seconds; see `Session.take`."""
        is_newest, kind = super().take(message, now_s), message.get_type()
        if kind == "HEARTBEAT":
            self._note_others(message)
        if not self.is_from_autopilot(message):
            return False
        self.heard_s = now_s
        self.packets.take(message.get_seq())
        self.senders.take(message)
        self.octets += len(message.get_msgbuf())
        self.latest[kind] = message
        self.counts[kind] = self.counts.get(kind, 0) + 1
        self.times_s[kind] = (self.times_s.get(kind, (now_s, now_s))[0], now_s)
        if kind == "LOCAL_POSITION_NED" and is_newest:
            self.places.append((message.x, message.y, message.z))
        elif kind == "ATTITUDE":
            self.clock_ms[1:] = [(message.time_boot_ms, now_s)]
        elif kind == "STATUSTEXT":
            self._take_text(message, now_s)
        elif kind == "EVENT":
            self.arming.take(message)
        elif kind == "PARAM_VALUE":
            value = ParameterValue.of(message, bytewise=not self.is_ardupilot).value
            if isfinite(value):
                self.parameters[message.param_id] = value
        elif kind == "AVAILABLE_MODES" and not message.mode_name.startswith("("):  # "(": PX4 does not use it
            self.modes[message.custom_mode] = message.mode_name
        return is_newest

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
    def autopilot_name(self) -> str:
        """The kind of autopilot in words."""
        number = self.telemetry.autopilot
        return "unknown" if number is None else _AUTOPILOTS.get(number, f"autopilot {number}")

    @property
    def charge(self) -> tuple[float, float]:
        """Of the battery by SYS_STATUS, percent and volts; NaN: not reported."""
        status = self.latest.get("SYS_STATUS")
        if status is None:
            return nan, nan
        percent = nan if status.battery_remaining < 0 else float(status.battery_remaining)
        return percent, nan if status.voltage_battery in (0, 65535) else status.voltage_battery / 1000

    @property
    def estimator(self) -> EstimatorStatus | None:
        """What its estimator reports; None: nothing."""
        message = self.latest.get("EKF_STATUS_REPORT" if self.is_ardupilot else "ESTIMATOR_STATUS")
        return None if message is None else EstimatorStatus.of(message)

    @property
    def has_global_position(self) -> bool:
        """It knows where on Earth it is, so its fence has an effect."""
        estimator = self.estimator
        is_placed = estimator is not None and estimator.has_global_position
        return is_placed and "GPS_GLOBAL_ORIGIN" in self.latest

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

    def _note_others(self, message: Message) -> None:
        if is_vehicle(message):
            return
        if message.type == mavlink.MAV_TYPE_GCS:
            self.stations.add((message.get_srcSystem(), message.get_srcComponent()))
        elif message.type == mavlink.MAV_TYPE_CAMERA:
            self.cameras.add(message.get_srcComponent())

    def _take_text(self, message: Message, now_s: float) -> None:
        for status_text in self._texts.take(message, AUTOPILOT_COMPONENT_ID, now_s):
            text = (status_text.severity, " ".join(status_text.text.split()))
            if text not in self.texts:
                self.texts.append(text)
