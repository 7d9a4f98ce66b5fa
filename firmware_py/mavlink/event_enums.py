"""The enumerations that events use: modes, mode groups, parts of the vehicle. The bits are PX4's.

Names and bits are fixed by what ground stations expect of a health report; descriptions are for people.
"""

from __future__ import annotations

from enum import IntFlag

from firmware_py.status import NAVIGATION_STATES, FlightMode

MODE_GROUPS = NAVIGATION_STATES
"""Each mode is a group of its own, as in PX4."""

ALL_MODES = sum(1 << group for group in MODE_GROUPS.values())

_GROUP_NAMES: dict[FlightMode, str] = {
    FlightMode.ALTITUDE: "altctl",
    FlightMode.POSITION: "posctl",
    FlightMode.HOLD: "loiter",
    FlightMode.RETURN: "rtl",
    FlightMode.STABILIZED: "stab",
    FlightMode.FOLLOW: "follow_target",
}


class Part(IntFlag):
    """Parts of the vehicle, as bits of `health_component_t`."""

    NONE = 1 << 0
    ABSOLUTE_PRESSURE = 1 << 1
    GPS = 1 << 3
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

    @property
    def index(self) -> int:
        """Place of the bit."""
        return int(self).bit_length() - 1


_PART_LABELS: dict[Part, str] = {
    Part.GPS: "Satellite positioning",
    Part.REMOTE_CONTROL: "Sticks",
    Part.ABSOLUTE_PRESSURE: "Barometer",
    Part.ACCEL: "Accelerometer",
    Part.GYRO: "Gyroscope",
}


def enums() -> dict[str, object]:
    """The enumerations in libevents' format."""
    return {
        "flight_mode_t": {
            "type": "uint8_t",
            "description": "Flight mode",
            "entries": {
                str(number): {"name": mode.name.lower(), "description": mode.name.capitalize()}
                for mode, number in MODE_GROUPS.items()
            },
        },
        "navigation_mode_group_t": {
            "type": "uint32_t",
            "description": "Modes that share their checks before arming",
            "is_bitfield": True,
            "entries": {
                str(1 << number): {
                    "name": _GROUP_NAMES.get(mode, mode.name.lower()),
                    "description": mode.name.capitalize(),
                }
                for mode, number in MODE_GROUPS.items()
            },
        },
        "health_component_t": {
            "type": "uint32_t",
            "description": "Parts of the vehicle",
            "is_bitfield": True,
            "entries": {
                str(int(part)): {
                    "name": str(part.name).lower(),
                    "description": _PART_LABELS.get(
                        part, str(part.name).replace("_", " ").lower().capitalize()
                    ),
                }
                for part in Part
            },
        },
    }


def navigation_mode_groups() -> dict[str, object]:
    """Which custom modes each group holds."""
    return {"groups": {str(group): [mode.custom_mode] for mode, group in MODE_GROUPS.items()}}
