"""The events service: EVENT with its sequence, and what was missed again on request.

As PX4: sequences begin at 65525, so that they soon wrap; CURRENT_EVENT_SEQUENCE comes every three seconds;
the last twenty events can be asked for again. RUN_PREARM_CHECKS sends the health report again, which MAVSDK
and QGroundControl ask for when they connect.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.ground_station.event_definitions import (
    ALL_MODES,
    ARMING_SUMMARY,
    CHECKS,
    HEALTH_SUMMARY,
    MODE_CHANGED,
    MODE_GROUPS,
    OTHER_CHECK,
    PROTOCOL_LEVEL,
    EventKind,
    Occurrence,
    Part,
    event_of,
)
from firmware_py.mavlink.service import Command, Service
from firmware_py.status import CommandResult, FlightMode
from firmware_py.types import StatusText
from wire.dialect import Message, boot_ms, mavlink
from wire.exchange import Exchange
from wire.link import Link

_FIRST_SEQUENCE = 65525
_KEPT = 20
_SEQUENCE_PERIOD_US = 3_000_000
_HEALTH_PERIOD_US = 100_000  # between looks
_REPORT_GAP_US = 2_000_000  # between reports that nobody asked for
_LEAST_SEVERE = mavlink.MAV_SEVERITY_DEBUG
_UNARMABLE = sum(
    1 << MODE_GROUPS[mode]
    for mode in (
        FlightMode.RETURN,
        FlightMode.LAND,
        FlightMode.ORBIT,
        FlightMode.FOLLOW,
        FlightMode.TERMINATION,
    )
)
_ALWAYS_THERE = Part.GYRO | Part.ACCEL | Part.MAGNETOMETER | Part.ABSOLUTE_PRESSURE | Part.ATTITUDE_ESTIMATE
_PLACED = Part.GPS | Part.LOCAL_POSITION_ESTIMATE | Part.GLOBAL_POSITION_ESTIMATE
_LOW_BATTERY = 2  # MAV_BATTERY_CHARGE_STATE_LOW

# What a reason is about, by a word in it, and whether it hinders the chosen mode only.
_SUBJECTS: tuple[tuple[str, Part, bool], ...] = (
    ("battery", Part.BATTERY, False),
    ("ground station", Part.COMMUNICATION_LINKS, False),
    ("side", Part.ATTITUDE_ESTIMATE, False),
    ("attitude", Part.ATTITUDE_ESTIMATE, False),
    ("setpoint", Part.SYSTEM, True),
    ("manual", Part.REMOTE_CONTROL, True),
    ("stick", Part.REMOTE_CONTROL, True),
    ("mission", Part.MISSION, True),
    ("position", Part.LOCAL_POSITION_ESTIMATE, True),
    ("mode", Part.SYSTEM, True),
    ("not in ", Part.SYSTEM, True),
)


@dataclass(frozen=True, slots=True)
class Check:
    """What hinders arming.

    Attributes:
        kind: the event that says so.
        part: what it is about.
        modes: groups of modes that it hinders, as bits.
    """

    kind: EventKind
    part: Part
    modes: int


@dataclass(frozen=True, slots=True)
class HealthReport:
    """A report; equal ones need not be sent twice.

    Attributes:
        present: parts there are.
        failing: of these, those that do not work.
        warning: those to be looked after.
        check: what hinders arming.
    """

    present: Part
    failing: Part
    warning: Part
    check: Check | None

    def events(self) -> list[Occurrence]:
        """The events of the report, in their order: summary, checks, summary."""
        check = self.check
        hindered = _UNARMABLE | (check.modes if check else 0)
        error = check.part if check else Part(0)
        events = [
            Occurrence(
                ARMING_SUMMARY,
                PROTOCOL_LEVEL,
                (0, error, self.warning, ALL_MODES & ~hindered, ALL_MODES),
            )
        ]
        if check is not None:
            events.append(Occurrence(check.kind, mavlink.MAV_SEVERITY_ERROR, (check.modes, check.part.index)))
        health = (0, self.present, self.failing, self.warning)
        events.append(Occurrence(HEALTH_SUMMARY, PROTOCOL_LEVEL, health))
        return events


def assess(autopilot: Autopilot) -> HealthReport:
    """The report as it is now."""
    status = autopilot.status
    present, failing = _ALWAYS_THERE, Part(0)
    if status.origin is not None:
        present |= _PLACED
    else:
        failing |= Part.LOCAL_POSITION_ESTIMATE
    present |= Part.BATTERY
    warning = Part.BATTERY if autopilot.battery.warning >= _LOW_BATTERY else Part(0)
    check = None if status.ready else _check(status.not_ready, status.intended_mode)
    return HealthReport(present, failing, warning, check)


def _check(reason: str, intended: FlightMode) -> Check:
    kind = CHECKS.get(reason, OTHER_CHECK)
    said = reason.lower()
    for word, part, this_mode_only in _SUBJECTS:
        if word in said:
            return Check(kind, part, 1 << MODE_GROUPS[intended] if this_mode_only else ALL_MODES)
    return Check(kind, Part.SYSTEM, ALL_MODES)


class EventService(Service):
    """Tells events, on all links."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        self._autopilot = autopilot
        self._exchange = exchange
        self._sequence = _FIRST_SEQUENCE
        self._sequence_due_us = 0
        self._recent: deque[tuple[int, Message]] = deque(maxlen=_KEPT)
        self._mode = autopilot.status.mode
        self._asked = False
        self._health_due_us = 0
        self._report: HealthReport | None = None
        self._report_us = -_REPORT_GAP_US
        self.handlers = {mavlink.MAVLINK_MSG_ID_REQUEST_EVENT: self._resend}
        self.commands = {mavlink.MAV_CMD_RUN_PREARM_CHECKS: self._run_checks}

    def send_text(self, text: StatusText) -> bool:
        """Send the event that says the same as a text, if there is one.

        Returns:
            Whether there is; the text then ends with a tab, so that who reads events leaves it out.
        """
        found = event_of(text.text)
        if found is None:
            return False
        kind, values = found
        self.send(Occurrence(kind, min(max(text.severity, 0), _LEAST_SEVERE), values))
        return True

    def send(self, occurrence: Occurrence) -> None:
        """Send an event and keep it for those who miss it."""
        self._sequence = self._sequence + 1 & 0xFFFF
        message = mavlink.MAVLink_event_message(
            0,
            0,
            occurrence.kind.id,
            boot_ms(self._exchange.time_us),
            self._sequence,
            occurrence.log_levels,
            list(occurrence.kind.packed(*occurrence.values)),
        )
        self._recent.append((self._sequence, message))
        self._exchange.broadcast(message)

    def update(self) -> None:
        """Send what is due."""
        now_us = self._exchange.time_us
        mode = self._autopilot.status.mode
        if mode is not self._mode:
            self._mode = mode
            self.send(Occurrence(MODE_CHANGED, mavlink.MAV_SEVERITY_INFO, (MODE_GROUPS[mode],)))
        if now_us >= self._sequence_due_us:
            self._sequence_due_us = now_us + _SEQUENCE_PERIOD_US
            flags = 0 if self._recent else mavlink.MAV_EVENT_CURRENT_SEQUENCE_FLAGS_RESET
            message = mavlink.MAVLink_current_event_sequence_message(self._sequence, flags)
            self._exchange.broadcast(message)
        if now_us >= self._health_due_us:
            self._health_due_us = now_us + _HEALTH_PERIOD_US
            self._report_health(now_us)

    def _report_health(self, now_us: int) -> None:
        if not self._asked and now_us - self._report_us < _REPORT_GAP_US:
            return
        report = assess(self._autopilot)
        if report == self._report and not self._asked:
            return
        self._asked, self._report, self._report_us = False, report, now_us
        for occurrence in report.events():
            self.send(occurrence)

    def _run_checks(self, _command: Command) -> CommandResult:
        """RUN_PREARM_CHECKS: they run all the time; the report is sent again."""
        self._asked = True
        self._health_due_us = 0
        armed = self._autopilot.status.armed
        return CommandResult.TEMPORARILY_REJECTED if armed else CommandResult.ACCEPTED

    def _resend(self, link: Link, message: Message) -> None:
        """REQUEST_EVENT: what is still there, and one RESPONSE_EVENT_ERROR for what is not."""
        if not self._exchange.is_for_us(message):
            return
        first, last = message.first_sequence, message.last_sequence
        span = last - first & 0xFFFF
        kept = [(sequence - first & 0xFFFF, event) for sequence, event in self._recent]
        wanted = [(distance, event) for distance, event in kept if distance <= span]
        if not wanted or wanted[0][0] > 0:
            self._exchange.send(link, self._unavailable(message, first))
        for _, event in wanted:
            self._exchange.send(link, event)

    def _unavailable(self, request: Message, sequence: int) -> Message:
        after = [kept for kept, _ in self._recent if 0 < (kept - sequence & 0xFFFF) < 0x8000]
        return mavlink.MAVLink_response_event_error_message(
            request.get_srcSystem(),
            request.get_srcComponent(),
            sequence,
            after[0] if after else self._sequence,
            mavlink.MAV_EVENT_ERROR_REASON_UNAVAILABLE,
        )
