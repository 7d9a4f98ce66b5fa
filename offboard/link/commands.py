"""What is sent to a vehicle through MAVSDK: the stream of velocity setpoints, and requests with an answer.

MAVSDK 4.1 sends a setpoint at once when it is set, and repeats it at 20 Hz on a thread of its own. It ends
this when a heartbeat shows another mode than offboard (not in the first three seconds after it has requested
offboard); the next setpoint starts it again. So an app that needs fresh setpoints while others have the
vehicle sets them repeatedly, and an app that stops doing so leaves no stream running.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable
from math import degrees
from typing import Any

from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.plugins.offboard import VelocityBodyYawspeed

from offboard.drone import VelocityCommand

_MAX_REQUEST_S = 10.0  # MAVSDK gives a request up before that


class SetpointStream:
    """Setpoints to one vehicle, until `end`.

    Args:
        plugin: MAVSDK's.

    Attributes:
        ended: no setpoint is sent, and no mode can be requested through the plugin.
    """

    def __init__(self, plugin: OffboardAsync) -> None:
        self.ended = False
        self._plugin = plugin
        # It stores four numbers (5 us); the asyncio one takes an executor job (190 us).
        self._direct: Any = synchronous(plugin)
        self._setpoint = VelocityBodyYawspeed(0.0, 0.0, 0.0, 0.0)
        self._lock = threading.Lock()  # the watchdog's thread uses it, too

    def send(self, command: VelocityCommand) -> None:
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
        """Request offboard mode. Raises `MavsdkError`."""
        await self._plugin.start()

    async def request_hold(self) -> None:
        """End the stream until the next setpoint, and request hold mode. Raises `MavsdkError`."""
        await self._plugin.stop()

    def request_hold_blocking(self) -> None:
        """The same from a thread, which waits for the answer. Raises `MavsdkError`."""
        self._direct.stop()

    def end(self) -> None:
        """End the stream permanently, without a request; from any thread."""
        with self._lock:
            self.ended = True
            self._direct.destroy()


class PendingRequests:
    """Requests to MAVSDK. Each blocks a thread until its answer, and must end before MAVSDK is destroyed."""

    def __init__(self) -> None:
        self._pending: set[asyncio.Future[object]] = set()

    async def wait(self, request: Awaitable[object]) -> None:
        """Wait for the answer; the request continues even if this wait is cancelled.

        Raises:
            MavsdkError: it was refused, or not answered.
        """
        future = asyncio.ensure_future(request)
        self._pending.add(future)
        future.add_done_callback(self._done)
        await asyncio.shield(future)

    async def wait_for_all(self) -> None:
        """Wait until none is pending."""
        if self._pending:
            await asyncio.wait(self._pending, timeout=_MAX_REQUEST_S)

    def _done(self, future: asyncio.Future[object]) -> None:
        self._pending.discard(future)
        if not future.cancelled():
            future.exception()  # read, so that asyncio does not warn if the wait was cancelled


def synchronous(wrapper: Any) -> Any:  # noqa: ANN401 - MAVSDK is untyped
    """The synchronous object inside one of MAVSDK's asyncio wrappers; they have no public access to it."""
    inner = getattr(wrapper, "_plugin", None)
    return wrapper._system if inner is None else inner
