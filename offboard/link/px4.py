"""PX4's dialect, by MAVSDK's plugins, and for a simulation whose time waits for this app.

MAVSDK 4.1 sends a setpoint at once when it is set, and repeats it at 20 Hz on a thread of its own. It ends
this when a heartbeat shows another mode than offboard (not in the first three seconds after it has requested
offboard); the next setpoint starts it again. So an app that needs fresh setpoints while others have the
vehicle sets them repeatedly, and an app that stops doing so leaves no stream running.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from math import degrees
from typing import Any

from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.plugins.offboard import VelocityBodyYawspeed

from framerunner.wire import px4_modes
from framerunner.wire.dialect import mavlink
from framerunner.wire.px4_modes import Px4Mode
from offboard.drone import VelocityFluCommand
from offboard.link import inertial
from offboard.link.dialect import AutopilotKind, Dialect, ModeNames
from offboard.link.direct import synchronous
from offboard.link.stepped import SteppedDialect

_TAKEN_S = 0.3  # wall time in which PX4 takes a request that it cannot return a PING after
STREAMS_HZ = {
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 50.0,
    mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: inertial.RATE_HZ,
    mavlink.MAVLINK_MSG_ID_ODOMETRY: inertial.ACCURACY_HZ,
}


def _parameters(mode: Px4Mode) -> tuple[float, ...]:
    """Those of the MAV_CMD that requests a mode."""
    return (1.0, float(mode.main), float(mode.sub))


PX4 = AutopilotKind(
    name="PX4",
    modes=ModeNames(
        offboard="OFFBOARD",
        hold="HOLD",
        land="LAND",
        manual=frozenset({"MANUAL", "ALTCTL", "POSCTL", "ACRO", "STABILIZED", "RATTITUDE"}),
    ),
    offboard=_parameters(px4_modes.OFFBOARD),
    hold=_parameters(px4_modes.HOLD),
    land=_parameters(px4_modes.LAND),
    ready_limit_s=30.0,
)


class Px4Dialect(Dialect):
    """PX4, by MAVSDK's plugins `offboard` and `action`, whose thread repeats setpoints.

    Args:
        offboard: the plugin.
        action: likewise.
        has_resets: framerunner's own autopilot, which presents itself as PX4, has none.
    """

    kind = PX4

    def __init__(
        self,
        offboard: OffboardAsync,
        action: Any,  # noqa: ANN401 - MAVSDK is untyped
        has_resets: bool = False,
    ) -> None:
        self.has_resets = has_resets
        self._offboard, self._action = offboard, action
        # It stores four numbers (5 us); the asyncio one takes an executor job (190 us).
        self._direct: Any = synchronous(offboard)
        self._setpoint = VelocityBodyYawspeed(0.0, 0.0, 0.0, 0.0)
        self._lock = threading.Lock()  # the watchdog's thread uses it, too

    async def request_streams(self) -> None:
        """Nothing: PX4 sends all streams by itself."""

    def send(self, command: VelocityFluCommand) -> None:
        """Send a velocity from now on; ignored after `end`."""
        setpoint = self._setpoint
        with self._lock:
            setpoint.forward_m_s = command.forward_m_s
            setpoint.right_m_s = -command.left_m_s
            setpoint.down_m_s = -command.up_m_s
            setpoint.yawspeed_deg_s = -degrees(command.yaw_rate_rad_s)
            if not self.ended:
                self._direct.set_velocity_body(setpoint)

    async def request_offboard(self) -> None:
        """Request offboard mode."""
        await self._offboard.start()

    async def request_hold(self) -> None:
        """End the stream until the next setpoint, and request hold."""
        # Not through the plugin if the watchdog has ended the stream.
        await (self._action.hold() if self.ended else self._offboard.stop())

    def request_hold_blocking(self) -> None:
        """The same from a thread, which waits for the answer."""
        self._direct.stop()

    def request_land_blocking(self) -> None:
        """End the stream permanently and request the mode land, from a thread."""
        self.end()
        synchronous(self._action).land()

    async def arm(self) -> None:
        """Arm."""
        await self._action.arm()

    async def kill(self) -> None:
        """Disarm at once, in the air too."""
        await self._action.kill()

    async def land(self) -> None:
        """Request the mode land."""
        await self._action.land()

    def end(self) -> None:
        """End the stream permanently, without a request; from any thread."""
        with self._lock:
            self.ended = True
            self._direct.destroy()


class SteppedPx4Dialect(SteppedDialect):
    """One PX4, which returns PINGs itself; see `SteppedDialect`."""

    kind = PX4
    has_resets = True

    def __init__(self, direct: Any, system_id: int) -> None:  # noqa: ANN401 - MAVSDK is untyped
        super().__init__(direct, system_id)
        self._to_request: deque[tuple[int, float]] = deque()
        self._requested = asyncio.Event()

    async def request_streams(self) -> None:
        """Request what the app uses as often as it does, one of them a tick.

        After each request PX4's thread that receives messages waits until time has gone on. What is refused
        is missing later, in words.
        """
        self._to_request.extend(STREAMS_HZ.items())
        await self._requested.wait()

    async def _until_taken(self) -> None:
        if self._to_request:
            message_id, rate_hz = self._to_request.popleft()
            self._messages.send_command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e6 / rate_hz)
            await asyncio.sleep(_TAKEN_S)
        else:
            self._requested.set()
            await super()._until_taken()
