"""PX4's flight modes: one table of their numbers, names and flags.

Numbers: `px4_custom_mode.h` and `vehicle_status.msg` of PX4; flags: its `get_px4_custom_mode` and
`get_mavlink_navigation_mode`.
"""

from __future__ import annotations

from dataclasses import dataclass

from framerunner.wire import ardupilot_modes
from framerunner.wire.dialect import Message, mavlink

_MANUAL = mavlink.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
_STABILISED = mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED
_AUTO = mavlink.MAV_MODE_FLAG_AUTO_ENABLED | mavlink.MAV_MODE_FLAG_GUIDED_ENABLED | _STABILISED


@dataclass(frozen=True, slots=True)
class Px4Mode:
    """A flight mode."""

    main: int  # main mode of HEARTBEAT.custom_mode
    sub: int  # sub mode
    title: str  # name that ground stations show
    words: str  # name inside a sentence
    px4_name: str = "UNKNOWN"  # short name in PX4's tools and pymavlink
    navigation_state: int = -1  # PX4's internal number, as in logs and events; -1: none
    flags: int = _AUTO  # of HEARTBEAT.base_mode, without armed and custom mode
    standard: int = 0  # MAV_STANDARD_MODE; 0: none

    @property
    def custom_mode(self) -> int:
        """HEARTBEAT.custom_mode: main << 16 | sub << 24."""
        return self.main << 16 | self.sub << 24


_BY_HAND = _MANUAL | _STABILISED
MANUAL = Px4Mode(1, 0, "Manual", "manual", "MANUAL", 0, _BY_HAND)
ALTITUDE = Px4Mode(
    2, 0, "Altitude", "altitude", "ALTCTL", 1, _BY_HAND, mavlink.MAV_STANDARD_MODE_ALTITUDE_HOLD
)
POSITION = Px4Mode(
    3, 0, "Position", "position", "POSCTL", 2, _BY_HAND, mavlink.MAV_STANDARD_MODE_POSITION_HOLD
)
ORBIT = Px4Mode(3, 1, "Orbit", "orbit", "POSCTL", 21, _STABILISED, mavlink.MAV_STANDARD_MODE_ORBIT)
POSITION_SLOW = Px4Mode(3, 2, "Position Slow", "slow position", "POSCTL", 6, _BY_HAND)
READY = Px4Mode(4, 1, "Ready", "ready")
TAKEOFF = Px4Mode(4, 2, "Takeoff", "take-off", "TAKEOFF", 17, _AUTO, mavlink.MAV_STANDARD_MODE_TAKEOFF)
HOLD = Px4Mode(4, 3, "Hold", "hold", "LOITER", 4)
MISSION = Px4Mode(4, 4, "Mission", "mission", "MISSION", 3, _AUTO, mavlink.MAV_STANDARD_MODE_MISSION)
RETURN = Px4Mode(4, 5, "Return", "return", "RTL", 5, _AUTO, mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY)
LAND = Px4Mode(4, 6, "Land", "land", "LAND", 18, _AUTO, mavlink.MAV_STANDARD_MODE_LAND)
FOLLOW = Px4Mode(4, 8, "Follow Me", "follow", "FOLLOWME", 19)
PRECISION_LAND = Px4Mode(4, 9, "Precision Land", "precision land", navigation_state=20)
VTOL_TAKEOFF = Px4Mode(4, 10, "VTOL Takeoff", "VTOL take-off", navigation_state=22)
ACRO = Px4Mode(5, 0, "Acro", "acro", "ACRO", 10, _MANUAL)
OFFBOARD = Px4Mode(6, 0, "Offboard", "offboard", "OFFBOARD", 14, _STABILISED)
STABILIZED = Px4Mode(7, 0, "Stabilized", "stabilised", "STABILIZED", 15, _BY_HAND)
RATTITUDE = Px4Mode(8, 0, "Rattitude", "rattitude", "RATTITUDE", flags=_MANUAL)
SIMPLE = Px4Mode(9, 0, "Simple", "simple", flags=_BY_HAND)
TERMINATION = Px4Mode(10, 0, "Termination", "terminated", navigation_state=13, flags=0)

MODES: tuple[Px4Mode, ...] = tuple(each for each in globals().values() if isinstance(each, Px4Mode))
_BY_NUMBERS = {(mode.main, mode.sub): mode for mode in MODES}
_AUTO_MAIN = 4


def numbers_of(custom_mode: int) -> tuple[int, int]:
    """Main and sub mode of a HEARTBEAT.custom_mode."""
    return (custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF)


def mode_of(custom_mode: int) -> Px4Mode | None:
    """The mode of a HEARTBEAT.custom_mode; None if PX4 has none with these numbers."""
    return _BY_NUMBERS.get(numbers_of(custom_mode))


def mode_title(heartbeat: Message) -> str:
    """The name that ground stations show for a HEARTBEAT's mode; its numbers if the autopilot is unknown."""
    number = heartbeat.custom_mode
    if ardupilot_modes.is_arducopter(heartbeat):
        return ardupilot_modes.mode_title(number)
    custom = heartbeat.base_mode & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    if heartbeat.autopilot != mavlink.MAV_AUTOPILOT_PX4 or not custom:
        return f"mode {number}"
    mode = mode_of(number)
    main, sub = numbers_of(number)
    return f"mode {main}.{sub}" if mode is None else mode.title


def _mode_or_main(custom_mode: int) -> Px4Mode | None:
    """The mode; an unknown sub mode counts as its main mode's first one, except in the auto modes."""
    main, sub = numbers_of(custom_mode)
    return _BY_NUMBERS.get((main, sub if main == _AUTO_MAIN or (main, sub) in _BY_NUMBERS else 0))


def mode_words(custom_mode: int) -> str:
    """The name of a mode inside a sentence; its numbers if it is not one of PX4's."""
    mode = _mode_or_main(custom_mode)
    main, sub = numbers_of(custom_mode)
    return f"mode {main}/{sub}" if mode is None else mode.words


def px4_name(custom_mode: int) -> str:
    """The short name of a mode, such as "LOITER"; "UNKNOWN" if there is none."""
    mode = _mode_or_main(custom_mode)
    return "UNKNOWN" if mode is None else mode.px4_name
