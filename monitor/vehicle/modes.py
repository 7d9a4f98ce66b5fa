"""PX4's flight modes, by the numbers in HEARTBEAT and by the names that ground stations show."""

from __future__ import annotations

from pymavlink.dialects.v20 import common as mavlink

Mode = tuple[int, int]  # main mode and sub mode

LAND: Mode = (4, 6)
HOLD: Mode = (4, 3)
TAKE_OFF: Mode = (4, 2)
POSITION: Mode = (3, 0)
OFFBOARD: Mode = (6, 0)

NAMES: dict[Mode, str] = {
    (1, 0): "Manual",
    (2, 0): "Altitude",
    POSITION: "Position",
    (3, 1): "Orbit",
    (3, 2): "Position Slow",
    (4, 1): "Ready",
    TAKE_OFF: "Takeoff",
    HOLD: "Hold",
    (4, 4): "Mission",
    (4, 5): "Return",
    LAND: "Land",
    (4, 8): "Follow Me",
    (4, 9): "Precision Land",
    (4, 10): "VTOL Takeoff",
    (5, 0): "Acro",
    OFFBOARD: "Offboard",
    (7, 0): "Stabilized",
    (8, 0): "Rattitude",
    (9, 0): "Simple",
    (10, 0): "Termination",
}


def mode_of(custom_mode: int) -> Mode:
    """Take HEARTBEAT.custom_mode apart as PX4 puts it together: main << 16 | sub << 24."""
    return (custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF)


def mode_name(autopilot: int, base_mode: int, custom_mode: int) -> str:
    """A name for people.

    Args:
        autopilot: HEARTBEAT.autopilot.
        base_mode: HEARTBEAT.base_mode.
        custom_mode: HEARTBEAT.custom_mode.
    """
    if autopilot != mavlink.MAV_AUTOPILOT_PX4 or not base_mode & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
        return f"mode {custom_mode}"
    main, sub = mode_of(custom_mode)
    return NAMES.get((main, sub), f"mode {main}.{sub}")
