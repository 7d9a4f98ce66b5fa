"""ArduCopter's dialect in a simulation whose time waits for this app.

ArduPilot's loop stands while its simulator does not answer, so it returns no PING then; the simulator does
that for it (`sitl.ardupilot.relay`). All that was sent before is given to ArduPilot when time goes on.
"""

from __future__ import annotations

import contextlib
from collections.abc import Awaitable
from math import inf
from typing import Any

from mavsdk.asyncio import MavsdkError

from framerunner.wire import ardupilot_modes
from framerunner.wire.dialect import mavlink
from offboard.drone import ResponsePrior, VelocityCommand
from offboard.link.ardupilot import ARDUPILOT_MODES, READY_LIMIT_S, STREAMS_HZ, Setpoints
from offboard.link.stepped import SteppedDialect
from offboard.link.telemetry import TelemetryFeed


class SteppedArduPilotDialect(SteppedDialect):
    """One ArduCopter; see `SteppedDialect` and the module.

    Args:
        direct: MAVSDK's asyncio plugin.
        feed: the vehicle's telemetry, which shows whether it is on the ground.
        system_id: the vehicle's.
        room_above_m: from the start to the ceiling, which its take-off must not reach.
    """

    NAME = "ArduPilot"
    OFFBOARD = (1.0, float(ardupilot_modes.GUIDED))
    HOLD = (1.0, float(ardupilot_modes.BRAKE))
    LAND = (1.0, float(ardupilot_modes.LAND))

    modes = ARDUPILOT_MODES
    numbered_modes = ardupilot_modes.NAMES
    response_prior = ResponsePrior.UNKNOWN
    checks_in_offboard = True
    ready_limit_s = READY_LIMIT_S

    def __init__(
        self,
        direct: Any,  # noqa: ANN401 - MAVSDK is untyped
        feed: TelemetryFeed,
        system_id: int,
        room_above_m: float = inf,
    ) -> None:
        super().__init__(direct, system_id)
        self._setpoints = Setpoints(self._messages, feed, room_above_m)

    def request_streams(self) -> Awaitable[None]:
        """Request what a flight needs, before time goes on; what is refused is missing later, in words."""
        number, streams = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, list(STREAMS_HZ.items())
        for message_id, rate_hz in streams[:-1]:
            self._messages.send_command(number, message_id, 1e6 / rate_hz)
        message_id, rate_hz = streams[-1]
        return _answered(self._request(number, message_id, 1e6 / rate_hz))

    def _transmit(self, command: VelocityCommand) -> None:
        self._setpoints.send(command)


async def _answered(request: Awaitable[None]) -> None:
    """Wait for an answer, whatever it is."""
    with contextlib.suppress(MavsdkError):
        await request
