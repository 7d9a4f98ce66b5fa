"""Which events there are. What the commander says becomes events by itself: each of its texts is one.

A text with a figure in it is matched by a pattern. What neither says stays a text only.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from firmware_py.commander_table import TABLE, Event
from firmware_py.mavlink.event_model import EventKind
from firmware_py.status import CommandResult

_LONGEST_MESSAGE = 120  # libevents' limit
_REFUSAL = "Arming denied: "

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


def _escaped(text: str) -> str:
    return re.sub(r"([\\<{])", r"\\\1", text)


def _texts() -> dict[str, EventKind]:
    said = [row.text for row in TABLE if row.text]
    return {
        text: EventKind(f"says_{_slug(text)}", _escaped(text)[:_LONGEST_MESSAGE]) for text in (*said, *_PLAIN)
    }


def _checks() -> dict[str, EventKind]:
    reasons = [
        row.text
        for row in TABLE
        if row.event is Event.ARM and row.text and row.result is not CommandResult.ACCEPTED
    ]
    return {
        text: EventKind(f"check_{_slug(text)}", _reason(text), "arming_check", _CHECK_ARGUMENTS)
        for text in reasons
    }


def _reason(refusal: str) -> str:
    """A refusal without the words that each begins with, as reports show it below a heading."""
    reason = refusal.removeprefix(_REFUSAL)
    return _escaped(reason[:1].upper() + reason[1:])[:_LONGEST_MESSAGE]


TEXTS: dict[str, EventKind] = _texts()
"""Events by the text that says the same."""

CHECKS: dict[str, EventKind] = _checks()
"""Events of the arming report, by the text that refuses to arm."""


def event_of(text: str) -> tuple[EventKind, tuple[float, ...]] | None:
    """The event that says the same as a text, with its arguments; None when there is none."""
    kind = TEXTS.get(text)
    if kind is not None:
        return kind, ()
    for pattern, kind in _PATTERNS:
        found = pattern.fullmatch(text)
        if found is not None:
            return kind, tuple(float(figure) for figure in found.groups())
    return None


def all_kinds() -> Iterator[EventKind]:
    """Every sort of event there is."""
    yield from (MODE_CHANGED, ARMING_SUMMARY, HEALTH_SUMMARY, OTHER_CHECK)
    yield from (kind for _, kind in _PATTERNS)
    yield from TEXTS.values()
    yield from CHECKS.values()
