"""The health report: what is there, what fails, and in which modes it could be armed."""

from __future__ import annotations

from dataclasses import dataclass

from firmware_py.mavlink.event_catalogue import ARMING_SUMMARY, CHECKS, HEALTH_SUMMARY, OTHER_CHECK
from firmware_py.mavlink.event_enums import ALL_MODES, MODE_GROUPS, Part
from firmware_py.mavlink.event_model import PROTOCOL_LEVEL, EventKind, Occurrence
from firmware_py.mavlink.port import AutopilotPort
from firmware_py.status import FlightMode
from wire.dialect import mavlink

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


def assess(autopilot: AutopilotPort) -> HealthReport:
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
