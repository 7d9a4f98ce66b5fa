"""Which dialect a vehicle speaks."""

from __future__ import annotations

from typing import Any

from mavsdk.asyncio import Autopilot
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync

from offboard.link.ardupilot import ArduPilotDialect
from offboard.link.dialect import Dialect, Px4Dialect
from offboard.link.telemetry import TelemetryFeed


async def open_dialect(system: Any, direct: Any, feed: TelemetryFeed) -> Dialect:  # noqa: ANN401
    """The dialect of one of MAVSDK's systems, by the autopilot in its HEARTBEAT.

    Args:
        system: MAVSDK's asyncio system.
        direct: its asyncio plugin `mavlink_direct`.
        feed: the vehicle's telemetry.
    """
    action = ActionAsync(system)
    if await system.autopilot_type() == Autopilot.ARDUPILOT:
        return ArduPilotDialect(action, direct, feed, await system.get_system_id())
    return Px4Dialect(OffboardAsync(system), action)
