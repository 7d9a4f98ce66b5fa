"""ArduCopter's flight modes: their numbers in HEARTBEAT.custom_mode and ArduPilot's names.

Numbers: `Mode::Number` in ArduCopter's `mode.h`, version 4.7.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from framerunner.wire.dialect import Message, mavlink

STABILIZE, ACRO, ALT_HOLD, AUTO, GUIDED, LOITER, RTL = range(7)
LAND, BRAKE = 9, 17

NAMES: Mapping[int, str] = MappingProxyType(
    {
        STABILIZE: "STABILIZE",
        ACRO: "ACRO",
        ALT_HOLD: "ALT_HOLD",
        AUTO: "AUTO",
        GUIDED: "GUIDED",
        LOITER: "LOITER",
        RTL: "RTL",
        7: "CIRCLE",
        LAND: "LAND",
        11: "DRIFT",
        13: "SPORT",
        14: "FLIP",
        15: "AUTOTUNE",
        16: "POSHOLD",
        BRAKE: "BRAKE",
        18: "THROW",
        19: "AVOID_ADSB",
        20: "GUIDED_NOGPS",
        21: "SMART_RTL",
        22: "FLOWHOLD",
        23: "FOLLOW",
        24: "ZIGZAG",
        25: "SYSTEMID",
        26: "AUTOROTATE",
        27: "AUTO_RTL",
        28: "TURTLE",
    }
)
MANUAL_MODES = frozenset(
    {"STABILIZE", "ACRO", "ALT_HOLD", "LOITER", "DRIFT", "SPORT", "POSHOLD", "FLOWHOLD", "ZIGZAG"}
)
"""Those that an operator flies with the sticks."""

_MULTICOPTERS = frozenset(
    {
        mavlink.MAV_TYPE_QUADROTOR,
        mavlink.MAV_TYPE_COAXIAL,
        mavlink.MAV_TYPE_HELICOPTER,
        mavlink.MAV_TYPE_HEXAROTOR,
        mavlink.MAV_TYPE_OCTOROTOR,
        mavlink.MAV_TYPE_TRICOPTER,
        mavlink.MAV_TYPE_DODECAROTOR,
        mavlink.MAV_TYPE_DECAROTOR,
    }
)


def is_arducopter(heartbeat: Message) -> bool:
    """Whether a HEARTBEAT is ArduCopter's; ArduPilot's other vehicles number their modes otherwise."""
    is_ardupilot = heartbeat.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    return bool(is_ardupilot and heartbeat.type in _MULTICOPTERS)


def mode_name(custom_mode: int) -> str:
    """The name of a mode, such as "GUIDED"; its number if ArduCopter has none with it."""
    return NAMES.get(custom_mode, f"mode {custom_mode}")


def mode_title(custom_mode: int) -> str:
    """The name of a mode that ground stations show, such as "Alt Hold"."""
    name = NAMES.get(custom_mode)
    if name is None:
        return f"mode {custom_mode}"
    return name if name == "RTL" else name.replace("_", " ").title()
