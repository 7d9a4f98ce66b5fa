"""Which dialect a vehicle speaks."""

from __future__ import annotations

from math import inf
from typing import Any

from mavsdk.asyncio import Autopilot, Vehicle
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync

from offboard.drone import DroneError
from offboard.link.ardupilot import ArduPilotDialect
from offboard.link.dialect import Dialect, Px4Dialect
from offboard.link.stepped_ardupilot import SteppedArduPilotDialect
from offboard.link.stepped_px4 import SteppedPx4Dialect
from offboard.link.telemetry import TelemetryFeed


async def open_dialect(
    system: Any,  # noqa: ANN401 - MAVSDK is untyped
    direct: Any,  # noqa: ANN401
    feed: TelemetryFeed,
    room_above_m: float = inf,
    *,
    stepped: bool = False,
) -> Dialect:
    """The dialect of one of MAVSDK's systems, by the autopilot in its HEARTBEAT.

    Args:
        system: MAVSDK's asyncio system.
        direct: its asyncio plugin `mavlink_direct`.
        feed: the vehicle's telemetry.
        room_above_m: from the start to the ceiling under which the vehicle must stay.
        stepped: its time waits for this app.

    Raises:
        DroneError: it is ArduPilot, but no multicopter: the numbers of its modes mean others.
    """
    if await system.autopilot_type() == Autopilot.ARDUPILOT:
        kind = await system.vehicle_type()
        if kind in (Vehicle.FIXED_WING, Vehicle.ROVER, Vehicle.SUBMARINE):
            raise DroneError(f"the vehicle is a {kind.name.lower().replace('_', ' ')}; use a multicopter")
        system_id = await system.get_system_id()
        if stepped:
            return SteppedArduPilotDialect(direct, feed, system_id, room_above_m)
        return ArduPilotDialect(ActionAsync(system), direct, feed, system_id, room_above_m)
    action = ActionAsync(system)  # requests EXTENDED_SYS_STATE once a second, for the first dialect, too
    if stepped:
        return SteppedPx4Dialect(direct, await system.get_system_id())
    return Px4Dialect(OffboardAsync(system), action)
