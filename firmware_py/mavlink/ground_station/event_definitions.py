"""The events of MAVLink's events service: each has a number, a message and a few arguments.

A receiver looks the number up in `all_events.json`, in the format of libevents
(https://mavlink.io/en/services/events.html). Each text of the commander is an event; a text with a number in
it is matched by a pattern; other texts have no event. Names and bits of the enumerations are PX4's, as ground
stations expect them of a health report.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import IntFlag
from struct import pack
from typing import Literal

from firmware_py.commander_table import ARMING_DENIED, TABLE, Event
from firmware_py.estimation.report import PROBLEMS
from firmware_py.status import NAVIGATION_STATES, CommandResult, FlightMode
from framerunner.wire.dialect import event_id

COMPONENT = 1  # the upper eight bits of every id: the autopilot
NAMESPACE = "framerunner"
ARGUMENT_BYTES = 40
PROTOCOL_LEVEL = 8  # a log level beyond MAV_SEVERITY: for programs, not shown to people

_FORMATS = {
    "uint8_t": "B",
    "uint16_t": "H",
    "uint32_t": "I",
    "int32_t": "i",
    "float": "f",
    "flight_mode_t": "B",
    "health_component_t": "I",
    "navigation_mode_group_t": "I",
}

Group = Literal["default", "arming_check", "health"]


@dataclass(frozen=True, slots=True)
class EventKind:
    """A kind of event."""

    name: str  # unique; the id is derived from it, so it must not change
    message: str  # one line; {1} is the first argument, {1:.1m} one with a decimal and a unit
    group: Group = "default"  # `arming_check` and `health` are those of the health report
    arguments: tuple[tuple[str, str], ...] = ()  # (type, name) of each
    summary: bool = False  # it begins or ends a health report

    @property
    def sub_id(self) -> int:
        """The lower 24 bits of the id."""
        return self.id & 0xFFFFFF

    @property
    def id(self) -> int:
        """EVENT's id."""
        return event_id(self.name)

    def packed(self, *values: float) -> bytes:
        """EVENT's arguments: the values, padded to 40 bytes."""
        kinds = [kind for kind, _ in self.arguments]
        numbers = (
            value if kind == "float" else int(value) for kind, value in zip(kinds, values, strict=True)
        )
        layout = "<" + "".join(_FORMATS[kind] for kind in kinds)
        return pack(layout, *numbers).ljust(ARGUMENT_BYTES, b"\0")


MODE_GROUPS = NAVIGATION_STATES  # each mode is its own group, as in PX4
ALL_MODES = sum(1 << group for group in MODE_GROUPS.values())

_GROUP_NAMES: dict[FlightMode, str] = {
    FlightMode.ALTITUDE: "altctl",
    FlightMode.POSITION: "posctl",
    FlightMode.HOLD: "loiter",
    FlightMode.RETURN: "rtl",
    FlightMode.STABILIZED: "stab",
    FlightMode.FOLLOW: "follow_target",
}


class HealthComponent(IntFlag):
    """Parts of the vehicle, as bits of `health_component_t`."""

    NONE = 1 << 0
    ABSOLUTE_PRESSURE = 1 << 1
    GPS = 1 << 3
    OPTICAL_FLOW = 1 << 4
    VISION_POSITION = 1 << 5
    DISTANCE_SENSOR = 1 << 6
    REMOTE_CONTROL = 1 << 7
    BATTERY = 1 << 11
    COMMUNICATION_LINKS = 1 << 12
    ATTITUDE_ESTIMATE = 1 << 16
    LOCAL_POSITION_ESTIMATE = 1 << 17
    MISSION = 1 << 18
    SYSTEM = 1 << 20
    GLOBAL_POSITION_ESTIMATE = 1 << 24
    MAGNETOMETER = 1 << 27
    ACCEL = 1 << 28
    GYRO = 1 << 29


_PART_LABELS: dict[HealthComponent, str] = {
    HealthComponent.GPS: "Satellite positioning",
    HealthComponent.REMOTE_CONTROL: "Sticks",
    HealthComponent.ABSOLUTE_PRESSURE: "Barometer",
    HealthComponent.ACCEL: "Accelerometer",
    HealthComponent.GYRO: "Gyroscope",
}


def enums() -> dict[str, object]:
    """The enumerations in libevents' format."""
    parts = {
        int(part): (part.name, _PART_LABELS.get(part, str(part.name).replace("_", " ").capitalize()))
        for part in HealthComponent
    }
    groups = {
        1 << number: (_GROUP_NAMES.get(mode, mode.name), mode.name.capitalize())
        for mode, number in MODE_GROUPS.items()
    }
    modes = {number: (mode.name, mode.name.capitalize()) for mode, number in MODE_GROUPS.items()}
    return {
        "flight_mode_t": _enum("uint8_t", "Flight mode", modes),
        "navigation_mode_group_t": _enum("uint32_t", "Modes that share their checks before arming", groups)
        | {"is_bitfield": True},
        "health_component_t": _enum("uint32_t", "Parts of the vehicle", parts) | {"is_bitfield": True},
    }


def _enum(kind: str, description: str, entries: Mapping[int, tuple[str | None, str]]) -> dict[str, object]:
    """An enumeration from the name and the description of each number."""
    return {
        "type": kind,
        "description": description,
        "entries": {
            str(number): {"name": str(name).lower(), "description": words}
            for number, (name, words) in entries.items()
        },
    }


def navigation_mode_groups() -> dict[str, object]:
    """Which custom modes each group holds."""
    return {"groups": {str(group): [mode.custom_mode] for mode, group in MODE_GROUPS.items()}}


_MAX_MESSAGE = 120  # libevents' limit

MODE_CHANGED = EventKind("mode_changed", "Mode: {1}", arguments=(("flight_mode_t", "mode"),))

_REPORT = (("uint8_t", "chunk_idx"),)
ARMING_SUMMARY = EventKind(
    "arming_check_summary",
    "Arming check summary",
    "arming_check",
    (
        *_REPORT,
        ("health_component_t", "error"),
        ("health_component_t", "warning"),
        ("navigation_mode_group_t", "can_arm"),
        ("navigation_mode_group_t", "can_run"),
    ),
    summary=True,
)
HEALTH_SUMMARY = EventKind(
    "health_summary",
    "Health summary",
    "health",
    (
        *_REPORT,
        ("health_component_t", "is_present"),
        ("health_component_t", "error"),
        ("health_component_t", "warning"),
    ),
    summary=True,
)
_CHECK_ARGUMENTS = (("navigation_mode_group_t", "modes"), ("uint8_t", "health_component_index"))
OTHER_CHECK = EventKind("check_other", "Not ready to arm", "arming_check", _CHECK_ARGUMENTS)

_PATTERNS: tuple[tuple[re.Pattern[str], EventKind], ...] = tuple(
    (re.compile(pattern), EventKind(name, message, arguments=(("float", "value"),)))
    for pattern, name, message in (
        (
            r"Using default takeoff altitude: ([\d.]+) m",
            "takeoff_default_altitude",
            "Using default takeoff altitude: {1:.1m_v}",
        ),
        (r"Mission item (\d+) reached", "mission_item_reached", "Mission item {1:.0} reached"),
    )
)
_PLAIN = (
    "Landing detected",
    "Takeoff detected",
    "Already higher than takeoff altitude",
    "Takeoff denied: altitude is infinite",
    "Offboard setpoint ignored: no position or velocity",
)


def _slug(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_")


def _message(text: str) -> str:
    return re.sub(r"([\\<{])", r"\\\1", text)[:_MAX_MESSAGE]


def _check(refusal: str) -> EventKind:
    """The event of a refusal, without its first words, as reports show it below a heading."""
    reason = refusal.removeprefix(ARMING_DENIED)
    message = _message(reason[:1].upper() + reason[1:])
    return EventKind(f"check_{_slug(refusal)}", message, "arming_check", _CHECK_ARGUMENTS)


_REFUSALS = (
    *(
        row.text
        for row in TABLE
        if row.event is Event.ARM and row.text and row.result is not CommandResult.ACCEPTED
    ),
    *(f"{ARMING_DENIED}{problem}" for problem in PROBLEMS),
)
# Events by their texts.
TEXTS: dict[str, EventKind] = {
    text: EventKind(f"says_{_slug(text)}", _message(text))
    for text in (*(row.text for row in TABLE if row.text), *_REFUSALS, *_PLAIN)
}
# Events of the arming report, by the text that refuses to arm.
CHECKS: dict[str, EventKind] = {text: _check(text) for text in _REFUSALS}


def event_of(text: str) -> tuple[EventKind, tuple[float, ...]] | None:
    """The event of a text, with its arguments; None when there is none."""
    kind = TEXTS.get(text)
    if kind is not None:
        return kind, ()
    for pattern, kind in _PATTERNS:
        found = pattern.fullmatch(text)
        if found is not None:
            return kind, tuple(float(number) for number in found.groups())
    return None


def all_kinds() -> Iterator[EventKind]:
    """Every kind of event."""
    yield from (MODE_CHANGED, ARMING_SUMMARY, HEALTH_SUMMARY, OTHER_CHECK)
    yield from (kind for _, kind in _PATTERNS)
    yield from TEXTS.values()
    yield from CHECKS.values()
