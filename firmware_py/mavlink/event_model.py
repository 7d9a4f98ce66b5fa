"""Events: what MAVLink's events service tells by a number and a few arguments, and what that number means.

A receiver looks the number up in `all_events.json`, in the format of libevents
(https://mavlink.io/en/services/events.html).
"""

from __future__ import annotations

from dataclasses import dataclass
from struct import pack
from typing import Literal

COMPONENT = 1
"""The upper eight bits of every id: the autopilot."""
NAMESPACE = "framerunner"
ARGUMENT_BYTES = 40
PROTOCOL_LEVEL = 8
"""A log level beyond MAV_SEVERITY: for programs, not shown to people."""

_FNV_OFFSET, _FNV_PRIME = 0x811C9DC5, 0x01000193
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
    """A sort of event.

    Attributes:
        name: unique; the number is derived from it, so it must not change.
        message: one line for people; {1} is the first argument, {1:.1m} one with a decimal and a unit.
        group: `arming_check` and `health` are those of the health report.
        arguments: (type, name) of each.
        summary: it begins or ends a health report.
        description: whole sentences.
    """

    name: str
    message: str
    group: Group = "default"
    arguments: tuple[tuple[str, str], ...] = ()
    summary: bool = False
    description: str = ""

    @property
    def sub_id(self) -> int:
        """The lower 24 bits of the id: those of the name's 32 bit FNV-1a hash, as PX4 takes them."""
        value = _FNV_OFFSET
        for byte in self.name.encode():
            value = (value ^ byte) * _FNV_PRIME & 0xFFFFFFFF
        return value & 0xFFFFFF

    @property
    def id(self) -> int:
        """What EVENT carries."""
        return COMPONENT << 24 | self.sub_id

    def packed(self, *values: float) -> bytes:
        """The arguments as EVENT carries them, padded to 40 bytes."""
        layout = "<" + "".join(_FORMATS[kind] for kind, _ in self.arguments)
        whole = (value if kind == "float" else int(value) for (kind, _), value in self._paired(values))
        return pack(layout, *whole).ljust(ARGUMENT_BYTES, b"\0")

    def _paired(self, values: tuple[float, ...]) -> list[tuple[tuple[str, str], float]]:
        return list(zip(self.arguments, values, strict=True))


@dataclass(frozen=True, slots=True)
class Occurrence:
    """One event that happened.

    Attributes:
        kind: what it is.
        severity: MAV_SEVERITY, or `PROTOCOL_LEVEL`.
        values: of the arguments.
    """

    kind: EventKind
    severity: int
    values: tuple[float, ...] = ()

    @property
    def log_levels(self) -> int:
        """For people in the lower four bits, for logs in the upper ones."""
        return self.severity << 4 | self.severity
