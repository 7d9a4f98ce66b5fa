"""Which dialect a vehicle speaks."""

from __future__ import annotations

import asyncio
from math import inf
from typing import Any

from mavsdk.asyncio import Autopilot, MavsdkError, Vehicle
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.info import InfoAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync

from framerunner.wire.vehicle_identity import is_simulator
from offboard.drone import DroneError
from offboard.link.ardupilot import ArduPilotDialect, SteppedArduPilotDialect
from offboard.link.dialect import Dialect
from offboard.link.px4 import Px4Dialect, SteppedPx4Dialect
from offboard.link.telemetry import TelemetryFeed

_IDENTITY_TRIES = 15
_IDENTITY_AGAIN_S = 0.2  # wall time; MAVSDK requests the identity itself when it finds a vehicle


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
    system_id = await system.get_system_id()
    if stepped:
        return SteppedPx4Dialect(direct, system_id)
    own = await is_own_autopilot(InfoAsync(system), system_id)
    return Px4Dialect(OffboardAsync(system), action, has_resets=not own)


async def is_own_autopilot(info: Any, system_id: int) -> bool:  # noqa: ANN401
    """Whether a vehicle says that it is framerunner's simulated drone, which presents itself as PX4.

    Args:
        info: MAVSDK's asyncio plugin.
        system_id: the vehicle's.
    """
    for _ in range(_IDENTITY_TRIES):
        try:
            identification = await info.get_identification()
        except MavsdkError:  # not received yet
            await asyncio.sleep(_IDENTITY_AGAIN_S)
        else:
            return is_simulator(identification.legacy_uid, system_id)
    return False
