"""Commands about missions: start, and choose the item to fly."""

from __future__ import annotations

from math import isfinite

from firmware_py.mavlink.exchange import Exchange
from firmware_py.status import CommandResult, FlightMode
from wire.dialect import mavlink


def start(exchange: Exchange, first: float) -> CommandResult:
    """MAV_CMD_MISSION_START: switch to mission mode and arm.

    Args:
        exchange: with the autopilot.
        first: param 1, the item to begin with; -1: where the mission is. Param 2, the last item, counts for
            nothing, as in PX4.

    Returns:
        DENIED without a mission that can be flown or without such an item, TEMPORARILY_REJECTED when the mode
        or arming is refused; the reason is said.
    """
    autopilot = exchange.autopilot
    store = autopilot.missions
    if not store.valid:
        autopilot.say(mavlink.MAV_SEVERITY_CRITICAL, "Mission start denied! No valid mission")
        return CommandResult.DENIED
    if not isfinite(first) or not -1 <= first < len(store.mission.items):
        autopilot.say(
            mavlink.MAV_SEVERITY_CRITICAL,
            f"Mission start denied! No item {first:g}, there are {len(store.mission.items)}",
        )
        return CommandResult.DENIED
    if first >= 0:
        store.select(int(first))
    result = autopilot.set_mode(FlightMode.MISSION)
    if result is CommandResult.ACCEPTED and not autopilot.status.armed:
        result = autopilot.arm()
    return result if result is CommandResult.ACCEPTED else CommandResult.TEMPORARILY_REJECTED


def set_current(exchange: Exchange, seq: float) -> CommandResult:
    """MAV_CMD_DO_SET_MISSION_CURRENT, which PX4 does not know: param 1 is the item to fly next.

    Returns:
        DENIED when there is no such item, with the reason as text.
    """
    autopilot = exchange.autopilot
    if isfinite(seq) and autopilot.missions.select(int(seq)):
        return CommandResult.ACCEPTED
    count = len(autopilot.missions.mission.items)
    autopilot.say(mavlink.MAV_SEVERITY_CRITICAL, f"No mission item {seq:g}, there are {count}")
    return CommandResult.DENIED
