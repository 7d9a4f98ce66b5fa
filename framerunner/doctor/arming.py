"""PX4's report of its arming checks: in which modes it could be armed, whichever mode it is in now.

PX4 sends it as EVENTs: a summary, then an event for each failed check, then a summary of its sensors' health
(https://mavlink.io/en/services/events.html; the arguments are those of PX4 1.14 and later).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from wire.dialect import Message

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
    """The latest report.

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
