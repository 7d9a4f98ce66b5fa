"""The events service: EVENT with its sequence number, and missed events on request.

As PX4: sequence numbers begin at 65525, so that they soon wrap; CURRENT_EVENT_SEQUENCE is sent every three
seconds; the last twenty events can be requested. RUN_PREARM_CHECKS sends the health report, which MAVSDK and
QGroundControl request when they connect.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from firmware_py.autopilot import Autopilot
from firmware_py.commander_guards import UNARMABLE
from firmware_py.estimation.report import NO_FIX, NO_HEIGHT, EstimatorReport, Sensor
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
    HealthComponent,
    event_of,
)
from firmware_py.mavlink.service import AutopilotService, VehicleCommand
from firmware_py.status import CommandResult, FlightMode
from firmware_py.types import StatusText
from framerunner.wire.dialect import Message, boot_ms, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

_FIRST_SEQUENCE = 65525
_KEPT = 20
_SEQUENCE_PERIOD_US = 3_000_000
_HEALTH_PERIOD_US = 100_000  # between assessments
_REPORT_GAP_US = 2_000_000  # between unrequested reports
_UNARMABLE = sum(1 << MODE_GROUPS[mode] for mode in UNARMABLE)
_SENSOR_PARTS = {
    Sensor.GYROSCOPE: HealthComponent.GYRO,
    Sensor.ACCELEROMETER: HealthComponent.ACCEL,
    Sensor.MAGNETOMETER: HealthComponent.MAGNETOMETER,
    Sensor.BAROMETER: HealthComponent.ABSOLUTE_PRESSURE,
    Sensor.GPS: HealthComponent.GPS,
    Sensor.EXTERNAL_POSE: HealthComponent.VISION_POSITION,
    Sensor.RANGE_FINDER: HealthComponent.DISTANCE_SENSOR,
    Sensor.OPTICAL_FLOW: HealthComponent.OPTICAL_FLOW,
}
_LOW_BATTERY = 2  # MAV_BATTERY_CHARGE_STATE_LOW

# The part that a reason is about, by a word in it, and whether it prevents the chosen mode only.
_SUBJECTS: tuple[tuple[str, HealthComponent, bool], ...] = (
    (NO_FIX.lower(), HealthComponent.GPS, True),
    *((sensor.value.lower(), part, False) for sensor, part in _SENSOR_PARTS.items()),
    ("imu ", HealthComponent.ACCEL, False),
    (NO_HEIGHT, HealthComponent.LOCAL_POSITION_ESTIMATE, False),
    ("battery", HealthComponent.BATTERY, False),
    ("ground station", HealthComponent.COMMUNICATION_LINKS, False),
    ("side", HealthComponent.ATTITUDE_ESTIMATE, False),
    ("attitude", HealthComponent.ATTITUDE_ESTIMATE, False),
    ("setpoint", HealthComponent.SYSTEM, True),
    ("manual", HealthComponent.REMOTE_CONTROL, True),
    ("stick", HealthComponent.REMOTE_CONTROL, True),
    ("mission", HealthComponent.MISSION, True),
    ("position", HealthComponent.LOCAL_POSITION_ESTIMATE, True),
    ("mode", HealthComponent.SYSTEM, True),
    ("not in ", HealthComponent.SYSTEM, True),
)


@dataclass(frozen=True, slots=True)
class ArmingCheck:
    """What prevents arming: its event, the part it is about, and the groups of modes it prevents, as bits."""

    kind: EventKind
    part: HealthComponent
    modes: int


@dataclass(frozen=True, slots=True)
class HealthReport:
    """Parts that are present, failing or near it, and what prevents arming."""

    present: HealthComponent
    failing: HealthComponent
    warning: HealthComponent
    check: ArmingCheck | None


def assess(autopilot: Autopilot) -> HealthReport:
    """The present report."""
    status = autopilot.status
    present, failing = _parts(autopilot.estimator.report())
    if status.origin is not None:
        present |= HealthComponent.GLOBAL_POSITION_ESTIMATE
    present |= HealthComponent.BATTERY
    warning = HealthComponent.BATTERY if autopilot.battery.warning >= _LOW_BATTERY else HealthComponent(0)
    check = None if status.ready else _check(status.not_ready, status.intended_mode)
    return HealthReport(present, failing, warning, check)


def _parts(report: EstimatorReport) -> tuple[HealthComponent, HealthComponent]:
    """Parts that an estimator with these sensors has, and those of them that fail."""
    present = HealthComponent.ATTITUDE_ESTIMATE | HealthComponent.LOCAL_POSITION_ESTIMATE
    failing = HealthComponent(0)
    for sensor in report.present:
        part = _SENSOR_PARTS[sensor]
        present |= part
        if sensor not in report.healthy:
            failing |= part
    if not report.has_attitude:
        failing |= HealthComponent.ATTITUDE_ESTIMATE
    if not report.has_position:
        failing |= HealthComponent.LOCAL_POSITION_ESTIMATE
    return present, failing


def _check(reason: str, intended: FlightMode) -> ArmingCheck:
    kind = CHECKS.get(reason, OTHER_CHECK)
    said = reason.lower()
    for word, part, this_mode_only in _SUBJECTS:
        if word in said:
            return ArmingCheck(kind, part, 1 << MODE_GROUPS[intended] if this_mode_only else ALL_MODES)
    return ArmingCheck(kind, HealthComponent.SYSTEM, ALL_MODES)


class EventService(AutopilotService):
    """Sends events, on all links."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        super().__init__(autopilot, exchange)
        self._sequence = _FIRST_SEQUENCE
        self._sequence_due_us = 0
        self._recent: deque[tuple[int, Message]] = deque(maxlen=_KEPT)
        self._mode = autopilot.status.mode
        self._report_requested = False
        self._health_due_us = 0
        self._report: HealthReport | None = None
        self._report_us = -_REPORT_GAP_US
        self.handlers = {mavlink.MAVLINK_MSG_ID_REQUEST_EVENT: self._resend}
        self.commands = {mavlink.MAV_CMD_RUN_PREARM_CHECKS: self._run_checks}

    def send_text(self, text: StatusText) -> bool:
        """Send the event of a text, if there is one; whether there is."""
        found = event_of(text.text)
        if found is None:
            return False
        kind, values = found
        self._send(kind, min(max(text.severity, 0), mavlink.MAV_SEVERITY_DEBUG), *values)
        return True

    def _send(self, kind: EventKind, severity: int, *values: float) -> None:
        """Send an event and keep it for receivers that miss it; severity may be `PROTOCOL_LEVEL`."""
        self._sequence = self._sequence + 1 & 0xFFFF
        message = mavlink.MAVLink_event_message(
            0,
            0,
            kind.id,
            boot_ms(self._exchange.time_us),
            self._sequence,
            severity << 4 | severity,  # for logs and for people
            list(kind.packed(*values)),
        )
        self._recent.append((self._sequence, message))
        self._exchange.broadcast(message)

    def update(self) -> None:
        """Send what is due."""
        now_us = self._exchange.time_us
        mode = self._autopilot.status.mode
        if mode is not self._mode:
            self._mode = mode
            self._send(MODE_CHANGED, mavlink.MAV_SEVERITY_INFO, MODE_GROUPS[mode])
        if now_us >= self._sequence_due_us:
            self._sequence_due_us = now_us + _SEQUENCE_PERIOD_US
            flags = 0 if self._recent else mavlink.MAV_EVENT_CURRENT_SEQUENCE_FLAGS_RESET
            message = mavlink.MAVLink_current_event_sequence_message(self._sequence, flags)
            self._exchange.broadcast(message)
        if now_us >= self._health_due_us:
            self._health_due_us = now_us + _HEALTH_PERIOD_US
            if self._report_requested or now_us - self._report_us >= _REPORT_GAP_US:
                report = assess(self._autopilot)
                if self._report_requested or report != self._report:
                    self._report_requested, self._report, self._report_us = False, report, now_us
                    self._send_report(report)

    def _send_report(self, report: HealthReport) -> None:
        """Send the events of a report, in their order: summary, check, summary."""
        check, prevented, error = report.check, _UNARMABLE, HealthComponent(0)
        if check is not None:
            prevented, error = prevented | check.modes, check.part
        self._send(
            ARMING_SUMMARY, PROTOCOL_LEVEL, 0, error, report.warning, ALL_MODES & ~prevented, ALL_MODES
        )
        if check is not None:
            bit_number = int(check.part).bit_length() - 1
            self._send(check.kind, mavlink.MAV_SEVERITY_ERROR, check.modes, bit_number)
        self._send(HEALTH_SUMMARY, PROTOCOL_LEVEL, 0, report.present, report.failing, report.warning)

    def _run_checks(self, _command: VehicleCommand) -> CommandResult:
        """RUN_PREARM_CHECKS: they run all the time; the report is sent again."""
        self._report_requested = True
        self._health_due_us = 0
        armed = self._autopilot.status.armed
        return CommandResult.TEMPORARILY_REJECTED if armed else CommandResult.ACCEPTED

    def _resend(self, link: Link, message: Message) -> None:
        """REQUEST_EVENT: send the kept events, and one RESPONSE_EVENT_ERROR if others were requested."""
        if not self._exchange.is_for_us(message):
            return
        first, last = message.first_sequence, message.last_sequence
        span = last - first & 0xFFFF
        kept = [(sequence - first & 0xFFFF, event) for sequence, event in self._recent]
        requested = [(distance, event) for distance, event in kept if distance <= span]
        if not requested or requested[0][0] > 0:
            self._exchange.send(link, self._unavailable(message, first))
        for _, event in requested:
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
