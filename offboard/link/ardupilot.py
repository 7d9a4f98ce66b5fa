"""ArduCopter's dialect: GUIDED mode instead of offboard, and a take-off that must be requested.

How ArduCopter 4.7 behaves (its `mode_guided.cpp`, `takeoff.cpp`, `GCS_MAVLink_Copter.cpp`):

- In GUIDED it follows SET_POSITION_TARGET_LOCAL_NED. A velocity in MAV_FRAME_BODY_NED is turned with the
  heading at its arrival and stays fixed in the world until the next one, as PX4's. When none arrives for
  `GUID_TIMEOUT` (3 s by default) it stops and hovers.
- On the ground it ignores velocities. MAV_CMD_NAV_TAKEOFF starts the motors and climbs until a velocity
  arrives; one that arrives before the drone has left the ground ends the take-off.
- LOITER follows the sticks, and without sticks it descends. BRAKE stops and hovers without sticks.
- It sends only HEARTBEAT and STATUSTEXT until streams are requested.

Setpoints are sent here, not by MAVSDK's offboard plugin: its thread repeats them at 20 Hz, which would end
each take-off. So a hung app sends nothing, and `GUID_TIMEOUT` acts.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable
from math import inf
from typing import Any

from mavsdk.asyncio import MavsdkError

from framerunner.wire import ardupilot_modes
from framerunner.wire.dialect import mavlink
from offboard.drone import VelocityFluCommand
from offboard.link.dialect import AutopilotKind, ModeNames
from offboard.link.direct import DirectDialect, DirectMessages
from offboard.link.stepped import SteppedDialect
from offboard.link.telemetry import TelemetryFeed

TAKEOFF_HEIGHT_M = 1.0  # requested; velocities take over as soon as the drone is off the ground
TAKEOFF_SHARE = 0.7  # likewise, of the room below the ceiling at most
TAKEOFF_CLIMB_M_S = 0.05  # a command on the ground to climb faster than this is a take-off
TAKEOFF_AGAIN_US = 5_000_000  # vehicle time; arming takes 2 s and the motors' start half a second
STREAMS_HZ = {
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 50.0,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 50.0,
    mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: 200.0,  # it refuses more than 0.8 of its loop's rate, here 250 Hz
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 10.0,
    mavlink.MAVLINK_MSG_ID_SYS_STATUS: 2.0,
    mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: 1.0,
}
ARDUPILOT = AutopilotKind(
    name="ArduPilot",
    modes=ModeNames(offboard="GUIDED", hold="BRAKE", land="LAND", manual=ardupilot_modes.MANUAL_MODES),
    offboard=(1.0, float(ardupilot_modes.GUIDED)),
    hold=(1.0, float(ardupilot_modes.BRAKE)),
    land=(1.0, float(ardupilot_modes.LAND)),
    ready_limit_s=90.0,  # its estimator uses GPS some 40 s after its start
    checks_in_offboard=True,
    numbered_modes=ardupilot_modes.NAMES,
    tells_accuracy=False,
)


class Setpoints:
    """Velocities to one ArduCopter; on the ground, one that climbs is a request to take off.

    Args:
        messages: to it.
        feed: its telemetry, which shows whether it is on the ground.
        room_above_m: from the start to the ceiling, which its take-off must not reach.
    """

    def __init__(self, messages: DirectMessages, feed: TelemetryFeed, room_above_m: float) -> None:
        self._messages, self._feed = messages, feed
        self._takeoff_height_m = min(TAKEOFF_HEIGHT_M, TAKEOFF_SHARE * room_above_m)
        self._takeoff_us: int | None = None  # vehicle time at which take-off was last requested
        feed.needs_landed_state = True  # else each climb in the air would be taken for a take-off

    def send(self, command: VelocityFluCommand) -> None:
        """Send a velocity, or request take-off."""
        if self._stands_ready and command.up_m_s > TAKEOFF_CLIMB_M_S:
            self._take_off()
        else:
            self._takeoff_us = None
            self._messages.send_velocity(command)

    @property
    def _stands_ready(self) -> bool:
        """Armed in GUIDED on the ground."""
        feed = self._feed
        return feed.landed and feed.mode == ARDUPILOT.modes.offboard and feed.arming.is_armed(feed.time_us)

    def _take_off(self) -> None:
        """Request take-off, and again when the drone is still on the ground after some seconds."""
        now_us = self._feed.time_us
        if self._takeoff_us is None or now_us - self._takeoff_us > TAKEOFF_AGAIN_US:
            self._takeoff_us = now_us
            self._messages.send_command(mavlink.MAV_CMD_NAV_TAKEOFF, *(0.0,) * 6, self._takeoff_height_m)


class ArduPilotDialect(DirectDialect):
    """One ArduCopter, by MAVSDK's plugins `action` and `mavlink_direct`; see the module and `Dialect`.

    Args:
        action: MAVSDK's asyncio plugin.
        direct: MAVSDK's asyncio plugin.
        feed: the vehicle's telemetry, which shows whether it is on the ground.
        system_id: the vehicle's.
        room_above_m: from the start to the ceiling, which its take-off must not reach.
    """

    kind = ARDUPILOT
    has_resets = True

    def __init__(
        self,
        action: Any,  # noqa: ANN401 - MAVSDK is untyped
        direct: Any,  # noqa: ANN401
        feed: TelemetryFeed,
        system_id: int,
        room_above_m: float = inf,
    ) -> None:
        super().__init__(direct, system_id)
        self._action = action
        self._setpoints = Setpoints(self._messages, feed, room_above_m)

    async def request_streams(self) -> None:
        """Request what a flight needs; what is refused is missing later, in words."""
        for message_id, rate_hz in STREAMS_HZ.items():
            with contextlib.suppress(MavsdkError):
                await self._command_long(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e6 / rate_hz)

    async def request_offboard(self) -> None:
        """Request GUIDED."""
        await self._command_long(mavlink.MAV_CMD_DO_SET_MODE, *self.kind.offboard)

    async def request_hold(self) -> None:
        """End the setpoints until the next one, and request BRAKE."""
        await asyncio.to_thread(self.request_hold_blocking)

    async def arm(self) -> None:
        """Arm."""
        await self._action.arm()

    async def kill(self) -> None:
        """Disarm at once, in the air too."""
        self._command = None
        await self._action.kill()

    async def land(self) -> None:
        """Request the mode LAND."""
        self._command = None
        await self._action.land()

    async def _command_long(self, number: int, *parameters: float) -> None:
        await asyncio.to_thread(self._messages.command, number, *parameters)

    def _transmit(self, command: VelocityFluCommand) -> None:
        self._setpoints.send(command)


class SteppedArduPilotDialect(SteppedDialect):
    """One ArduCopter; see `SteppedDialect`.

    ArduPilot's loop stands while its simulator does not answer, so it returns no PING then; the simulator
    does that for it (`sitl.ardupilot.relay`). All that was sent before is given to it when time goes on.

    Args:
        direct: MAVSDK's asyncio plugin.
        feed: the vehicle's telemetry, which shows whether it is on the ground.
        system_id: the vehicle's.
        room_above_m: from the start to the ceiling, which its take-off must not reach.
    """

    kind = ARDUPILOT
    has_resets = True

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

    def _transmit(self, command: VelocityFluCommand) -> None:
        self._setpoints.send(command)


async def _answered(request: Awaitable[None]) -> None:
    """Wait for an answer, whatever it is."""
    with contextlib.suppress(MavsdkError):
        await request
