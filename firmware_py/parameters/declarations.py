"""All parameters there are, sorted by name, as they are numbered on MAVLink."""

from __future__ import annotations

from firmware_py.parameters import (
    attitude,
    battery,
    commander,
    failsafes,
    manual,
    missions,
    position_control,
    system,
)
from firmware_py.parameters.model import Parameter

_GROUPS = (
    commander.COMMANDER,
    failsafes.FAILSAFES,
    failsafes.FAILURES,
    failsafes.BREAKERS,
    position_control.POSITION,
    position_control.TAKEOFF_AND_LAND,
    position_control.HEADING,
    attitude.ATTITUDE,
    attitude.ACRO,
    attitude.LANDING,
    missions.MISSIONS,
    missions.RETURN,
    missions.GEOFENCE,
    battery.BATTERY,
    battery.SIMULATED_BATTERY,
    manual.INPUT,
    manual.STICKS,
    manual.STICK_DEADZONE,
    manual.ORBIT,
    manual.FOLLOW,
    system.MAVLINK,
    system.SYSTEM,
    system.LOGGING,
    system.CALIBRATION,
    system.CHANNELS,
    system.MODE_SLOTS,
)

DECLARATIONS: tuple[Parameter, ...] = tuple(
    sorted((declared for group in _GROUPS for declared in group.declarations), key=lambda each: each.name)
)
